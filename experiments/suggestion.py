"""Suggested frames against random ones: what posing them is worth to a method.

    python -m experiments.suggestion [--repeats 20] [--few 5] [--labels 10 20 40] [--method auto]

Each draw takes a random 60 % of a track as the frames that can be posed; 100 unlabelled poses, 100
unlabelled frames and the frames to test on come from the others. `facert suggest` and a random
choice pose frames of the same 60 %, and meet the same test. In fewer draws (`--few`) *all* frames
that can be posed serve as unlabelled ones; there the suggestion is also tried *in two goes*: one
half was posed when the other was suggested.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from threadpoolctl import threadpool_limits

from experiments.grid import OPTICAL, basic_options, begin_log, kinds, log
from experiments.report import markdown, mean_with_error, with_error, write_csv, write_text
from experiments.tracks import part, read_track
from facert import Settings, Take, train
from facert.data.arrays import FloatArray, IntArray, rms
from facert.evaluation.paired import MeanWithError, paired_ratio
from facert.posing.suggested_frames import suggest_frames
from facert.retarget.options import AS_IT_IS

POSABLE, UNLABELLED, TESTED = 0.6, 100, 300
RANDOM, SUGGESTED, TWO_GOES = "random", "suggested", "in two goes"


@dataclass(frozen=True, eq=False)
class Draw:
    """Frames of a track: those that can be posed, unlabelled ones and poses, and the test's."""

    posable: IntArray
    unlabelled: IntArray
    poses: IntArray
    test: IntArray
    seed: int

    @classmethod
    def of(cls, take: Take, seed: int, everything: bool) -> Draw:
        """The draw of a seed; everything: what can be posed is the unlabelled part as well."""
        order = np.random.default_rng([seed, 0]).permutation(len(take))
        first = round(POSABLE * len(take))
        parts = np.split(order, np.cumsum([first, UNLABELLED, UNLABELLED, TESTED]))
        posable, unlabelled, poses, test = (np.sort(part) for part in parts[:4])
        return cls(posable, posable if everything else unlabelled, poses, test, seed)


def at_random(take: Take, count: int, seed: int) -> IntArray:
    """Frames chosen at random."""
    return np.random.default_rng([seed, 1]).permutation(len(take))[:count]


def suggested(take: Take, count: int, seed: int) -> IntArray:
    """The frames that facert suggests."""
    return suggest_frames(take, count, seed=seed).frames


def in_two_goes(take: Take, count: int, seed: int) -> IntArray:
    """Suggested frames, one half after the other was posed."""
    first = suggested(take, count // 2, seed)
    more = suggest_frames(take, count - len(first), have=first, seed=seed).frames
    return np.concatenate([first, more])


CHOICES: dict[str, Callable[[Take, int, int], IntArray]] = {
    RANDOM: at_random,
    SUGGESTED: suggested,
    TWO_GOES: in_two_goes,
}


def error(take: Take, draw: Draw, labels: IntArray, method: str) -> float:
    """RMS over the test frames of a method that was shown the poses of these frames."""
    assert take.params is not None
    given = part(take, np.union1d(labels, draw.unlabelled), labels, draw.poses)
    settings = Settings(method=method, seed=draw.seed, detect=False, smooth=False)
    result = train(given, settings).retarget(part(take, draw.test), options=AS_IT_IS)
    assert result.params is not None
    return rms(result.params - take.params[draw.test])


@dataclass(frozen=True, eq=False)
class Cell:
    """RMS of each choice on a track at a number of labels, (repeats,)."""

    track: str
    target: str
    unlabelled: str
    labels: int
    errors: dict[str, FloatArray]

    def ratio(self, choice: str) -> MeanWithError:
        """Ratio of the mean RMS to that of random frames."""
        return paired_ratio(self.errors[choice], self.errors[RANDOM])


def measure(track: str, target: str, everything: bool, given: argparse.Namespace) -> Iterator[Cell]:
    """A track with every number of labels; everything: with all other posable frames."""
    take = read_track(track, target)
    unlabelled = "all" if everything else str(UNLABELLED)
    for labels in given.labels:
        choices = {name: c for name, c in CHOICES.items() if everything or name != TWO_GOES}
        errors: dict[str, list[float]] = {choice: [] for choice in choices}
        for seed in range(given.few if everything else given.repeats):
            draw = Draw.of(take, seed, everything)
            seen = part(take, draw.posable)
            for name, choose in choices.items():
                frames = draw.posable[choose(seen, labels, seed)]
                errors[name].append(error(take, draw, frames, given.method))
        found = {choice: np.array(values) for choice, values in errors.items()}
        cell = Cell(track, target, unlabelled, labels, found)
        log.info("%s, %s, %s unlabelled, %d labels: %.3f", track, target, unlabelled, labels,
                 cell.ratio(SUGGESTED).value)  # fmt: skip
        yield cell


def summary(cells: Sequence[Cell]) -> str:
    """The mean over the cells of the ratio to random frames."""
    lines = []
    for unlabelled, labels in dict.fromkeys((cell.unlabelled, cell.labels) for cell in cells):
        some = [c for c in cells if (c.unlabelled, c.labels) == (unlabelled, labels)]
        for choice in (name for name in CHOICES if name != RANDOM and name in some[0].errors):
            speech = [cell for cell in some if cell.track not in OPTICAL]
            worst = max(cell.ratio(choice).value for cell in some)
            means = [mean_of(speech, choice), mean_of(some, choice)]
            lines.append([unlabelled, choice, str(labels), *means, f"{worst:.3f}"])
    header = [
        "unlabelled",
        "choice",
        "labels",
        "three tracks",
        "with the optical ones",
        "worst cell",
    ]
    return markdown(header, lines, texts=2)


def mean_of(cells: Sequence[Cell], choice: str) -> str:
    """The mean over cells of the ratio to random frames, with its standard error."""
    return mean_with_error([cell.ratio(choice) for cell in cells])


def each(cells: Sequence[Cell]) -> str:
    """Every cell, choice by choice."""
    lines = []
    for cell in cells:
        name = f"{cell.track}, {cell.target}, {cell.unlabelled} unlabelled, {cell.labels} labels"
        line = [name, str(len(cell.errors[RANDOM])), f"{cell.errors[RANDOM].mean():.4f}"]
        for choice in list(CHOICES)[1:]:
            shown = choice in cell.errors
            line += [_rms_and_ratio(cell, choice)] if shown else [""]
        lines.append(line)
    return markdown(["cell", "draws", *CHOICES], lines)


def _rms_and_ratio(cell: Cell, choice: str) -> str:
    return f"{cell.errors[choice].mean():.4f} ({with_error(cell.ratio(choice))})"


def records(cells: Sequence[Cell]) -> list[dict[str, object]]:
    """A line of the CSV file for each cell and choice."""
    return [
        {
            "track": cell.track,
            "target": cell.target,
            "unlabelled": cell.unlabelled,
            "labels": cell.labels,
            "choice": choice,
            "repeats": len(errors),
            "rms": MeanWithError.of(errors).value,
            "rms_se": MeanWithError.of(errors).se,
            "over_random": cell.ratio(choice).value,
            "over_random_se": cell.ratio(choice).se,
        }
        for cell in cells
        for choice, errors in cell.errors.items()
    ]


def write(cells: Sequence[Cell], given: argparse.Namespace) -> None:
    """The table and the CSV file, of as many cells as there are."""
    parts = [
        "# Suggested frames against random ones",
        f"RMS of `{given.method}` divided by that with as many random frames, mean over tracks and"
        " targets, with its standard error. Written by `python -m experiments.suggestion`, which"
        " describes how frames are drawn.",
        summary(cells),
        "## Cell by cell",
        "RMS, and in brackets its ratio to that with random frames.",
        each(cells),
    ]
    write_text(given.results / "suggestion.md", parts)
    write_csv(given.results / "suggestion.csv", records(cells))


def main() -> None:
    parser = basic_options(__doc__, repeats=20)
    parser.add_argument("--labels", nargs="+", type=int, default=[10, 20, 40])
    parser.add_argument("--method", default="auto")
    parser.add_argument("--few", type=int, default=5, help="draws with all frames (%(default)s)")
    given = parser.parse_args()
    begin_log()
    cells: list[Cell] = []
    with threadpool_limits(1):
        for everything in (False, True):
            for track, target in kinds(given.tracks):
                if (given.few if everything else given.repeats) > 0:
                    cells += measure(track, target, everything, given)
                    write(cells, given)
    print(summary(cells))


if __name__ == "__main__":
    main()

"""A second take of the same actor: what a few of its poses, or none, are worth.

    python -m experiments.second_take [--labels 10 20 40] [--more 5] [--weights]

A model is trained on suggested frames of one track (`--labels`). Of another track of the same actor
`--more` frames are posed that `facert suggest --have MODEL` names, and a model is trained on both.
RMS over the other frames of either track, for every pair of tracks:

    second  of the second track, by a model of the first track alone, of the few poses of the second
            alone, and of both; and of the first, with the second as a take without any pose
    first   of the first track, by the first model and by that of both

Frames are taken as they are recorded (they are free of noise), as markers; with `--weights` as the
phone's weights, whose target is the other rig's units. Tables go into experiments/results.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from itertools import permutations

import numpy as np
from threadpoolctl import threadpool_limits

from experiments.grid import OPTICAL, RESULTS, SPEECH, begin_log, log
from experiments.report import markdown, write_csv, write_text
from experiments.tracks import DATA, read_track
from facert import Retargeter, Settings, Take, read_take, train
from facert.data.arrays import IntArray, rms
from facert.data.take import Controls
from facert.posing.suggested_frames import suggest_frames
from facert.retarget.options import AS_IT_IS

AS_RECORDED = Settings(detect=False, smooth=False)
TESTED = 3  # every third frame is tested
PROBLEMS = (("units", SPEECH), ("arkit", SPEECH), ("solved", OPTICAL))
HEADER = (
    *("target", "first", "second", "labels", "first alone", "second alone", "both", "both / best"),
    *("no pose in the second", "both, in the first"),
)


@dataclass(frozen=True)
class Row:
    """Errors of one pair of tracks."""

    target: str
    first: str
    second: str
    labels: int
    alone: float
    few: float
    both: float
    unposed: float  # Of the first with the second as a take without a pose
    # In the first track
    alone_there: float
    both_there: float

    @property
    def ratios(self) -> tuple[float, float, float]:
        """Of the last three columns."""
        return (
            self.both / min(self.alone, self.few),
            self.unposed / self.alone,
            self.both_there / self.alone_there,
        )

    @property
    def cells(self) -> list[str]:
        """The row of the table."""
        errors = (f"{value:.4f}" for value in (self.alone, self.few, self.both))
        names = (self.target, self.first, self.second, str(self.labels))
        return [*names, *errors, *(f"{value:.3f}" for value in self.ratios)]


def posed(take: Take, frames: IntArray) -> Take:
    """The take with the poses of these frames alone."""
    assert take.params is not None
    chosen = np.isin(np.arange(len(take)), frames)[:, None]
    return replace(take, params=np.where(chosen, take.params, np.nan))


def error(model: Retargeter, truth: Take, without: IntArray) -> float:
    """RMS over the frames of a take but for some."""
    frames = np.setdiff1d(np.arange(0, len(truth), TESTED), without)
    source = truth.source.with_matrix(truth.source.matrix[frames])
    some = replace(truth, time=truth.time[frames], source=source, params=None)
    result = model.retarget(some, options=AS_IT_IS)
    assert result.params is not None
    assert truth.params is not None
    return rms(result.params - truth.params[frames])


def pairs(
    target: str, tracks: tuple[str, ...], weights: bool
) -> Iterator[tuple[str, str, Take, Take]]:
    """Pairs of tracks with the controls that both have."""
    takes = {name: read_track(name, target) for name in tracks}
    if weights:
        takes = {name: tracked(take, name) for name, take in takes.items()}
    for one, other in permutations(tracks, 2):
        yield one, other, *_shared(takes[one], takes[other])


def tracked(take: Take, name: str) -> Take:
    """The poses of a track with the recording that it was made of as their source."""
    recording = read_take(DATA / "recordings" / f"{name}.csv")
    return replace(take, time=recording.time, source=recording.source, units="")


def _shared(one: Take, other: Take) -> tuple[Take, Take]:
    assert one.controls is not None
    assert other.controls is not None
    names = tuple(name for name in one.controls.names if name in other.controls.names)
    return _cut(one, names), _cut(other, names)


def _cut(take: Take, names: tuple[str, ...]) -> Take:
    assert take.controls is not None
    assert take.params is not None
    columns = [take.controls.names.index(name) for name in names]
    return replace(take, controls=Controls(names), params=take.params[:, columns])


def measure(
    target: str, tracks: tuple[str, ...], labels: int, more: int, weights: bool
) -> Iterator[Row]:
    """The rows of all pairs of some tracks."""
    for one, other, first, second in pairs(target, tracks, weights):
        frames = suggest_frames(first, labels).frames
        given = posed(first, frames)
        model = train(given, AS_RECORDED)
        few = suggest_frames(replace(second, params=None), more, have=model).frames
        added = posed(second, few)
        both = train([given, added], AS_RECORDED)
        unposed = train([given, replace(second, params=None)], AS_RECORDED)
        row = Row(
            *(target, one, other, labels),
            alone=error(model, second, few),
            few=error(train(added, AS_RECORDED), second, few),
            both=error(both, second, few),
            unposed=error(unposed, second, few),
            alone_there=error(model, first, frames),
            both_there=error(both, first, frames),
        )
        log.info("%s", row)
        yield row


def main() -> None:
    """Measure, and write the tables."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--labels", type=int, nargs="+", default=[10, 20, 40])
    parser.add_argument("--more", type=int, default=5)
    parser.add_argument("--weights", action="store_true", help="the phone's weights as source")
    options = parser.parse_args()
    begin_log()
    rows: list[Row] = []
    with threadpool_limits(1):
        for labels in options.labels:
            for target, tracks in PROBLEMS[:1] if options.weights else PROBLEMS:
                for row in measure(target, tracks, labels, options.more, options.weights):
                    rows.append(row)
                    write(rows, options.more, "_weights" if options.weights else "")
    print(summary(rows))


def summary(rows: list[Row]) -> str:
    """Mean and worst ratios by the number of labels."""
    cells = []
    for labels in sorted({row.labels for row in rows}):
        ratios = np.array([row.ratios for row in rows if row.labels == labels])
        means, worst = np.exp(np.log(ratios).mean(axis=0)), ratios.max(axis=0)
        numbers = (f"{m:.3f} ({w:.3f})" for m, w in zip(means, worst, strict=True))
        cells.append([str(labels), *numbers])
    return markdown(("labels", *HEADER[-3:]), cells, texts=0)


def write(rows: list[Row], more: int, which: str) -> None:
    """The table and the CSV file, of as many pairs as there are."""
    parts = [
        "# A second take of the same actor",
        f"RMS in a second track of models of the first, of {more} suggested poses of the second and"
        " of both; and ratios: of both to the better of these two; of the first with the second as"
        " a take without a pose, to the first alone; and of both to the first alone in the first"
        f" track. Written by `python -m experiments.second_take{' --weights' * bool(which)}`.",
        "Means, and in brackets the worst:",
        summary(rows),
        markdown(HEADER, [row.cells for row in rows], texts=3),
    ]
    write_text(RESULTS / f"second_take{which}.md", parts)
    write_csv(RESULTS / f"second_take{which}.csv", [asdict(row) for row in rows])


if __name__ == "__main__":
    main()

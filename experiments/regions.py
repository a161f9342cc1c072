"""What regions do against wrong correlations: brows that rise because the mouth opens.

    python -m experiments.regions [--repeats 10] [--methods auto ssgplvm] [--tracks rom]

Each draw takes 10 labels, 100 unlabelled frames, 100 poses and 300 frames to test on. Labels are
random, or *together*: of 300 random sets the one in which brows and mouth are active together most,
as where an animator posed whole expressions. `auto` is also tried with 40 random labels. A method
learns the face as a whole, and with `--regions auto`.

*Mouth alone*: test frames whose brow controls are within 0.03 of rest (root mean square), and whose
mouth and jaw are further from it than in half of the take. There the error of the brows and their
activity, root mean square from rest, show what the mouth does to them. Rest is the median pose.
Frames are drawn one by one and have no neighbours in time: nothing is smoothed or detected.
Finished cells are kept in build/cells.
"""

from __future__ import annotations

import argparse
import logging
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

import facert
from experiments.grid import KEPT, OPTICAL, basic_options, begin_log, kinds
from experiments.report import markdown, mean_with_error, with_error, write_csv, write_text
from experiments.tracks import part, read_track
from facert import Settings, Take, train
from facert.data.arrays import FloatArray, IntArray, rms
from facert.data.names import control_groups
from facert.data.regions import AUTO
from facert.evaluation.paired import MeanWithError, paired_ratio
from facert.io.journal import Journal, source_digest
from facert.retarget.options import AS_IT_IS

log = logging.getLogger(__name__)

UNLABELLED, TESTED, CANDIDATES = 100, 300, 300
STILL = 0.03  # brows, root mean square from rest
RANDOM, TOGETHER = "random", "together"
WHOLE, APART = "whole", "regions"


@dataclass(frozen=True)
class Case:
    """What is measured: a problem, a choice of labels, a method."""

    track: str
    target: str
    noise: float
    choice: str
    labels: int
    method: str

    @property
    def name(self) -> str:
        """Name for people."""
        noise = f", noise {self.noise:g}" if self.noise else ""
        return f"{self.track}, {self.target}{noise}, {self.labels} {self.choice} labels"


@dataclass(frozen=True)
class Scores:
    """Scores of one draw: RMS of all controls, brows and mouth; and what the brows do alone.

    `error`, `activity` and `truth` are of the brows in frames in which the mouth alone moves: RMS
    of their error, and from rest as predicted and in truth; nan where there is no such frame.
    """

    rms: float
    brows: float
    mouth: float
    error: float
    activity: float
    truth: float


class Face:
    """A track, with its brow and mouth controls and how far they are from rest."""

    def __init__(self, take: Take) -> None:
        assert take.controls is not None
        assert take.params is not None
        groups = control_groups(take.controls.names)
        self.take, self.poses = take, take.params
        self.brows = groups["brows"]
        self.mouth = np.concatenate([groups["mouth"], groups.get("jaw", groups["mouth"][:0])])
        self.rest = np.median(take.params, axis=0)
        self.brow_activity = self._activity(self.brows)
        self.mouth_activity = self._activity(self.mouth)

    def _activity(self, controls: IntArray) -> FloatArray:
        """Root mean square from rest in each frame, (T,)."""
        moved = (self.poses - self.rest)[:, controls]
        return np.asarray(np.sqrt(np.mean(moved**2, axis=1)))

    def mouth_alone(self, frames: IntArray) -> IntArray:
        """Those of some frames in which the brows rest and the mouth is active."""
        active = self.mouth_activity > np.median(self.mouth_activity)
        return frames[(self.brow_activity < STILL)[frames] & active[frames]]

    def labels(self, choice: str, count: int, rng: np.random.Generator) -> IntArray:
        """Frames to pose."""
        if choice == RANDOM:
            return rng.permutation(len(self.take))[:count]
        sets = [rng.permutation(len(self.take))[:count] for _ in range(CANDIDATES)]
        return max(sets, key=self._go_together)

    def _go_together(self, frames: IntArray) -> float:
        activities = self.brow_activity[frames], self.mouth_activity[frames]
        return float(np.corrcoef(*activities)[0, 1])


def measure(face: Face, case: Case, regions: str | None, seed: int) -> Scores:
    """Train on a draw and test."""
    rng = np.random.default_rng(seed)
    labels = face.labels(case.choice, case.labels, rng)
    rest = rng.permutation(np.setdiff1d(np.arange(len(face.take)), labels))
    frames, poses, test = np.split(rest, np.cumsum([UNLABELLED, UNLABELLED]))
    test = np.sort(test[:TESTED])
    noise = case.noise * float(np.nanstd(face.take.source.matrix, axis=0).max())
    matrix = face.take.source.matrix
    noisy = matrix + noise * rng.standard_normal(matrix.shape)
    rows = np.union1d(labels, frames)
    take = replace(face.take, source=face.take.source.with_matrix(noisy))
    settings = Settings(method=case.method, seed=seed, regions=regions, smooth=False, detect=False)
    model = train(part(take, rows, labels, poses), settings)
    result = model.retarget(part(take, test), options=AS_IT_IS)
    assert result.params is not None
    return _scores(face, result.params, test)


def _scores(face: Face, predicted: FloatArray, test: IntArray) -> Scores:
    errors = predicted - face.poses[test]
    alone = np.isin(test, face.mouth_alone(test))
    brows = np.ix_(alone, face.brows)
    moved, true = predicted - face.rest, face.poses[test] - face.rest

    def size(values: FloatArray) -> float:
        return rms(values) if values.size else float("nan")

    return Scores(
        rms=rms(errors),
        brows=rms(errors[:, face.brows]),
        mouth=rms(errors[:, face.mouth]),
        error=size(errors[brows]),
        activity=size(moved[brows]),
        truth=size(true[brows]),
    )


@dataclass(frozen=True, eq=False)
class Cell:
    """The scores of a case, learned as a whole and in regions, a draw each."""

    case: Case
    whole: Sequence[Scores]
    apart: Sequence[Scores]

    def values(self, way: str, score: str) -> FloatArray:
        """One score of every draw that has it in both ways."""
        pairs = zip(self.whole, self.apart, strict=True)
        table = np.array([[getattr(one, score), getattr(two, score)] for one, two in pairs])
        kept = table[~np.isnan(table).any(axis=1)]
        return np.asarray(kept[:, 0 if way == WHOLE else 1])

    def ratio(self, score: str) -> MeanWithError | None:
        """Regions over the whole; None where fewer than two draws have the score."""
        whole, apart = self.values(WHOLE, score), self.values(APART, score)
        return paired_ratio(apart, whole) if len(whole) > 1 else None


def cases(given: argparse.Namespace) -> list[Case]:
    """All that is measured, the tracks of speech first."""
    return [
        Case(track, target, noise, choice, labels, method)
        for choice, labels in ((RANDOM, 10), (TOGETHER, 10), (RANDOM, 40))
        for method in given.methods
        for track, target in kinds(given.tracks)
        for noise in ((0.0,) if track in OPTICAL else (0.0, 0.05))
        if method == "auto" or (labels == 10 and track not in OPTICAL)
    ]


def cells(given: argparse.Namespace) -> Iterator[Cell]:
    """Measure every case, or take it from the journal."""
    code = source_digest(Path(facert.__file__).parent)
    journal = Journal(KEPT / "regions.jsonl", code)
    done = {
        _key(e["case"], e["way"], e["seed"]): Scores(**_numbers(e["scores"]))
        for e in journal.begin()
    }
    faces: dict[tuple[str, str], Face] = {}
    for case in cases(given):
        problem = case.track, case.target
        if problem not in faces:
            faces[problem] = Face(read_track(*problem))
        scores: dict[str, list[Scores]] = {WHOLE: [], APART: []}
        for seed in range(given.repeats):
            for way, regions in ((WHOLE, None), (APART, AUTO)):
                key = _key(asdict(case), way, seed)
                if key not in done:
                    done[key] = measure(faces[problem], case, regions, seed)
                    kept = {"case": asdict(case), "way": way, "seed": seed}
                    journal.add({**kept, "scores": _plain(done[key])})
                scores[way].append(done[key])
        cell = Cell(case, scores[WHOLE], scores[APART])
        log.info("%s, %s: %s", case.method, case.name, _ratio(cell))
        yield cell


def _key(case: dict[str, object], way: str, seed: int) -> str:
    return repr((sorted(case.items()), way, seed))


def _plain(scores: Scores) -> dict[str, float | None]:
    """JSON knows no nan."""
    return {name: None if np.isnan(value) else value for name, value in asdict(scores).items()}


def _numbers(values: dict[str, float | None]) -> dict[str, float]:
    return {name: float("nan") if value is None else value for name, value in values.items()}


def _ratio(cell: Cell) -> str:
    ratio = cell.ratio("rms")
    return "" if ratio is None else with_error(ratio)


def summary(found: Sequence[Cell]) -> str:
    """Means over cells, group by group."""
    groups: dict[tuple[str, str], list[Cell]] = {}
    for cell in found:
        case = cell.case
        kind = "optical" if case.track in OPTICAL else f"noise {case.noise:g}"
        groups.setdefault((case.method, f"{case.labels} {case.choice}, {kind}"), []).append(cell)
    lines = []
    for (method, name), some in groups.items():
        better = sum(
            float(c.values(APART, "rms").mean()) < c.values(WHOLE, "rms").mean() for c in some
        )
        line = [method, name, f"{better} of {len(some)}"]
        for score in ("rms", "brows", "mouth", "error"):
            ratios = [ratio for cell in some if (ratio := cell.ratio(score)) is not None]
            line.append(mean_with_error(ratios))
        line += [_mean_of(some, way, "activity") for way in (WHOLE, APART)]
        lines.append([*line, _mean_of(some, WHOLE, "truth")])
    header = ["method", "labels", "better", "RMS", "brows", "mouth", "brows, mouth alone"]
    header += ["activity, whole", "activity, regions", "in truth"]
    return markdown(header, lines, texts=2)


def _mean_of(some: Sequence[Cell], way: str, score: str) -> str:
    means = [values.mean() for cell in some if len(values := cell.values(way, score))]
    return f"{np.mean(means):.4f}" if means else ""


def each(found: Sequence[Cell]) -> str:
    """Cell by cell."""
    lines = []
    for cell in found:
        line = [cell.case.method, cell.case.name]
        line += [f"{cell.values(way, 'rms').mean():.4f}" for way in (WHOLE, APART)]
        line += [_ratio(cell)]
        for score in ("error", "activity"):
            line += [_mean_of([cell], way, score) for way in (WHOLE, APART)]
        lines.append([*line, _mean_of([cell], WHOLE, "truth")])
    header = ["method", "cell", "RMS, whole", "regions", "ratio", "brows' error, whole"]
    header += ["regions", "activity, whole", "regions", "in truth"]
    return markdown(header, lines, texts=2)


def records(found: Sequence[Cell]) -> list[dict[str, object]]:
    """A line of the CSV file for each draw."""
    return [
        {**asdict(cell.case), "way": way, "draw": draw, **asdict(scores)}
        for cell in found
        for way, some in ((WHOLE, cell.whole), (APART, cell.apart))
        for draw, scores in enumerate(some)
    ]


def write(found: Sequence[Cell], given: argparse.Namespace) -> None:
    """Tables and the CSV file of as many cells as there are."""
    parts = [
        "# Regions against the whole face",
        "Written by `python -m experiments.regions`, which describes what is measured:"
        f" {len(found)} of {len(cases(given))} cells, {given.repeats} draws each."
        " Ratios are of the error in regions to that of the whole face: below 1, regions are"
        " better. *Better*: cells whose mean RMS is lower. *Mouth alone*: the brows' error where"
        " the mouth alone moves; *activity*: how far they are from rest there.",
        summary(found),
        "## Cell by cell",
        each(found),
    ]
    write_text(given.results / "regions.md", parts)
    write_csv(given.results / "regions.csv", records(found))


def main() -> None:
    parser = basic_options(__doc__, repeats=10)
    parser.add_argument("--methods", nargs="+", default=["auto", "ssgplvm"])
    given = parser.parse_args()
    begin_log(log)
    found: list[Cell] = []
    with threadpool_limits(1):
        for cell in cells(given):
            found.append(cell)
            write(found, given)
    print(summary(found))


if __name__ == "__main__":
    main()

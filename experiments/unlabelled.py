"""RMS against unlabelled frames and poses, from 50 to 3,000 of each.

    python -m experiments.unlabelled [--repeats 3] [--jobs 2] [--most 3000]

Labels and test frames are drawn at random; unlabelled frames come from the front of what is left,
unlabelled poses from its back. Where the take is too short for both, some frames serve as either,
without the pairs of them that belong together. Three learn from them: the shared model as it is by
default, whose unlabelled rows weigh no more than 100; the same with the exact likelihood, in which
every row counts alike (up to 300: its time grows with the cube); and `auto`. Finished cells are
kept in build/cells: the same command continues an interrupted run.

Pictures and tables go into experiments/results.
"""

from __future__ import annotations

import argparse
import logging
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, replace
from itertools import product
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import facert
from experiments.drawing import save
from experiments.grid import KEPT, RESULTS, begin_log, code_of
from experiments.report import markdown, write_csv, write_text
from experiments.tracks import part, read_track
from facert import Settings, Take
from facert.data.arrays import IntArray, rms
from facert.io.journal import Journal

log = logging.getLogger(__name__)

PROBLEMS = (
    ("rom", "arkit", 40),
    ("rom", "arkit", 10),
    ("utterance_a", "arkit", 10),
    ("utterance_b", "units", 10),
)
COUNTS = (50, 100, 300, 1000, 3000)
TESTED = 400
LEARNERS = {
    "ssgplvm": Settings(method="ssgplvm"),
    "ssgplvm, exact": Settings(method="ssgplvm", likelihood="exact"),
    "auto": Settings(method="auto"),
}
MOST = {"ssgplvm, exact": 300}  # its time grows with the cube
# Unlabelled frames and poses that a track can give with some difference between them.
LONGEST = {"rom": 3000, "utterance_a": 1000, "utterance_b": 1000}
COLOURS = {"ssgplvm": "#0072b2", "ssgplvm, exact": "#d55e00", "auto": "black"}


@dataclass(frozen=True)
class Cell:
    """One training and its test."""

    track: str
    target: str
    labels: int
    draw: int
    learner: str
    unlabelled: int
    rms: float
    seconds: float

    @property
    def task(self) -> Task:
        """What it is the outcome of."""
        problem = self.track, self.target, self.labels
        return problem, self.draw, self.learner, self.unlabelled


def drawn(truth: Take, labels: int, unlabelled: int, seed: int) -> tuple[Take, IntArray]:
    """A take to learn from, and the frames to test on."""
    order = np.random.default_rng(seed).permutation(len(truth))
    test, labelled, rest = np.split(order, [TESTED, TESTED + labels])
    rows = np.sort(np.concatenate([labelled, rest[:unlabelled]]))
    return part(truth, rows, labelled, np.sort(rest[::-1][:unlabelled])), np.sort(test)


Task = tuple[tuple[str, str, int], int, str, int]  # problem, draw, learner, unlabelled


def tasks(repeats: int, most: int) -> list[Task]:
    """All cells, draw by draw, so that a part is a fair picture of the whole."""
    return [
        (problem, draw, name, count)
        for draw, problem, count, name in product(range(repeats), PROBLEMS, COUNTS, LEARNERS)
        if count <= min(MOST.get(name, most), most, LONGEST[problem[0]])
    ]


def evaluated(task: Task) -> Cell:
    """Train and test."""
    (track, target, labels), draw, name, count = task
    truth = read_track(track, target)
    assert truth.params is not None
    take, test = drawn(truth, labels, count, draw)
    began = time.process_time()
    retargeter = facert.train(take, replace(LEARNERS[name], unlabelled=count, seed=draw))
    spent = time.process_time() - began
    predicted = retargeter.retarget(part(truth, test)).params
    assert predicted is not None
    error = rms(predicted - truth.params[test])
    return Cell(track, target, labels, draw, name, count, error, spent)


def measured(waiting: Sequence[Task], jobs: int) -> list[Cell]:
    """The cells of the tasks; those whose method is as it was come from the journal."""
    journal = Journal(KEPT / "unlabelled.jsonl", "unlabelled")
    kept = {}
    for entry in journal.begin():
        cell = Cell(**entry["cell"])
        if entry["code"] == code_of(LEARNERS[cell.learner].method):
            kept[cell.task] = cell
    left = [task for task in waiting if task not in kept]
    with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
        for done, cell in enumerate(pool.map(evaluated, left), start=1):
            journal.add({"cell": asdict(cell), "code": code_of(LEARNERS[cell.learner].method)})
            kept[cell.task] = cell
            log.info("%d of %d: %s", done, len(left), cell)
    return [kept[task] for task in waiting]


def table(cells: Sequence[Cell]) -> str:
    """Mean and standard error of the RMS, mean CPU seconds; learners down, counts across."""
    counts = sorted({cell.unlabelled for cell in cells})
    lines = []
    for name in LEARNERS:
        texts = []
        for count in counts:
            own = [c for c in cells if (c.learner, c.unlabelled) == (name, count)]
            texts.append(_text(own) if own else "-")
        lines.append([name, *texts])
    return markdown(["unlabelled", *map(str, counts)], lines)


def _text(cells: Sequence[Cell]) -> str:
    errors = np.array([cell.rms for cell in cells])
    spread = f" ± {errors.std(ddof=1) / len(errors) ** 0.5:.4f}" if len(errors) > 1 else ""
    seconds = np.mean([cell.seconds for cell in cells])
    return f"{errors.mean():.4f}{spread} ({seconds:.1f} s)"


def panel(axes: Axes, cells: Sequence[Cell], title: str) -> None:
    """RMS against unlabelled data on a logarithmic axis."""
    for name, colour in COLOURS.items():
        counts = sorted({cell.unlabelled for cell in cells if cell.learner == name})
        groups = [[c.rms for c in cells if (c.learner, c.unlabelled) == (name, n)] for n in counts]
        means = [np.mean(group) for group in groups]
        axes.plot(counts, means, "o-", color=colour, label=name, markersize=4)
    axes.set_xscale("log")
    axes.set_xticks(COUNTS, [str(count) for count in COUNTS])
    axes.minorticks_off()
    axes.set_ylim(0.0, 1.08 * axes.dataLim.y1)
    axes.set_title(title, fontsize=9)
    axes.set_xlabel("unlabelled frames and poses", fontsize=9)
    axes.tick_params(labelsize=8)
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(axis="y", color="#e4e4e4", linewidth=0.6)


def report(cells: Sequence[Cell], repeats: int, folder: Path) -> None:
    """Picture, table and every cell."""
    figure = Figure(figsize=(3.1 * len(PROBLEMS), 3.0), dpi=120, layout="constrained")
    parts = [
        "# RMS against unlabelled frames and poses",
        f"Mean of {repeats} draws ± standard error (CPU seconds of a training, one thread); "
        f"{TESTED} test frames.",
    ]
    axes = figure.subplots(1, len(PROBLEMS), squeeze=False)[0]
    for place, (track, target, labels) in zip(axes, PROBLEMS, strict=True):
        own = [c for c in cells if (c.track, c.target, c.labels) == (track, target, labels)]
        title = f"{track}, {target}, {labels} labels"
        panel(place, own, title)
        parts += [f"## {title}", table(own)]
    axes[0].set_ylabel("RMS over controls", fontsize=9)
    axes[0].legend(frameon=False, fontsize=8, loc="lower left")
    save(figure, folder / "unlabelled.png")
    write_csv(folder / "unlabelled.csv", [asdict(cell) for cell in cells])
    write_text(folder / "unlabelled.md", parts)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--repeats", type=int, default=3, help="draws (%(default)s)")
    parser.add_argument("--jobs", type=int, default=2, help="processes (%(default)s)")
    parser.add_argument("--most", type=int, default=COUNTS[-1], help="unlabelled (%(default)s)")
    parser.add_argument("--results", type=Path, default=RESULTS, help="folder (%(default)s)")
    given = parser.parse_args()
    begin_log(log)
    cells = measured(tasks(given.repeats, given.most), given.jobs)
    report(cells, given.repeats, given.results)
    print((given.results / "unlabelled.md").read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()

"""What an evaluation of the shared model's energy costs over the number of frames.

    python -m experiments.bench.sparse [--runs 5] [--train 4000]

One thread, CPU time, medians: the exact likelihood against the bound with 100 inducing latents,
value and gradient of the whole energy with so many unlabelled frames and as many poses on the `rom`
track (the built-in take's where there are no recordings, with frames repeated). Then a training of
the large model from data to model. A picture with logarithmic axes and a table go into
experiments/bench.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from matplotlib.figure import Figure

from experiments.bench.problem import bench_take  # and one thread
from experiments.drawing import save
from experiments.report import markdown, write_text
from experiments.tracks import DATA, read_track
from facert import Settings
from facert.data.arrays import FloatArray
from facert.data.normalisation import Normalisation
from facert.methods.base import Labelled, Unlabelled
from facert.methods.registry import make_method
from facert.models.gplvm.lle import constraint_matrix, view_rows
from facert.models.gplvm.module import GaussianView, SharedGPLVM
from facert.models.gplvm.sparse_view import SparseView, inducing_rows, row_weights
from facert.models.kernels import SquaredExponential

FOLDER = Path(__file__).resolve().parent
COUNTS = (50, 100, 200, 500, 1000, 2000, 4000)
MOST_EXACT = 2000
LABELS, INDUCING, LATENT, FLOORS = 40, 100, 8, (0.01, 0.05)


@dataclass(frozen=True, eq=False)
class Views:
    """Both views of a problem, labelled rows first."""

    X: FloatArray
    Y: FloatArray


def views(alone: int) -> Views:
    """40 labels, and so many frames and poses drawn with repetition where the track is short."""
    if (DATA / "tracks").is_dir():
        take = read_track("rom", "arkit")
        X, Y = take.source.matrix, take.params
    else:
        take = bench_take()[1]
        X, Y = take.source.matrix[take.labels], take.params
        Y = None if Y is None else Y[take.labels]
    assert Y is not None
    X, Y = Normalisation.of(X, "source").apply(X), Normalisation.of(Y, "target").apply(Y)
    order = np.random.default_rng(0).permutation(len(X))
    rest = order[LABELS:]
    frames, poses = np.resize(rest, alone), np.resize(rest[::-1], alone)
    return Views(
        X[np.concatenate([order[:LABELS], frames])], Y[np.concatenate([order[:LABELS], poses])]
    )


def milliseconds(module: SharedGPLVM, runs: int) -> float:
    """Of value and gradient, after one evaluation that warms up."""
    parameters = list(module.parameters())
    spent = []
    for _ in range(runs + 1):
        began = time.process_time()
        torch.autograd.grad(module(), parameters)
        spent.append(1e3 * (time.process_time() - began))
    return float(np.median(spent[1:]))


@dataclass(frozen=True)
class Cost:
    """Milliseconds of an evaluation with so many unlabelled rows a view; None: not tried."""

    count: int
    exact: float | None
    sparse: float


def cost(count: int, runs: int) -> Cost:
    data = views(count)
    M = constraint_matrix(data.X, data.Y, LABELS, 8)
    points = LABELS + 2 * count
    Z = np.random.default_rng(0).normal(size=(points, LATENT))
    given = list(zip((data.X, data.Y), view_rows(LABELS, count, count), FLOORS, strict=True))
    small = [
        SparseView(
            *view,
            SquaredExponential,
            Z[view[1][inducing_rows(len(view[1]), LABELS, INDUCING)]],
            row_weights(len(view[1]), LABELS),
        )
        for view in given
    ]
    sparse = milliseconds(SharedGPLVM(*small, M, Z), runs)
    if count > MOST_EXACT:
        return Cost(count, None, sparse)
    exact = SharedGPLVM(*(GaussianView(*view) for view in given), M, Z)
    return Cost(count, milliseconds(exact, runs), sparse)


def draw_curves(costs: list[Cost]) -> Figure:
    figure = Figure(figsize=(5.0, 3.6), dpi=120, layout="constrained")
    axes = figure.subplots()
    exact = [(c.count, c.exact) for c in costs if c.exact is not None]
    axes.loglog(*zip(*exact, strict=True), "s-", color="#d55e00", label="exact")
    sparse = [(c.count, c.sparse) for c in costs]
    axes.loglog(
        *zip(*sparse, strict=True), "o-", color="#0072b2", label=f"{INDUCING} inducing latents"
    )
    axes.set_xticks(COUNTS, [str(count) for count in COUNTS])
    axes.minorticks_off()
    axes.set_xlabel("unlabelled frames, and as many poses")
    axes.set_ylabel("ms, value and gradient")
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(color="#e4e4e4", linewidth=0.6)
    axes.legend(frameon=False)
    return figure


def training(count: int) -> str:
    """CPU seconds of a whole fit."""
    data = views(count)
    method = make_method(Settings(method="ssgplvm", unlabelled=count, inducing=INDUCING))
    labelled = Labelled(data.X[:LABELS], data.Y[:LABELS])
    began = time.process_time()
    report = method.fit(labelled, Unlabelled(data.X[LABELS:], data.Y[LABELS:]))
    spent = time.process_time() - began
    assert report.result is not None
    return (
        f"Training with {count} unlabelled frames and as many poses: {spent:.1f} s CPU, "
        f"{report.result.iterations} iterations after those of the core."
    )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--runs", type=int, default=5, help="evaluations (%(default)s)")
    parser.add_argument("--train", type=int, default=4000, help="rows a view (%(default)s)")
    given = parser.parse_args()
    costs = [cost(count, given.runs) for count in COUNTS]
    lines = [
        [str(c.count), "-" if c.exact is None else f"{c.exact:.1f}", f"{c.sparse:.1f}"]
        for c in costs
    ]
    parts = [
        "# Cost of an evaluation",
        f"Milliseconds of CPU time, value and gradient, one thread, {LABELS} labels, "
        f"q = {LATENT}, median of {given.runs} (`python -m experiments.bench.sparse`).",
        markdown(["unlabelled, each view", "exact", f"{INDUCING} inducing"], lines),
        training(given.train),
        "![cost](sparse.png)",
    ]
    save(draw_curves(costs), FOLDER / "sparse.png")
    write_text(FOLDER / "sparse.md", parts)
    print((FOLDER / "sparse.md").read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()

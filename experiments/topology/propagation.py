"""Section 4.1 and 4.2, Figures 6 to 8: key frames to performances, by every method.

The key frames lie evenly in each segment of 100. An error is the Frobenius norm of what is wrong,
as in the paper, over that of the true motion about its mean, so that large and small performances
count alike: 1 is a still face.
"""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from experiments.drawing import save
from experiments.report import markdown, write_csv, write_text
from experiments.topology.pairs import KINDS, Pair, make_pairs
from experiments.topology.scores import Scores, draw_curves
from facert.data.arrays import FloatArray
from facert.errors import InputError
from facert.topology.keyed import KeyedPerformance
from facert.topology.propagation import METHODS, propagate

DEFAULT = next(iter(METHODS))
OWN = ("residual", "path", "framework", "literal", "ridge")
KEYS = (2, 4, 6, 8, 10, 12, 15, 20)
USUAL = 10
NOT_DRAWN = 3.0  # times the error of the best baseline


def frame_errors(pair: Pair, keys: int, method: str) -> FloatArray:
    """The error of each frame, (T,); their squares add up to that of the performance."""
    places = np.linspace(0, len(pair.source) - 1, keys).round().astype(int)
    take = KeyedPerformance(pair.source, places, pair.target[places])
    motion = np.linalg.norm(pair.target - pair.target.mean(axis=0))
    wrong = propagate(take, method) - pair.target
    return np.asarray(np.linalg.norm(wrong.reshape(len(wrong), -1), axis=1) / motion)


def measure(
    pairs: list[Pair], keys: int, methods: Iterable[str] = tuple(METHODS)
) -> dict[str, FloatArray]:
    """The errors of each method, (pairs, frames); one that needs more keys is left out."""
    errors = {}
    for method in methods:
        with suppress(InputError):
            errors[method] = np.stack([frame_errors(pair, keys, method) for pair in pairs])
    return errors


def whole(errors: dict[str, FloatArray]) -> Scores:
    """The error of each performance."""
    return Scores(
        {method: np.linalg.norm(one, axis=1) for method, one in errors.items()}, DEFAULT, OWN
    )


def figure_6(scores: dict[int, Scores]) -> Figure:
    """Mean error against the number of key frames."""
    methods = scores[KEYS[-1]].errors
    means = {
        name: np.array([
            one.errors[name].mean() if name in one.errors else np.nan for one in scores.values()
        ])
        for name in methods
    }  # fmt: skip
    figure, axes = _diagram("key frames of 100", "error / motion")
    draw_curves(axes, KEYS, means, tuple(METHODS))
    axes.set_xticks(KEYS)
    axes.set_yscale("log")
    axes.set_ylim(top=1.0)
    return _with_legend(figure)


def figure_7(scores: Scores) -> Figure:
    """The error of every performance, in the order of the default's."""
    order = np.argsort(scores.errors[DEFAULT])
    figure, axes = _diagram("performance", "error / motion")
    curves = {name: errors[order] for name, errors in scores.errors.items() if _drawn(scores, name)}
    draw_curves(axes, range(1, len(order) + 1), curves, tuple(METHODS))
    return _with_legend(figure)


def figure_8(errors: dict[str, FloatArray], scores: Scores) -> Figure:
    """The root mean square error of every frame over the performances."""
    figure, axes = _diagram("frame", "error / motion of a mean frame")
    frames = next(iter(errors.values())).shape[1]
    curves = {
        name: np.sqrt(frames * (one**2).mean(axis=0))
        for name, one in errors.items()
        if _drawn(scores, name)
    }
    draw_curves(axes, range(frames), curves, tuple(METHODS))
    return _with_legend(figure)


def by_kind(scores: Scores, pairs: list[Pair]) -> str:
    """Mean error of each kind of target."""
    rows = []
    for name, errors in scores.errors.items():
        means = [
            errors[[place for place, pair in enumerate(pairs) if pair.kind == kind]].mean()
            for kind in KINDS
        ]
        rows.append((name, *(f"{mean:.3f}" for mean in means)))
    return markdown(("method", *KINDS), rows)


def by_keys(scores: dict[int, Scores]) -> str:
    """Mean error for each number of key frames."""
    rows = []
    for name in METHODS:
        found = [one.errors[name].mean() if name in one.errors else None for one in scores.values()]
        rows.append((name, *("-" if mean is None else f"{mean:.3f}" for mean in found)))
    return markdown(("method", *(f"{keys} keys" for keys in KEYS)), rows)


def run(results: Path) -> None:
    """Write figures, tables and every number."""
    pairs = make_pairs()
    errors = {keys: measure(pairs, keys) for keys in KEYS}
    scores = {keys: whole(one) for keys, one in errors.items()}
    usual = scores[USUAL]
    save(figure_6(scores), results / "figure6.png")
    save(figure_7(usual), results / "figure7.png")
    save(figure_8(errors[USUAL], usual), results / "figure8.png")
    rows = [row for keys, one in scores.items() for row in one.rows(keys=keys)]
    for row in rows:
        row["kind"] = pairs[int(str(row["test"]))].kind
        row |= {name: row.get(name, "") for name in METHODS}
    write_csv(results / "propagation.csv", [_ordered(row) for row in rows])
    parts = [
        "# Key-frame propagation",
        "Made by `python -m experiments.topology propagation`: 50 pairs of performances of 100"
        " frames. The error is relative to the motion.",
        f"## {USUAL} key frames",
        usual.table("error / motion"),
        by_kind(usual, pairs),
        "## More and fewer key frames",
        by_keys(scores),
    ]
    write_text(results / "propagation.md", parts)


def _ordered(row: dict[str, object]) -> dict[str, object]:
    return {name: row[name] for name in ("keys", "kind", "test", *METHODS)}


def _drawn(scores: Scores, name: str) -> bool:
    limit = NOT_DRAWN * scores.errors[scores.best_baseline].mean()
    return bool(scores.errors[name].mean() < limit)


def _diagram(x: str, y: str) -> tuple[Figure, Axes]:
    figure = Figure(figsize=(7, 3.4), dpi=120, layout="constrained")
    axes = figure.subplots()
    axes.set_xlabel(x, fontsize=9)
    axes.set_ylabel(y, fontsize=9)
    return figure, axes


def _with_legend(figure: Figure) -> Figure:
    figure.legend(loc="outside right center", frameon=False, fontsize=9)
    return figure

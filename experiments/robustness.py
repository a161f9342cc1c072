"""Retargeting through noise and missing markers, against filling first and regressing then.

    python -m experiments.robustness [--repeats 2] [--frames 800] [TRACK ...]

A track gets noise and gaps throughout: markers hidden here and there, in bursts, or a region of the
face for a while. From 20 labels and 100 other poses, all its other frames are retargeted: by facert
as it comes (`auto`, cleaning and all), and by Gaussian process regression on frames that were
filled before: by the mean, by iterative PCA (with the best of three ranks in each cell, which
nobody knows beforehand), or by the conditional Gaussian, which takes out noise as well. Errors are
the RMS over controls, and over hidden coordinates in units of the largest standard deviation of
one.

The second part compares online with offline retargeting, and the motion that is left, with the
clean run. Writes `experiments/results/robustness.csv`, `.md` and `.png`.
"""

from __future__ import annotations

import argparse
import logging
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from itertools import product
from multiprocessing import get_context

import numpy as np
from matplotlib.figure import Figure
from threadpoolctl import threadpool_limits

import facert
from experiments import cleaning
from experiments.drawing import save
from experiments.grid import OPTICAL, RESULTS, SPEECH, TARGETS
from experiments.report import markdown, write_csv, write_text
from experiments.tracks import draw, middle, read_track
from facert import Settings, Take
from facert.data.arrays import FloatArray, IntArray, rms
from facert.data.normalisation import Normalisation
from facert.evaluation.figures import COLOURS, INK, MARKERS
from facert.retarget.options import AS_IT_IS, RetargetOptions
from facert.retarget.retargeter import Mode

KINDS, SHARES, NOISES = cleaning.KINDS, (0.1, 0.2, 0.4), (0.0, 0.05, 0.1, 0.2)
PATTERNS = (("none", 0.0), *product(KINDS, SHARES))
LABELS, POSES = 20, 100
FILLS: dict[str, Callable[[cleaning.Problem], FloatArray]] = {
    "mean": cleaning.by_mean,
    "iterative PCA": cleaning.by_iterative_pca,
    "conditional Gaussian": cleaning.by_conditional_gaussian,
}
OURS, NAMES = "facert", ("facert", *FILLS)
PEAKS = {"lids": ("eyeBlink",), "lips": ("mouthClose", "mouthPucker", "mouthPress", "jawOpen")}
PEAK = 0.9
"""A peak is a frame in the top tenth of a control's range, the highest within `NEAR` frames."""
NEAR = 8


@dataclass(frozen=True)
class Cell:
    """One problem of the grid."""

    track: str
    target: str
    kind: str
    share: float
    noise: float
    seed: int
    frames: int

    @property
    def texts(self) -> dict[str, object]:
        """For the table."""
        return {
            "track": self.track,
            "target": self.target,
            "gaps": self.kind,
            "share": self.share,
            "noise": self.noise,
            "seed": self.seed,
        }


@dataclass(frozen=True, eq=False)
class Spoilt:
    """A take with noise and gaps, its truth, and the frames to test on."""

    take: Take
    truth: Take
    test: IntArray
    problem: cleaning.Problem
    units: Normalisation

    def error(self, result: Take) -> float:
        """RMS of the poses over test frames."""
        assert result.params is not None
        assert self.truth.params is not None
        return rms(result.params[self.test] - self.truth.params[self.test])


def spoil(cell: Cell) -> Spoilt:
    """The middle of a track with noise and gaps, and a few of its poses."""
    whole = read_track(cell.track, cell.target)
    rows = middle(len(whole), cell.frames)
    assert whole.params is not None
    source = whole.source.with_matrix(whole.source.matrix[rows])
    truth = replace(whole, time=whole.time[rows], source=source, params=whole.params[rows])
    units = Normalisation.of(source.matrix, cell.track)
    clean = units.apply(source.matrix)
    rng = np.random.default_rng([cell.seed, 7])
    noisy = clean + cell.noise * rng.standard_normal(clean.shape)
    if cell.share:
        places = np.nanmedian(source.values, axis=0)
        hidden = cleaning.gaps(cell.kind, cell.share, places, len(clean), cell.seed)
        noisy[np.repeat(hidden, 3, axis=1)] = np.nan
    take, test = draw(truth, LABELS, POSES, cell.seed)
    problem = cleaning.Problem(cell.track, cell.kind, cell.share, cell.noise, clean, noisy)
    return Spoilt(
        replace(take, source=source.with_matrix(units.undo(noisy))), truth, test, problem, units
    )


def measure(cell: Cell) -> dict[str, object]:
    """A line of the table."""
    logging.disable(logging.WARNING)
    with threadpool_limits(1):
        spoilt = spoil(cell)
        record = cell.texts
        result = facert.train(spoilt.take, Settings(seed=cell.seed)).retarget(spoilt.take)
        record[OURS] = spoilt.error(result)
        record[f"{OURS}, hidden"] = _hidden(spoilt, spoilt.units.apply(result.source.matrix))
        for name, fill in FILLS.items():
            filled = fill(spoilt.problem)
            source = spoilt.take.source.with_matrix(spoilt.units.undo(filled))
            take = replace(spoilt.take, source=source)
            settings = Settings(method="gpr", seed=cell.seed, detect=False, smooth=False)
            found = facert.train(take, settings).retarget(take, options=AS_IT_IS)
            record[name] = spoilt.error(found)
            record[f"{name}, hidden"] = _hidden(spoilt, filled)
    return record


def _hidden(spoilt: Spoilt, frames: FloatArray) -> float:
    hidden = spoilt.problem.hidden
    return rms((frames - spoilt.problem.truth)[hidden]) if hidden.any() else float("nan")


def motion(cell: Cell) -> dict[str, object]:
    """Online against offline: error, jitter, and the height of peaks.

    The clean run, to which peaks are compared, is that of the same model on markers without noise;
    what learning from noise costs is measured apart, by a model that never met any.
    """
    logging.disable(logging.WARNING)
    with threadpool_limits(1):
        spoilt, clean = spoil(cell), spoil(replace(cell, noise=0.0))
        retargeter = facert.train(spoilt.take, Settings(seed=cell.seed))
        reference = retargeter.retarget(clean.take)
        record = cell.texts
        learned_clean = facert.train(clean.take, Settings(seed=cell.seed)).retarget(clean.take)
        record["learned clean RMS"] = clean.error(learned_clean)
        for part, height in _heights(reference, learned_clean).items():
            record[f"learned clean {part}"] = height
        ways: dict[str, tuple[Mode, RetargetOptions | None]] = {
            "offline": ("offline", None),
            "online": ("online", None),
            "frame by frame": ("offline", RetargetOptions(smooth=False)),
        }
        for name, (mode, options) in ways.items():
            result = retargeter.retarget(spoilt.take, mode, options)
            assert result.params is not None
            record[f"{name} RMS"] = spoilt.error(result)
            record[f"{name} jitter"] = float(np.abs(np.diff(result.params, 2, axis=0)).mean())
            for part, height in _heights(reference, result).items():
                record[f"{name} {part}"] = height
    return record


def _heights(reference: Take, result: Take) -> dict[str, float]:
    """The height of all of a part's peaks, relative to the clean run's at the same frames."""
    assert reference.params is not None
    assert result.params is not None
    assert result.controls is not None
    heights = {}
    for part, stems in PEAKS.items():
        high = clean = 0.0
        for column, name in enumerate(result.controls.names):
            if name.startswith(stems):
                curve = reference.params[:, column]
                at = _peaks(curve)
                high += float((result.params[at, column] - curve.min()).sum())
                clean += float((curve[at] - curve.min()).sum())
        heights[part] = high / clean if clean else float("nan")
    return heights


def _peaks(curve: FloatArray) -> IntArray:
    """Frames in the top tenth of a curve's range that are the highest around."""
    if np.ptp(curve) < 0.05:
        return np.zeros(0, dtype=np.int64)
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(curve, NEAR, "edge"), 2 * NEAR + 1)
    high = curve > curve.min() + PEAK * np.ptp(curve)
    return np.flatnonzero(high & (curve == windows.max(axis=1)))


def cells(tracks: Sequence[str], repeats: int, frames: int) -> Iterator[Cell]:
    """The whole grid."""
    for seed, track in product(range(repeats), tracks):
        for target, (kind, share), noise in product(TARGETS[track], PATTERNS, NOISES):
            yield Cell(track, target, kind, share, noise, seed, frames)


def table(records: list[dict[str, object]], suffix: str) -> str:
    """Means over problems and seeds; the difference to the best other, and its standard error."""
    rows = []
    for (kind, share), noise in product(PATTERNS, NOISES):
        values = _values(records, kind, share, noise, suffix)
        if np.isnan(values).all():
            continue
        means, _, gap, error = _comparison(values)
        shown = [f"{mean:.4f}" for mean in means]
        verdict = "" if gap <= error else "behind"
        rows.append(
            [kind, f"{share:.0%}", f"{noise:g}", *shown, f"{gap:+.4f} ± {error:.4f}", verdict]
        )
    header = ["gaps", "hidden", "noise", *NAMES, "facert - best other", ""]
    return markdown(header, rows, texts=1)


def _values(
    records: list[dict[str, object]], kind: str, share: float, noise: float, suffix: str
) -> FloatArray:
    """Errors of one pattern, (problems and seeds, methods)."""
    own = [r for r in records if (r["gaps"], r["share"], r["noise"]) == (kind, share, noise)]
    return np.array([[float(str(r[name + suffix])) for name in NAMES] for r in own])


def _comparison(values: FloatArray) -> tuple[FloatArray, int, float, float]:
    """Means, the best other, and the paired difference to it with its standard error."""
    means = values.mean(axis=0)
    best = 1 + int(means[1:].argmin())
    paired = values[:, 0] - values[:, best]
    return means, best, float(paired.mean()), float(paired.std(ddof=1) / np.sqrt(len(paired)))


def verdict(records: list[dict[str, object]], suffix: str) -> str:
    """In how many cells facert is at least as good as the best other, and its mean ratio."""
    ratios, good = [], 0
    for (kind, share), noise in product(PATTERNS, NOISES):
        values = _values(records, kind, share, noise, suffix)
        if np.isnan(values).all():
            continue
        means, best, gap, error = _comparison(values)
        ratios.append(means[0] / means[best])
        good += gap <= error
    return (
        f"At least as good as the best other, within a standard error, in {good} of {len(ratios)} "
        f"cells; mean RMS relative to the best other of each cell {np.mean(ratios):.2f}, "
        f"{max(ratios):.2f} at worst."
    )


def motion_table(records: list[dict[str, object]]) -> str:
    """Means over the problems."""
    rows = []
    for name in ("offline", "online", "frame by frame", "learned clean"):
        keys = [f"{name} {what}" for what in ("RMS", "jitter", *PEAKS)]
        means = [_mean([float(str(r[key])) for r in records if key in r]) for key in keys]
        rows.append(
            [name, *(f"{mean:.4f}" for mean in means[:2]), *(f"{m:.3f}" for m in means[2:])]
        )
    return markdown(["", "RMS", "jitter", *(f"peaks of {part}" for part in PEAKS)], rows)


def _mean(values: list[float]) -> float:
    """Of those that are numbers."""
    known = [value for value in values if not np.isnan(value)]
    return float(np.mean(known)) if known else float("nan")


def figure(records: list[dict[str, object]]) -> Figure:
    """RMS against the share of hidden markers: a row a kind of gap, a column a noise."""
    made = Figure(figsize=(3.0 * len(NOISES), 2.3 * len(KINDS)), dpi=110, layout="constrained")
    grid = made.subplots(len(KINDS), len(NOISES), squeeze=False, sharex=True, sharey="col")
    for (row, kind), (column, noise) in product(enumerate(KINDS), enumerate(NOISES)):
        axes, shares = grid[row, column], (0.0, *SHARES)
        curves = np.array(
            [
                _values(records, kind if share else "none", share, noise, "").mean(axis=0)
                for share in shares
            ]
        )
        for index, name in enumerate(NAMES):
            style = {"color": COLOURS[index], "marker": MARKERS[index], "label": name}
            axes.plot(100 * np.array(shares), curves[:, index], markersize=4, **style)
        axes.set_title(f"{kind}, noise {noise:g}", color=INK, fontsize=9)
        axes.tick_params(labelsize=8)
    for axes in grid[-1]:
        axes.set_xlabel("hidden markers, %", color=INK, fontsize=9)
    for axes in grid[:, 0]:
        axes.set_ylabel("RMS over controls", color=INK, fontsize=9)
    grid[0, 0].legend(fontsize=7, frameon=False)
    return made


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("tracks", nargs="*", default=[*SPEECH, *OPTICAL])
    parser.add_argument("--repeats", type=int, default=2)
    parser.add_argument("--frames", type=int, default=800)
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    grid = list(cells(options.tracks, options.repeats, options.frames))
    moving = [
        cell for cell in grid if (cell.kind, cell.noise, cell.target) == ("none", 0.1, "arkit")
    ]
    with ProcessPoolExecutor(options.jobs, mp_context=get_context("spawn")) as pool:
        motions = list(pool.map(motion, moving))
        records = []
        for record in pool.map(measure, grid):
            records.append(record)
            if len(records) % 20 == 0:
                print(f"{len(records)} of {len(grid)}", flush=True)
    parts = [
        "# Robustness",
        f"{', '.join(options.tracks)}, all targets; the middle {options.frames} frames; {LABELS} "
        f"labels, {POSES} other poses; {options.repeats} draws. "
        "`python -m experiments.robustness` describes what is compared.",
        "## Poses",
        table(records, ""),
        verdict(records, ""),
        "![RMS against hidden markers](robustness.png)",
        "## Hidden markers",
        table(records, ", hidden"),
        verdict(records, ", hidden"),
        "## Offline and online",
        "Noise 0.1, nothing hidden, `arkit`. Jitter is the mean absolute second difference; peaks "
        "are relative to those of the same model on markers without noise. The last line is a "
        "model that never met any noise.",
        motion_table(motions) if motions else "",
    ]
    write_text(RESULTS / "robustness.md", parts)
    write_csv(RESULTS / "robustness.csv", records)
    save(figure(records), RESULTS / "robustness.png")
    print("\n".join(parts[2:]))


if __name__ == "__main__":
    main()

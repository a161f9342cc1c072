"""Gaps and noise: what cleaning gives back, against the simple ways to fill and to smooth.

    python -m experiments.cleaning [--frames 1000] [TRACK ...]

Markers of every track are hidden, one here and there, in bursts of a marker, or a whole region of
the face for a while; noise is added to the others. Errors are RMS over the hidden and over the
other coordinates, in units of the largest standard deviation of a coordinate. Iterative PCA has
the best of three ranks in each cell, which nobody knows beforehand. The conditional Gaussian takes
frames one by one: fills by the conditional mean, and denoises by Wiener's filter with the noise
that facert estimates.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np
from threadpoolctl import threadpool_limits

from experiments.grid import OPTICAL, RESULTS, SPEECH, TARGETS
from experiments.report import markdown, write_csv, write_text
from experiments.tracks import middle, read_track
from facert.data.arrays import BoolArray, FloatArray, rms
from facert.data.normalisation import Normalisation
from facert.models.gaussian import Gaussian
from facert.preprocess.motion.estimate import estimate
from facert.preprocess.motion.series import capture_noise, interpolated

KINDS, SHARES, NOISES = ("scattered", "bursts", "region"), (0.1, 0.2, 0.4), (0.0, 0.05, 0.1)
BURST, PERIOD = (5, 60), (20, 90)  # frames
REGION = 0.2  # of all markers
RANKS, STEPS = (8, 16, 32), 50


@dataclass(frozen=True)
class Problem:
    """A track with gaps and noise, in normalised units."""

    track: str
    kind: str
    share: float
    noise: float
    truth: FloatArray
    given: FloatArray

    @property
    def hidden(self) -> BoolArray:
        """What the methods have to fill, (T, d)."""
        return np.isnan(self.given)

    @property
    def clock(self) -> FloatArray:
        """Time in frames, (T,)."""
        return np.arange(len(self.given), dtype=np.float64)


def gaps(kind: str, share: float, places: FloatArray, frames: int, seed: int) -> BoolArray:
    """What is hidden, (T, M), for markers at places (M, 3)."""
    rng = np.random.default_rng(seed)
    count = len(places)
    if kind == "scattered":
        return rng.random((frames, count)) < share
    hidden = np.zeros((frames, count), dtype=np.bool_)
    while hidden.mean() < share:
        marker, start = rng.integers(count), rng.integers(frames)
        if kind == "bursts":
            hidden[start : start + rng.integers(*BURST), marker] = True
            continue
        distance = np.linalg.norm(places - places[marker], axis=1)
        near = np.argsort(distance)[: max(3, round(REGION * count))]
        hidden[start : start + rng.integers(*PERIOD), near] = True
    return hidden


def problems(track: str, frames: int) -> Iterator[Problem]:
    """Every kind of gap, share and noise on the middle of a track."""
    markers = read_track(track, TARGETS[track][0]).source.values
    markers = markers[middle(len(markers), frames)]
    X = markers.reshape(len(markers), -1)
    truth = Normalisation.of(X, track).apply(X)
    places = np.median(markers, axis=0)
    for seed, (kind, share, noise) in enumerate(product(KINDS, SHARES, NOISES)):
        hidden = np.repeat(gaps(kind, share, places, len(X), seed), 3, axis=1)
        noisy = truth + noise * np.random.default_rng(seed).normal(size=truth.shape)
        given = np.where(hidden, np.nan, noisy)
        yield Problem(track, kind, share, noise, truth, given)


def by_mean(problem: Problem) -> FloatArray:
    """Hidden coordinates at their means."""
    X = problem.given
    return np.where(problem.hidden, np.nanmean(X, axis=0), X)


def by_line(problem: Problem) -> FloatArray:
    """Hidden coordinates on a line in time between those that are seen."""
    return interpolated(problem.given, problem.clock)


def by_iterative_pca(problem: Problem) -> FloatArray:
    """The best rank's reconstruction, by the error over hidden and other coordinates."""
    found = [_reconstruction(problem, rank) for rank in RANKS]
    return min(found, key=lambda X: sum(errors(problem, X)))


def _reconstruction(problem: Problem, rank: int) -> FloatArray:
    X = by_mean(problem)
    for _ in range(STEPS):
        mean = X.mean(axis=0)
        _, axes = np.linalg.eigh((X - mean).T @ (X - mean))
        kept = axes[:, -rank:]
        low = mean + (X - mean) @ kept @ kept.T
        X = np.where(problem.hidden, low, problem.given)
    return low if problem.noise else X


def by_conditional_gaussian(problem: Problem) -> FloatArray:
    """Hidden coordinates at their conditional means, the others through Wiener's filter."""
    gaussian = Gaussian.of(problem.given)
    X = gaussian.fill(problem.given)
    noise = capture_noise(problem.given) ** 2
    denoised = X - noise * (X - gaussian.mean) @ gaussian.precision
    return np.where(problem.hidden, X, denoised)


METHODS: dict[str, Callable[[Problem], FloatArray]] = {
    "mean": by_mean,
    "line in time": by_line,
    "iterative PCA": by_iterative_pca,
    "conditional Gaussian": by_conditional_gaussian,
}


def errors(problem: Problem, X: FloatArray) -> tuple[float, float]:
    """RMS over hidden and over other coordinates."""
    off = X - problem.truth
    return rms(off[problem.hidden]), rms(off[~problem.hidden])


def measure(problem: Problem) -> dict[str, object]:
    """A line of the table."""
    record: dict[str, object] = {
        "track": problem.track,
        "gaps": problem.kind,
        "share": problem.share,
        "noise": problem.noise,
    }
    for name, method in METHODS.items():
        record[f"{name}, hidden"], record[f"{name}, seen"] = errors(problem, method(problem))
    found = estimate(problem.given, problem.clock)
    record["facert, hidden"], record["facert, seen"] = errors(problem, found.frames)
    record["sigma"] = found.sigma
    inside = np.abs(found.frames - problem.truth) < 2.0 * found.std
    record["within 2 std, hidden"] = float(inside[problem.hidden].mean())
    record["within 2 std, seen"] = float(inside[~problem.hidden].mean())
    return record


def table(records: list[dict[str, object]], where: str) -> str:
    """Mean over tracks and shares of each method's error, by gaps and noise."""
    rows = []
    for kind, noise in product(KINDS, NOISES):
        cell = [r for r in records if r["gaps"] == kind and r["noise"] == noise]
        names = (*METHODS, "facert")
        means = [np.mean([float(str(r[f"{name}, {where}"])) for r in cell]) for name in names]
        rows.append([kind, f"{noise:g}", *(f"{mean:.4f}" for mean in means)])
    return markdown(["gaps", "noise", *METHODS, "facert"], rows, texts=2)


def verdict(records: list[dict[str, object]], where: str) -> str:
    """In how many cells facert is ahead of every other, and by how much on average."""
    ratios = []
    for record in records:
        best = min(float(str(record[f"{name}, {where}"])) for name in METHODS)
        ratios.append(float(str(record[f"facert, {where}"])) / best if best else np.nan)
    ratio = np.array(ratios)[np.isfinite(ratios)]
    worst = records[int(np.nanargmax(ratios))]
    cell = ", ".join(str(worst[key]) for key in ("track", "gaps", "share", "noise"))
    return (
        f"Ahead of the best of the others in {np.count_nonzero(ratio < 1.0)} of {len(ratio)} "
        f"cells; its RMS over theirs: {np.exp(np.log(ratio).mean()):.2f} (geometric mean), "
        f"{ratio.max():.2f} at worst ({cell})."
    )


def noise_table(records: list[dict[str, object]]) -> str:
    """The noise that was estimated, and how often the truth lies within two deviations."""
    rows = []
    for noise in NOISES:
        cell = [r for r in records if r["noise"] == noise]
        columns = ("sigma", "within 2 std, hidden", "within 2 std, seen")
        values = np.array([[float(str(r[c])) for c in columns] for r in cell])
        sigma = f"{values[:, 0].min():.4f} to {values[:, 0].max():.4f}"
        rows.append([f"{noise:g}", sigma, *(f"{v:.2f}" for v in values[:, 1:].mean(axis=0))])
    return markdown(["noise", "estimated", "within 2 std, hidden", "seen"], rows)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("tracks", nargs="*", default=[*SPEECH, *OPTICAL])
    parser.add_argument("--frames", type=int, default=1000)
    options = parser.parse_args()
    records = []
    with threadpool_limits(1):
        for track in options.tracks:
            for problem in problems(track, options.frames):
                records.append(measure(problem))
                print({key: _short(value) for key, value in records[-1].items()}, flush=True)
    seen = [record for record in records if record["noise"]]
    parts = [
        "# Cleaning",
        f"{', '.join(options.tracks)}; the middle {options.frames} frames; {SHARES} hidden; RMS in "
        "units of the largest standard deviation of a coordinate, mean over tracks and shares. "
        "Iterative PCA has the best rank of each cell.",
        "## Hidden markers",
        table(records, "hidden"),
        verdict(records, "hidden"),
        "## Markers that were seen, with noise",
        table(records, "seen"),
        verdict(seen, "seen"),
        "## Noise and uncertainty",
        noise_table(records),
    ]
    write_text(RESULTS / "cleaning.md", parts)
    write_csv(RESULTS / "cleaning.csv", records)
    print("\n".join(parts[2:]))


def _short(value: object) -> object:
    return round(value, 4) if isinstance(value, float) else value


if __name__ == "__main__":
    main()

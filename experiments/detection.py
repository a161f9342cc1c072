"""Bad values: how many are found, and how many good ones are suspected.

    python -m experiments.detection [--quick] [TAKE ...]

Faults of every kind are planted in the real tracks, and in the two optical takes with head motion:
spikes of 0.1 to 3 of the largest standard deviation of a coordinate, held values over 2 to 30
frames, exchanges of a marker with one of its four nearest for 1 to 100 frames, and strays of 5 to
40 cm over 10 to 180 frames: one to three markers at once, sudden or ramped, fixed in space or along
with the face. A held value is counted only where it is off by more than 5 % of that deviation, and
a stray where it is off by more than 2 cm: less does little harm, whether it is found or not. In the
recordings of weights, these are absurd numbers for 1 and 10 frames, and all weights alike for 1 and
30. `--quick` takes the first 600 frames of two of them, and writes no results.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from threadpoolctl import threadpool_limits

import facert
from experiments.grid import OPTICAL, RESULTS, SPEECH, TARGETS
from experiments.report import markdown, write_csv, write_text
from experiments.tracks import DATA, read_track
from facert import Source
from facert.data.arrays import BoolArray, FloatArray
from facert.preprocess.faults import find_faults

RAW = ("cheeks", "eyebrows")
RECORDED = ("rom.csv", "utterance_a.csv", "utterance_b.csv")
SPIKES, HELD, SWAPPED = (0.1, 0.2, 0.5, 1.0, 3.0), (2, 3, 5, 10, 30), (1, 2, 5, 20, 100)
SHARE, RUNS, EXCHANGES = 0.005, 40, 10
HARMLESS = 0.05
STRAYED, STRAYS = tuple(product((5, 10, 20, 40), (10, 60, 180))), 8
VISIBLE = 2.0  # cm
ABSURD = tuple(product((-50.0, 9999.0, 1e9), (1, 10)))
BLANK = tuple(product((0.0, -1.0), (1, 30)))
NOISES = (0.0, 0.05, 0.1)
QUICK, QUICK_TAKES = 600, ("cheeks", "rom.csv")  # frames


@dataclass(frozen=True)
class Planted:
    """A take with faults of one kind and size."""

    kind: str
    size: str
    values: FloatArray
    bad: BoolArray
    good: BoolArray


def deviation(markers: FloatArray) -> float:
    """The largest standard deviation of a coordinate."""
    return float(markers.std(axis=0).max())


def spiked(markers: FloatArray, size: float, rng: np.random.Generator) -> Planted:
    """Spikes of a size in all directions."""
    hit = rng.random(markers.shape[:2]) < SHARE
    way = rng.normal(size=markers.shape)
    way *= size * deviation(markers) / np.linalg.norm(way, axis=2, keepdims=True)
    return Planted("spiked", f"{size:g}", markers + hit[:, :, None] * way, hit, ~hit)


def held(markers: FloatArray, frames: int, rng: np.random.Generator) -> Planted:
    """Markers held where they were for so many frames."""
    result = markers.copy()
    for _ in range(RUNS):
        start, marker = rng.integers(1, len(markers) - frames - 1), rng.integers(markers.shape[1])
        result[start : start + frames, marker] = result[start - 1, marker]
    off = np.linalg.norm(result - markers, axis=2)
    return Planted("frozen", f"{frames}", result, off > HARMLESS * deviation(markers), off == 0.0)


def exchanged(markers: FloatArray, frames: int, rng: np.random.Generator) -> Planted:
    """Markers exchanged with a near one for so many frames."""
    result, bad = markers.copy(), np.zeros(markers.shape[:2], dtype=np.bool_)
    for _ in range(EXCHANGES):
        start, one = rng.integers(1, len(markers) - frames - 1), rng.integers(markers.shape[1])
        distance = np.linalg.norm(markers[start] - markers[start, one], axis=1)
        pair = [one, np.argsort(distance)[rng.integers(1, 5)]]
        if not bad[start - 1 : start + frames + 1, pair].any():
            result[start : start + frames, pair] = result[start : start + frames, pair[::-1]]
            bad[start : start + frames, pair] = True
    return Planted("swapped", f"{frames}", result, bad, ~bad)


def strayed(markers: FloatArray, size: tuple[int, int], rng: np.random.Generator) -> Planted:
    """One to three markers so many centimetres off for so many frames."""
    distance, frames = size
    result = markers.copy()
    for number in range(STRAYS):
        start = rng.integers(1, len(markers) - frames - 1)
        there = slice(start, start + frames)
        chosen = rng.permutation(markers.shape[1])[: 1 + number % 3]
        way = rng.normal(size=(len(chosen), 3))
        way *= distance / np.linalg.norm(way, axis=1, keepdims=True)
        ramp = np.minimum(1.0, np.arange(1, frames + 1) / (frames / 3.0))
        share = ramp if number % 4 >= 2 else np.ones(frames)
        place = markers[there, chosen] if number % 2 else markers[start, chosen][None]
        result[there, chosen] = place + share[:, None, None] * way
    off = np.linalg.norm(result - markers, axis=2)
    return Planted("strayed", f"{distance} cm, {frames}", result, off > VISIBLE, off == 0.0)


def absurd(weights: FloatArray, size: tuple[float, int], rng: np.random.Generator) -> Planted:
    """A number in the place of one weight for so many frames."""
    value, frames = size
    result, bad = weights.copy(), np.zeros(weights.shape, dtype=np.bool_)
    for _ in range(STRAYS):
        start, one = rng.integers(1, len(weights) - frames - 1), rng.integers(weights.shape[1])
        bad[start : start + frames, one] = True
    result[bad] = value
    return Planted("absurd", f"{value:g}, {frames}", result, bad, ~bad)


def blank(weights: FloatArray, size: tuple[float, int], rng: np.random.Generator) -> Planted:
    """The same number for all weights for so many frames."""
    value, frames = size
    result, bad = weights.copy(), np.zeros(weights.shape, dtype=np.bool_)
    for _ in range(STRAYS):
        start = rng.integers(1, len(weights) - frames - 1)
        bad[start : start + frames] = True
    result[bad] = value
    return Planted("blank", f"{value:g}, {frames}", result, bad, ~bad)


def planted(values: FloatArray, seed: int = 0) -> Iterator[Planted]:
    """Every kind and size of fault that markers (T, M, 3), or weights (T, D), have, and none."""
    rng = np.random.default_rng(seed)
    whole = np.ones(values.shape[:2], dtype=np.bool_)
    yield Planted("none", "-", values, ~whole, whole)
    of_markers: dict[Callable[..., Planted], tuple[object, ...]] = {
        spiked: SPIKES,
        held: HELD,
        exchanged: SWAPPED,
        strayed: STRAYED,
    }
    of_weights: dict[Callable[..., Planted], tuple[object, ...]] = {absurd: ABSURD, blank: BLANK}
    for plant, sizes in (of_markers if values.ndim == 3 else of_weights).items():
        for size in sizes:
            yield plant(values, size, rng)


def takes(names: Sequence[str]) -> Iterator[tuple[str, FloatArray]]:
    """Takes by their names, with their markers or weights."""
    for name in names:
        if name in RAW:
            take = facert.read_take(DATA / "markers" / f"{name}.npz")
        elif name.endswith(".csv"):
            take = facert.read_take(DATA / "recordings" / name)
        else:
            take = read_track(name, TARGETS[name][0])
        yield name, take.source.values


def measure(name: str, values: FloatArray, noise: float) -> Iterator[dict[str, object]]:
    """A line of the table for every fault."""
    noisy = np.random.default_rng(1).normal(size=values.shape) * noise * deviation(values)
    for case in planted(values + noisy):
        found = find_faults(Source(case.values, [f"{i}" for i in range(values.shape[1])])).any
        yield {
            "take": name,
            "noise": noise,
            "kind": case.kind if values.ndim == 3 or case.bad.any() else "none, weights",
            "size": case.size,
            "planted": int(case.bad.sum()),
            "found": float(found[case.bad].mean()) if case.bad.any() else float("nan"),
            "false alarms": float(found[case.good].mean()),
        }


def table(records: list[dict[str, object]]) -> str:
    """Least and mean share found, and most false alarms, over the takes."""
    rows = []
    keys = dict.fromkeys((r["kind"], r["size"], r["noise"]) for r in records)
    for kind, size, noise in keys:
        cell = [r for r in records if (r["kind"], r["size"], r["noise"]) == (kind, size, noise)]
        found = np.array([r["found"] for r in cell], dtype=np.float64)
        false = np.array([r["false alarms"] for r in cell], dtype=np.float64)
        shares = ["", ""] if np.isnan(found).all() else [f"{np.nanmean(found):.2f}", ""]
        if shares[0]:
            shares[1] = f"{np.nanmin(found):.2f}"
        rows.append([str(kind), str(size), f"{noise}", *shares, f"{100 * false.max():.3f} %"])
    header = ["kind", "size", "noise", "found, mean", "least", "false alarms at most"]
    return markdown(header, rows)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("takes", nargs="*", default=[])
    parser.add_argument("--quick", action="store_true")
    options = parser.parse_args()
    whole = (*SPEECH, *OPTICAL, *RAW, *RECORDED)
    names = options.takes or (QUICK_TAKES if options.quick else whole)
    records: list[dict[str, object]] = []
    with threadpool_limits(1):
        for name, values in takes(names):
            for noise in NOISES if values.ndim == 3 else NOISES[:1]:
                records += measure(name, values[: QUICK if options.quick else None], noise)
    parts = [
        "# Bad values",
        f"{', '.join(names)}. Sizes: spikes in the largest standard deviation of a "
        "coordinate; held and exchanged markers in frames; strays in cm and frames; absurd "
        "weights, and all weights alike, by their value and frames; noise in the same deviation.",
        table(records),
    ]
    if not options.quick:
        write_text(RESULTS / "detection.md", parts)
        write_csv(RESULTS / "detection.csv", records)
    print(parts[-1])


if __name__ == "__main__":
    main()

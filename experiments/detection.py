"""Bad markers: how many are found, and how many good ones are suspected.

    python -m experiments.detection [TAKE ...]

Faults of every kind are planted in the real tracks, and in the two optical takes with head motion:
spikes of 0.1 to 3 of the largest standard deviation of a coordinate, held values over 2 to 30
frames, and exchanges of a marker with one of its four nearest for 1 to 100 frames. A held value is
counted only where it is off by more than 5 % of that deviation: less, it does no harm, whether it
is found or not.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from dataclasses import dataclass

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
SPIKES, HELD, SWAPPED = (0.1, 0.2, 0.5, 1.0, 3.0), (2, 3, 5, 10, 30), (1, 2, 5, 20, 100)
SHARE, RUNS, EXCHANGES = 0.005, 40, 10
HARMLESS = 0.05
NOISES = (0.0, 0.05)


@dataclass(frozen=True)
class Planted:
    """A take with faults of one kind and size."""

    kind: str
    size: str
    markers: FloatArray
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


def planted(markers: FloatArray, seed: int = 0) -> Iterator[Planted]:
    """Every kind and size of fault, and none."""
    rng = np.random.default_rng(seed)
    whole = np.ones(markers.shape[:2], dtype=np.bool_)
    yield Planted("none", "-", markers, ~whole, whole)
    plans: tuple[tuple[Callable[..., Planted], tuple[float, ...]], ...] = (
        (spiked, SPIKES),
        (held, HELD),
        (exchanged, SWAPPED),
    )
    for plant, sizes in plans:
        for size in sizes:
            yield plant(markers, size, rng)


def takes(names: list[str]) -> Iterator[tuple[str, FloatArray]]:
    """Takes by their names, with their markers."""
    for name in names:
        if name in RAW:
            take = facert.read_take(DATA / "markers" / f"{name}.npz")
        else:
            take = read_track(name, TARGETS[name][0])
        yield name, take.source.values


def measure(name: str, markers: FloatArray, noise: float) -> Iterator[dict[str, object]]:
    """A line of the table for every fault."""
    noisy = np.random.default_rng(1).normal(size=markers.shape) * noise * deviation(markers)
    for case in planted(markers + noisy):
        found = find_faults(Source(case.markers, [f"{i}" for i in range(markers.shape[1])])).any
        yield {
            "take": name,
            "noise": noise,
            "kind": case.kind,
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
    parser.add_argument("takes", nargs="*", default=[*SPEECH, *OPTICAL, *RAW])
    options = parser.parse_args()
    records: list[dict[str, object]] = []
    with threadpool_limits(1):
        for name, markers in takes(options.takes):
            for noise in NOISES:
                records += measure(name, markers, noise)
    parts = [
        "# Bad markers",
        f"{', '.join(options.takes)}. Sizes: spikes in the largest standard deviation of a "
        "coordinate, the others in frames; noise in the same deviation.",
        table(records),
    ]
    write_text(RESULTS / "detection.md", parts)
    write_csv(RESULTS / "detection.csv", records)
    print(parts[-1])


if __name__ == "__main__":
    main()

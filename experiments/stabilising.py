"""Head motion: how much of it is left, and what that costs in retargeting.

    python -m experiments.stabilising [--method ssgpr] [--labels 20] [--repeats 5]

The raw optical takes hold their actor's head motion. They are stabilised on the forehead and the
bridge of the nose, and on automatically found markers, and compared with the tracks that were made
from them. Then a method learns from some posed frames of each and retargets the others. The
simulated tracks get a head motion that is known; with these the truth is exact.
"""

from __future__ import annotations

import argparse
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation
from threadpoolctl import threadpool_limits

import facert
from experiments.grid import RESULTS
from experiments.report import markdown, write_csv, write_text
from experiments.tracks import DATA, draw, read_track
from facert import Settings, Source, Take
from facert.data.arrays import FloatArray, rms
from facert.mesh.rigid import RigidMotion, align
from facert.preprocess.head_motion import stabilise

CHOSEN = ("ForeHead_M", "ForeHead_L", "ForeHead_R", "NoseTop")
OPTICAL = {"optical_cheeks": "cheeks", "optical_eyebrows": "eyebrows"}
SIMULATED = ("rom", "utterance_a", "utterance_b")
DEGREES, SHIFT = 8.0, 3.0  # root mean square of the simulated head motion; cm
WAVES = 3


def head_motion(time: FloatArray, seed: int) -> RigidMotion:
    """Smooth turns and shifts, a few waves of 0.05 to 0.5 Hz for each of the six ways to move."""
    rng = np.random.default_rng(seed)
    rate, phase = rng.uniform(0.05, 0.5, (WAVES, 6)), rng.uniform(0.0, 2 * np.pi, (WAVES, 6))
    wave = np.sin(2 * np.pi * time[:, None, None] * rate + phase) / rate
    way = (wave * rng.normal(size=(WAVES, 6))).sum(axis=1)
    way /= np.sqrt((way**2).mean(axis=0))
    turn = Rotation.from_rotvec(np.radians(DEGREES) / np.sqrt(3) * way[:, :3])
    return RigidMotion(turn.as_matrix(), SHIFT / np.sqrt(3) * way[:, 3:])


def with_markers(take: Take, markers: FloatArray) -> Take:
    """The take with its markers elsewhere."""
    return replace(take, source=Source(markers, take.source.names))


def distance(found: FloatArray, truth: FloatArray) -> float:
    """RMS of a marker's distance, both takes brought together by one rigid motion."""
    one = align(truth.reshape(-1, 3), found.reshape(1, -1, 3), np.ones((1, truth.size // 3)))
    return rms(one.undo(found.reshape(1, -1, 3)).reshape(truth.shape) - truth) * np.sqrt(3)


def retargeting_error(take: Take, truth: Take, options: argparse.Namespace) -> float:
    """RMS over the frames without a label, mean over draws."""
    assert truth.params is not None
    errors = []
    for seed in range(options.repeats):
        drawn, test = draw(truth, options.labels, 100, seed)
        learning = replace(drawn, source=take.source)
        settings = Settings(method=options.method, seed=seed)
        result = facert.train(learning, settings).retarget(take)
        assert result.params is not None
        errors.append(rms((result.params - truth.params)[test]))
    return float(np.mean(errors))


def variants(name: str) -> tuple[Take, dict[str, Take]]:
    """A track, and what becomes of its recording with head motion."""
    if name in OPTICAL:
        truth = read_track(name, "solved")
        raw = facert.read_take(DATA / "markers" / f"{OPTICAL[name]}.npz")
        stabilised = {"chosen": stabilise(raw, CHOSEN).take}
    else:
        truth = read_track(name, "arkit")
        raw = with_markers(truth, head_motion(truth.time, 0).apply(truth.source.values))
        stabilised = {}
    stabilised["automatic"] = stabilise(raw).take
    every = {"without head motion": truth, "recorded": raw, **stabilised}
    return truth, {kind: with_markers(truth, take.source.values) for kind, take in every.items()}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--method", default="ssgpr")
    parser.add_argument("--labels", type=int, default=20)
    parser.add_argument("--repeats", type=int, default=5)
    options = parser.parse_args()
    records: list[dict[str, object]] = []
    for name in (*OPTICAL, *SIMULATED):
        truth, takes = variants(name)
        for kind, take in takes.items():
            with threadpool_limits(1):
                error = retargeting_error(take, truth, options)
            left = distance(take.source.values, truth.source.values)
            records.append({"take": name, "markers": kind, "distance": left, "rms": error})
            print(f"{name:<18}{kind:<22}{left:8.4f}{error:8.4f}", flush=True)
    rows = [
        [str(r["take"]), str(r["markers"]), f"{r['distance']:.4f}", f"{r['rms']:.4f}"]
        for r in records
    ]
    header = ["take", "markers", "distance from the track, cm", "RMS of the controls"]
    parts = [
        "# Head motion removed",
        f"`{options.method}`, {options.labels} labels, {options.repeats} draws. *Chosen*: "
        f"{', '.join(CHOSEN)}, on which the optical tracks were aligned by those who made them. "
        f"The simulated tracks have a head motion of {DEGREES:g} degrees and {SHIFT:g} cm RMS.",
        markdown(header, rows, texts=2),
    ]
    write_text(RESULTS / "stabilising.md", parts)
    write_csv(RESULTS / "stabilising.csv", records)


if __name__ == "__main__":
    main()

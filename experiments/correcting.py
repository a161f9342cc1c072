"""Posing from a source frame: a retargeted pose, some of whose controls are then set right.

    python -m experiments.correcting

A model is trained on 10 posed frames and 90 poses of animation. Of retargeted test frames, 1, 2 or
3 controls are set to their true values: those that are farthest off, as an animator would, or the
most varying ones. Measured is what becomes of the others: RMS, divided by that of leaving them.
`SEEN` in `facert.posing.correction` was chosen on `utterance_a` and `optical_cheeks`.
Writes `experiments/results/posing_corrections.csv` and `.md`.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from threadpoolctl import threadpool_limits

import facert
from experiments.grid import RESULTS
from experiments.posing import PROBLEMS, TUNED, Row
from experiments.report import markdown, write_csv, write_text
from experiments.tracks import draw, read_track
from facert import Settings, Take
from facert.data.arrays import FloatArray, IntArray, rms
from facert.posing.completed_pose import known_poses
from facert.posing.completion import Completion
from facert.posing.correction import correct
from facert.preprocess.known_poses import Given, KnownPoses
from facert.retarget.options import AS_IT_IS

LABELS, POSES, TESTED = 10, 100, 100
METHODS = ("conditional Gaussian", "completed afresh", "facert")


@dataclass(frozen=True, eq=False)
class Retargeted:
    """Frames with the pose that a model gave them, its standard deviation, and the true one."""

    known: KnownPoses
    predicted: FloatArray
    std: FloatArray
    truth: FloatArray


def retarget(track: Take, seed: int) -> Retargeted:
    """Train on some frames of a track and retarget others."""
    assert track.params is not None
    take, test = draw(track, LABELS, POSES - LABELS, seed)
    retargeter = facert.train(take, Settings(seed=seed, detect=False, smooth=False))
    result = retargeter.retarget(take, options=AS_IT_IS)
    assert result.params is not None
    assert result.std is not None
    some = np.random.default_rng(seed).permutation(test)[:TESTED]
    _, known = known_poses(retargeter)
    return Retargeted(known, result.params[some], result.std[some], track.params[some])


def measure(frames: Retargeted) -> Iterator[Row]:
    """The error of the other controls, divided by that of leaving them as they were."""
    worst = np.argsort(-np.abs(frames.predicted - frames.truth), axis=1)
    varying = np.argsort(-frames.known.poses.std(axis=0))[None].repeat(len(worst), axis=0)
    for choice, order in (("farthest off", worst), ("most varying", varying)):
        for k in (1, 2, 3):
            given = order[:, :k]
            others = np.ones(frames.predicted.shape, dtype=bool)
            np.put_along_axis(others, given, values=False, axis=1)
            left = rms((frames.predicted - frames.truth)[others])
            poses = corrected(frames, given)
            ratios = {name: rms((poses[name] - frames.truth)[others]) / left for name in METHODS}
            yield {"corrected": k, "choice": choice, "left as it was": left} | ratios


def corrected(frames: Retargeted, given: IntArray) -> dict[str, FloatArray]:
    """Poses (n, P) with the given controls (n, k) set right, by each method."""
    rng, known = np.random.default_rng(0), frames.known
    C = np.cov(known.poses, rowvar=False)
    done: dict[str, list[FloatArray]] = {name: [] for name in METHODS}
    for predicted, std, truth, G in zip(
        frames.predicted, frames.std, frames.truth, given, strict=True
    ):
        wanted = Given(G, truth[G])
        gain = C[:, G] @ np.linalg.pinv(C[np.ix_(G, G)])
        done["conditional Gaussian"].append(known.clip(predicted + gain @ (truth - predicted)[G]))
        afresh = Completion.learn(known, G).pose(wanted, 0, rng)
        done["completed afresh"].append(afresh.pose)
        done["facert"].append(correct(predicted, std, known, wanted, 0, rng).pose)
    return {name: np.array(poses) for name, poses in done.items()}


def table(rows: list[Row]) -> str:
    """Geometric means over the tracks, the tuned ones and the others."""
    lines = []
    for choice in ("farthest off", "most varying"):
        for k in (1, 2, 3):
            for tuned in (True, False):
                some = [
                    row
                    for row in rows
                    if (row["choice"], row["corrected"]) == (choice, k)
                    and (row["track"] in TUNED) == tuned
                ]
                means = [np.exp(np.mean([np.log(float(row[m])) for row in some])) for m in METHODS]
                which = "tuned on" if tuned else "others"
                lines.append([choice, str(k), which, *(f"{mean:.2f}" for mean in means)])
    return markdown(["corrected", "controls", "tracks", *METHODS], lines, texts=3)


def main() -> None:
    """Measure, and write the table."""
    argparse.ArgumentParser(description=__doc__).parse_args()
    rows: list[Row] = []
    with threadpool_limits(1):
        for name, target in PROBLEMS:
            for seed in range(2):
                found = measure(retarget(read_track(name, target), seed))
                rows += [{"track": name, "target": target, "draw": seed} | row for row in found]
    heading = "# Corrected poses: RMS of the other controls, divided by that of leaving them"
    write_text(RESULTS / "posing_corrections.md", [heading, table(rows)])
    write_csv(RESULTS / "posing_corrections.csv", rows)
    print((RESULTS / "posing_corrections.md").read_text())


if __name__ == "__main__":
    main()

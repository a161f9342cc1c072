"""Posing: the rest of a pose from a few of its controls, against the alternatives.

    python -m experiments.posing [--quick]

From 100 or 400 poses of a track, drawn at random, the rest of other poses is predicted from their
2, 3 and 5 most varying controls, or from random ones that move. All methods are clipped to the
range of the known poses. What predicts the pose was chosen on `utterance_a` and `optical_cheeks`;
the constants behind its standard deviation were seen on all tracks. The last column of the tables
is the RMS error divided by the RMS standard deviation. Writes `experiments/results/posing.csv`,
`.md` and `.png`.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.distance import cdist
from threadpoolctl import threadpool_limits

import facert
from experiments.drawing import save
from experiments.grid import RESULTS
from experiments.report import markdown, write_csv, write_text
from experiments.tracks import DATA, draw, read_track
from facert import Settings, Take
from facert.data.arrays import FloatArray, IntArray, rms
from facert.data.normalisation import Normalisation
from facert.data.take import Source
from facert.methods.shared_gplvm import SemiSupervisedSGPLVM
from facert.models.gp.hyperparameters import maximise_likelihood
from facert.models.gplvm.source_mapping import Observation, SourceMapping
from facert.posing.completed_pose import complete_pose
from facert.posing.completion import Completion
from facert.preprocess.known_poses import KnownPoses
from facert.render.faces import posed_face
from facert.render.sheet import render_sheet

TUNED = "utterance_a", "optical_cheeks"
PROBLEMS = (
    ("utterance_a", "arkit"),
    ("utterance_a", "units"),
    ("optical_cheeks", "solved"),
    ("utterance_b", "arkit"),
    ("utterance_b", "units"),
    ("rom", "arkit"),
    ("rom", "units"),
    ("optical_eyebrows", "solved"),
)
GIVEN = (2, 3, 5)
PICTURED = (
    {"browInnerUp": 0.8, "jawOpen": 0.1},
    {"mouthSmileLeft": 0.5, "eyeBlinkLeft": 0.1},
    {"noseSneerLeft": 0.35, "browDownLeft": 0.5},
    {"mouthPucker": 0.6, "jawOpen": 0.05},
    {"mouthFrownLeft": 0.3, "browInnerUp": 0.5},
)
TESTED = 250
MOVES = 1e-3  # least standard deviation of a control that may be given
EXACT = 1e-4  # variance of the given controls in the latent model
OURS, CALIBRATION = "facert", "error / std"
Row = dict[str, str | int | float]


@dataclass(frozen=True, eq=False)
class Problem:
    """Known poses (n, P), others to test on (m, P), and the controls that are given (k,)."""

    known: FloatArray
    test: FloatArray
    given: IntArray

    @property
    def rest(self) -> IntArray:
        """The other controls."""
        return np.setdiff1d(np.arange(self.known.shape[1]), self.given)

    @property
    def parts(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Given and rest of the known poses, given of the others."""
        return self.known[:, self.given], self.known[:, self.rest], self.test[:, self.given]


Predict = Callable[[Problem], FloatArray]


def mean_of_nearest(count: int) -> Predict:
    """The mean of the known poses that are nearest in the given controls."""

    def predict(problem: Problem) -> FloatArray:
        given, rest, values = problem.parts
        nearest = np.argsort(cdist(values, given), axis=1, kind="stable")[:, :count]
        return np.asarray(rest[nearest].mean(axis=1))

    return predict


def conditional_gaussian(problem: Problem) -> FloatArray:
    """The conditional mean of the Gaussian with the known poses' mean and covariance."""
    given, rest, values = problem.parts
    centred = given - given.mean(axis=0)
    C = centred.T @ centred / len(given)
    C[np.diag_indices_from(C)] += 1e-3 * np.trace(C) / len(C)
    gain = np.linalg.solve(C, centred.T @ (rest - rest.mean(axis=0)) / len(given))
    return np.asarray(rest.mean(axis=0) + (values - given.mean(axis=0)) @ gain)


def direct_regression(problem: Problem) -> FloatArray:
    """A Gaussian process from the given to the rest, linear + RBF kernel by maximum likelihood."""
    given, rest, values = problem.parts
    inputs, outputs = Normalisation.of(given, "given"), Normalisation.of(rest, "rest")
    X, Y = inputs.apply(given), outputs.apply(rest)
    kernel = maximise_likelihood(X, Y).kernel
    alpha = np.linalg.solve(kernel.gram(X), Y)
    return outputs.undo(kernel.cross(inputs.apply(values), X) @ alpha)


def latent_model(track: Take, known: int, seed: int) -> Predict:
    """The paper's: the most probable latent point of the target view, given some controls."""
    labels = min(40, known // 2)
    take, _ = draw(track, labels, known - labels, seed)
    retargeter = facert.train(take, Settings(method="ssgplvm", latent_dim=16, seed=seed))
    method, units = retargeter.method, retargeter.target_units
    assert isinstance(method, SemiSupervisedSGPLVM)
    target = method.target_

    def predict(problem: Problem) -> FloatArray:
        variance = np.full(problem.test.shape, np.inf)
        variance[:, problem.given] = EXACT
        seen = Observation(np.where(np.isinf(variance), 0.0, units.apply(problem.test)), variance)
        z = SourceMapping(target).solve(seen).z
        return units.undo(target.predict(z).mean)[:, problem.rest]

    return predict


def measure(track: Take, known: int, seed: int, randoms: int) -> Iterator[Row]:
    """The errors of every method on one draw of known poses."""
    assert track.params is not None
    rng = np.random.default_rng(seed)
    order = rng.permutation(len(track))
    poses, test = track.params[order[:known]], track.params[order[known : known + TESTED]]
    methods: dict[str, Predict] = {
        "nearest pose": mean_of_nearest(1),
        "mean of 8 nearest": mean_of_nearest(8),
        "conditional Gaussian": conditional_gaussian,
        "GP regression": direct_regression,
    }
    if known <= 100:
        methods["latent model"] = latent_model(track, known, seed)
    std = poses.std(axis=0)
    moving = np.flatnonzero(std > MOVES)
    for k in GIVEN:
        chosen = [("varying", np.argsort(-std)[:k])]
        chosen += [("random", rng.choice(moving, k, replace=False)) for _ in range(randoms)]
        for choice, given in chosen:
            facts: Row = {"known": known, "draw": seed, "given": k, "choice": choice}
            yield facts | errors_of(Problem(poses, test, given), methods)


def errors_of(problem: Problem, methods: Mapping[str, Predict]) -> Row:
    """RMS of each method over the rest, clipped alike; the calibration of our std; how long."""
    truth, rest = problem.test[:, problem.rest], problem.rest
    bounds = np.stack([problem.known.min(axis=0), problem.known.max(axis=0)], axis=1)
    errors: Row = {
        name: rms(np.clip(method(problem), *bounds[rest].T) - truth)
        for name, method in methods.items()
    }
    began = time.perf_counter()
    completion = Completion.learn(KnownPoses(problem.known, bounds), problem.given)
    learned = time.perf_counter()
    completion.complete(problem.test[:1, problem.given])
    answered = time.perf_counter()
    poses, std = completion.complete(problem.test[:, problem.given])
    errors[OURS] = rms(poses[:, rest] - truth)
    errors[CALIBRATION] = rms(poses[:, rest] - truth) / rms(std[:, rest])
    errors["learn ms"], errors["answer ms"] = 1e3 * (learned - began), 1e3 * (answered - learned)
    return errors


def tables(rows: list[Row]) -> list[str]:
    """A table for each number of known poses and way to choose, and how facert compares."""
    parts = []
    for known in sorted({int(row["known"]) for row in rows}):
        for choice in ("varying", "random"):
            some = [row for row in rows if row["known"] == known and row["choice"] == choice]
            parts += [f"## {known} known poses, the given controls are {choice} ones", _table(some)]
    return parts


def _table(rows: list[Row]) -> str:
    names = ["track", "target", "given", "known", "draw", "choice", "learn ms", "answer ms"]
    methods = [name for name in rows[0] if name not in [*names, CALIBRATION]]
    cells = {(row["track"], row["target"], row["given"]): None for row in rows}
    lines, ratios = [], []
    for cell in cells:
        here = [row for row in rows if (row["track"], row["target"], row["given"]) == cell]
        means = {name: np.mean([float(row[name]) for row in here]) for name in methods}
        least = min(means.values())
        shown = [f"**{v:.4f}**" if v == least else f"{v:.4f}" for v in means.values()]
        calibration = np.mean([float(row[CALIBRATION]) for row in here])
        lines.append([*map(str, cell), *shown, f"{calibration:.2f}"])
        ratios.append([np.log(means[OURS] / value) for value in means.values()])
    mean = [f"{value:.3f}" for value in np.exp(np.mean(ratios, axis=0))]
    lines.append(["all", "facert / it", "", *mean, ""])
    return markdown(["track", "target", "given", *methods, CALIBRATION], lines, texts=3)


def draw_faces(path: Path) -> None:
    """What two controls become, with all poses of the range-of-motion track known."""
    rig, track = facert.read_rig(DATA / "rigs" / "ict_face.npz"), read_track("rom", "arkit")
    assert track.controls is not None
    names = track.controls.names
    done = [complete_pose(track, asked, samples=2, seed=1) for asked in PICTURED]
    alone = [[asked.get(name, 0.0) for name in names] for asked in PICTURED]
    shown = {
        "2 given": np.array(alone),
        "completed": np.array([one.pose for one in done]),
        "a sample": np.array([one.samples[0] for one in done]),
        "another": np.array([one.samples[1] for one in done]),
    }
    faces = [posed_face(_posed(track, poses), rig, label) for label, poses in shown.items()]
    save(render_sheet(faces, list(range(len(PICTURED))), None, 200), path)


def _posed(track: Take, poses: FloatArray) -> Take:
    """A take with these poses."""
    time = np.arange(len(poses), dtype=np.float64)
    source = Source(time[:, None], ("frame",))
    return Take(time, source, controls=track.controls, params=poses)


def main() -> None:
    """Measure, and write the tables and the picture."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="one draw of 100 poses only")
    quick = parser.parse_args().quick
    plan = [(100, 1, 1)] if quick else [(100, 3, 2), (400, 2, 2)]
    rows: list[Row] = []
    with threadpool_limits(1):
        for known, draws, randoms in plan:
            for name, target in PROBLEMS:
                track = read_track(name, target)
                found = (
                    row for seed in range(draws) for row in measure(track, known, seed, randoms)
                )
                mark = name if name not in TUNED else f"{name}*"
                rows += [{"track": mark, "target": target} | row for row in found]
                print(known, name, target, flush=True)
    heading = (
        "# Posing: RMS of the controls that were not given\n\n* tracks that facert was tuned on"
    )
    write_text(RESULTS / "posing.md", [heading, *tables(rows)])
    write_csv(RESULTS / "posing.csv", rows)
    draw_faces(RESULTS / "posing.png")
    print((RESULTS / "posing.md").read_text())


if __name__ == "__main__":
    main()

"""Section 4.3, Figures 9 and 10: a face driven by 80 feature points, by every method.

A test is an identity and a recorded expression: the neutral face and the true places of its
feature points are given, the true places of all other vertices are compared. The error is the
root mean square distance of a vertex, in centimetres. A method whose mean is far beyond the
others' is left out of the diagram, not of the table.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from experiments.drawing import save
from experiments.report import write_csv, write_text
from experiments.topology.characters import POINTS, Character, farthest_points, ict, makehuman
from experiments.topology.recordings import RECORDINGS, expressive_frames
from experiments.topology.scores import Scores, draw_curves
from facert.data.arrays import FloatArray, IntArray
from facert.data.rig import MeshSequence
from facert.render.faces import Face
from facert.render.sheet import render_sheet
from facert.topology.driving import DEFAULT, METHODS, FaceDriver
from facert.topology.suggested_points import suggest_points

OWN = ("smooth", "framework", "literal")
FACES = 10
EXPRESSIONS = 5
LANDMARKS = "landmarks and rim, ICT-FaceKit"
SHOWN = ("rbf-linear", "laplacian", "framework", DEFAULT)


@dataclass(frozen=True, eq=False)
class Test:
    """A face, where its labelled vertices are, and expressions of it (n, V, 3)."""

    character: Character
    points: IntArray
    truth: FloatArray

    def drive(self, method: str) -> FloatArray:
        """What a method makes of the feature points, (n, V, 3)."""
        mesh = self.character.mesh
        driver = FaceDriver(mesh.vertices, mesh.faces, self.points, method)
        return driver.deform(self.truth[:, self.points])


def vertex_rms(vertices: FloatArray, truth: FloatArray) -> FloatArray:
    """Root mean square distance of a vertex in each frame, (n,)."""
    return np.asarray(np.sqrt(((vertices - truth) ** 2).sum(axis=2).mean(axis=1)))


def score(tests: list[Test]) -> Scores:
    """Every method on the same tests."""
    errors = {
        method: np.concatenate([vertex_rms(test.drive(method), test.truth) for test in tests])
        for method in METHODS
    }
    return Scores(errors, DEFAULT, [name for name in OWN if name in METHODS])


def ict_tests(seed: int = 0) -> list[Test]:
    """Identities of ICT-FaceKit under recorded weights, landmarks as labels."""
    rng = np.random.default_rng(seed)
    tests = []
    for number in range(FACES):
        character = ict(rng.normal(size=8))
        recording = RECORDINGS[number % len(RECORDINGS)]
        weights, names = expressive_frames(recording, "arkit", EXPRESSIONS, rng)
        truth = character.pose(character.settings(weights, names))
        tests.append(Test(character, character.points, truth))
    return tests


def evenly_spread(tests: list[Test]) -> list[Test]:
    """The same tests with 80 points spread evenly over the face."""
    points = farthest_points(tests[0].character.mesh.vertices, POINTS)
    return [Test(test.character, points, test.truth) for test in tests]


def suggested(tests: list[Test]) -> list[Test]:
    """The same tests with the 80 points that facert suggests for the rig."""
    points = suggest_points(tests[0].character.rig, POINTS)
    return [Test(test.character, points, test.truth) for test in tests]


def makehuman_tests(seed: int = 0) -> list[Test]:
    """MakeHuman's face in its own expression units, solved for recorded performances."""
    rng, character = np.random.default_rng(seed), makehuman("unit")
    tests = []
    for number in range(FACES):
        recording = RECORDINGS[number % len(RECORDINGS)]
        weights, names = expressive_frames(recording, "units", EXPRESSIONS, rng)
        truth = character.pose(character.settings(weights, names))
        tests.append(Test(character, character.points, truth))
    return tests


def figure_9(tests: list[Test]) -> Figure:
    """Four faces: the methods and the truth, a row each."""
    chosen = [(test, _widest(test)) for test in tests[:4]]
    mesh = chosen[0][0].character.mesh
    rows = {name: [test.drive(name)[frame] for test, frame in chosen] for name in SHOWN}
    rows["truth"] = [test.truth[frame] for test, frame in chosen]
    faces = [
        Face(name, MeshSequence(mesh, np.arange(4.0), np.stack(row).__getitem__))
        for name, row in rows.items()
    ]
    figure = render_sheet(faces, range(4), pixels=180)
    for axes in figure.axes:
        axes.set_title("")  # each column is another face, not another time
    return figure


def _widest(test: Test) -> int:
    """The expression with the largest displacement of a vertex."""
    return int(np.abs(test.truth - test.character.mesh.vertices).max(axis=(1, 2)).argmax())


def figure_10(scores: Scores) -> Figure:
    """The error of every test, in the order of the default's."""
    order = np.argsort(scores.errors[scores.default])
    limit = 2.5 * scores.errors[scores.best_baseline].mean()
    curves = {
        name: errors[order] for name, errors in scores.errors.items() if errors.mean() < limit
    }
    figure = Figure(figsize=(7, 3.4), dpi=120, layout="constrained")
    axes = figure.subplots()
    draw_curves(axes, range(1, len(order) + 1), curves, tuple(METHODS))
    axes.set_xlabel("test", fontsize=9)
    axes.set_ylabel("vertex RMS (cm)", fontsize=9)
    figure.legend(loc="outside right center", frameon=False, fontsize=9)
    return figure


def run(results: Path) -> None:
    """Write figures, tables and every number."""
    tests = ict_tests()
    others = makehuman_tests()
    sets = {
        LANDMARKS: tests,
        "suggested points, ICT-FaceKit": suggested(tests),
        "evenly spread points, ICT-FaceKit": evenly_spread(tests),
        "landmarks and rim, MakeHuman": others,
        "suggested points, MakeHuman": suggested(others),
    }
    scores = {name: score(one) for name, one in sets.items()}
    save(figure_9(tests), results / "figure9.png")
    save(figure_10(scores[LANDMARKS]), results / "figure10.png")
    write_csv(
        results / "driving.csv",
        [row for name, one in scores.items() for row in one.rows(points=name)],
    )
    parts = ["# Face driving: 80 points", "Made by `python -m experiments.topology driving`."]
    for name, one in scores.items():
        parts += [f"## {name}: {len(one.errors[DEFAULT])} tests", one.table("vertex RMS (cm)")]
    write_text(results / "driving.md", parts)

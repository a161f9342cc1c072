"""Section 4.4, Figures 11 to 14: an actor's markers to a different character's dense face.

The actor is an identity of ICT-FaceKit under recorded weights, with 80 markers; the character
MakeHuman's head in its own expression units, solved for the same performance. The markers are where
facert suggests feature points for the head. Of each segment of 100 frames, 10 are posed. The
markers of the character are propagated from there, and drive its 4,244 vertices. The segments are
those in which a control moves most. Errors are over the frames that were not posed.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from experiments.drawing import save
from experiments.report import markdown, write_csv, write_text
from experiments.topology.characters import IDENTITIES, POINTS, Character, ict, makehuman, on_ict
from experiments.topology.driving import vertex_rms
from experiments.topology.recordings import RECORDINGS, SEGMENT, liveliest, weights_of
from facert.data.arrays import FloatArray, IntArray
from facert.data.rig import MeshSequence
from facert.render.faces import Face
from facert.render.sheet import render_sheet
from facert.topology import driving, propagation
from facert.topology.driving import FaceDriver
from facert.topology.keyed import KeyedPerformance
from facert.topology.propagation import propagate
from facert.topology.suggested_points import suggest_points

EXPRESSIONS = {11: "jawOpen", 12: "mouthSmileLeft", 13: "mouthFrownLeft", 14: "mouthPucker"}
KEYS = np.linspace(0, SEGMENT - 1, 10).round().astype(int)
SHOWN = ((KEYS[1:] + KEYS[:-1]) // 2)[:8]  # halfway between poses, where it is hardest
DEFAULT = (next(iter(propagation.METHODS)), driving.DEFAULT)
BASELINES = (("rbf-linear", "rbf-linear"), ("laplacian", "laplacian"), ("affine", "biharmonic"))


@dataclass(frozen=True, eq=False)
class Performance:
    """The same segment of an actor and a character.

    Attributes
    ----------
    actor, character : Character
    acted, truth : array, shape (T, V, 3)
        All vertices of either.
    markers, points : array of int, shape (80,)
        The actor's vertices that serve as markers, and the same places of the character.
    """

    actor: Character
    acted: FloatArray
    markers: IntArray
    character: Character
    truth: FloatArray
    points: IntArray

    @cached_property
    def keyed(self) -> KeyedPerformance:
        """The actor's markers, and the character's in the posed frames."""
        posed = self.truth[np.ix_(KEYS, self.points)]
        return KeyedPerformance(self.acted[:, self.markers], KEYS, posed)

    def animate(self, propagated: str, driven: str) -> FloatArray:
        """The character's vertices by a method of propagation and one of driving."""
        mesh = self.character.mesh
        points = propagate(self.keyed, propagated)
        return FaceDriver(mesh.vertices, mesh.faces, self.points, driven).deform(points)

    def floor(self) -> FloatArray:
        """What driving alone leaves: by the true markers."""
        mesh = self.character.mesh
        driver = FaceDriver(mesh.vertices, mesh.faces, self.points)
        return driver.deform(self.truth[:, self.points])

    def error(self, vertices: FloatArray) -> float:
        """Vertex RMS over the frames without a pose, in centimetres."""
        free = np.setdiff1d(np.arange(SEGMENT), KEYS)
        return float(vertex_rms(vertices[free], self.truth[free]).mean())


def perform(control: str) -> Performance:
    """The segment of all recordings in which a control moves most."""
    recording, part = liveliest(RECORDINGS, control)
    weights, names = weights_of(recording, "arkit", part)
    actor = ict(np.random.default_rng(0).normal(size=IDENTITIES))
    character = makehuman("unit")
    settings = character.settings(*weights_of(recording, "units", part))
    acted = actor.pose(actor.settings(weights, names))
    points = suggest_points(character.rig, POINTS)
    return Performance(actor, acted, on_ict(points), character, character.pose(settings), points)


def draw(performance: Performance, animated: FloatArray) -> Figure:
    """Eight frames of the actor, the character as animated, and the truth."""
    motions = {
        "actor": (performance.actor, performance.acted),
        "facert": (performance.character, animated),
        "truth": (performance.character, performance.truth),
    }
    time = np.arange(SEGMENT) / 30
    faces = [
        Face(name, MeshSequence(character.mesh, time, vertices.__getitem__))
        for name, (character, vertices) in motions.items()
    ]
    return render_sheet(faces, [int(frame) for frame in SHOWN], pixels=150)


def run(results: Path) -> None:
    """Write figures, a table and every number."""
    rows: list[dict[str, object]] = []
    for number, control in EXPRESSIONS.items():
        performance = perform(control)
        animated = performance.animate(*DEFAULT)
        save(draw(performance, animated), results / f"figure{number}.png")
        errors = {
            " + ".join(DEFAULT): performance.error(animated),
            **{" + ".join(one): performance.error(performance.animate(*one)) for one in BASELINES},
            "true markers + " + DEFAULT[1]: performance.error(performance.floor()),
            "(still face)": performance.error(
                np.broadcast_to(performance.truth[KEYS].mean(axis=0), performance.truth.shape)
            ),
        }
        rows += [{"figure": number, "control": control, "method": name, "vertex_rms_cm": error}
                 for name, error in errors.items()]  # fmt: skip
    write_csv(results / "pipeline.csv", rows)
    parts = [
        "# The full pipeline: an actor's markers to another character's dense face",
        "Made by `python -m experiments.topology pipeline`. Vertex RMS (cm) over the 90 frames of"
        " each segment that were not posed, by method of propagation + method of driving.",
        _table(rows),
        *(f"![{control}](figure{number}.png)" for number, control in EXPRESSIONS.items()),
    ]
    write_text(results / "pipeline.md", parts)


def _table(rows: list[dict[str, object]]) -> str:
    methods = dict.fromkeys(str(row["method"]) for row in rows)
    header = ("methods", *(f"{control} (Figure {n})" for n, control in EXPRESSIONS.items()))
    lines = []
    for method in methods:
        errors = [row["vertex_rms_cm"] for row in rows if row["method"] == method]
        lines.append((method, *(f"{error:.4f}" for error in errors)))
    return markdown(header, lines)

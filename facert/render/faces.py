"""Faces in motion with their names, from takes and rigs or mesh sequences, and frames to draw."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from facert.data.arrays import FloatArray, IntArray, require_bounded
from facert.data.drivers import require_used
from facert.data.names import NameIndex, shape_drivers
from facert.data.rig import MeshSequence, Rig, require_extent
from facert.data.take import Take
from facert.errors import InputError
from facert.render.shade import Camera, frame_mesh, shade

TURN = -0.22  # radians; seen a little from the side, a face has more shape
_LOOKED_AT = 16  # frames that show how much room a face needs
_MOST_ROOM = 1.3
_SAMPLED = 100  # vertices that distinguish the frames of a mesh
ACTOR = "actor"  # the label of his face
INK = "#3a3f47"  # of what is written and drawn beside faces


Pixels = NDArray[np.uint8]

FrameAt = Callable[[float], Pixels | None]
"""From seconds of a take to the frame of a video (H, W, 3), or None where it has none."""


@dataclass(frozen=True, eq=False)
class Face:
    """A mesh in motion and what to write beside it."""

    label: str
    motion: MeshSequence
    blank: str = "no pose"
    """What is written where a frame has no vertices."""
    subject: int | None = None
    """So many vertices, the first, are what a camera frames; all by default."""

    def picture(self, vertices: FloatArray, camera: Camera, pixels: int) -> FloatArray | None:
        """The face with these vertices (V, 3), RGBA (pixels, pixels, 4); None if any is NaN."""
        if np.isnan(vertices).any():
            return None
        neutral = self.motion.neutral
        return shade(vertices, neutral.faces, camera, pixels, neutral.colours)


def frame_faces(faces: Sequence[Face], frames: Sequence[int]) -> list[Camera]:
    """A camera for each face, the same for all frames, that shows where it goes in most of them.

    Each is as large as its neutral allows; all shrink alike when one needs more room, so that
    faces beside each other stay comparable.
    """
    cameras = [frame_mesh(face.motion.neutral.vertices[: face.subject], TURN) for face in faces]
    some = np.asarray(frames)[:: max(1, len(frames) // _LOOKED_AT)]
    needed = 1.0
    for face, camera in zip(faces, cameras, strict=True):
        for vertices in face.motion.fetch(some):
            seen = camera.project(vertices[: face.subject], 2)[:, :2]
            off = np.abs(seen - 0.5).max()  # 1 at the border
            needed = max(needed, 0.0 if np.isnan(off) else off)
    room = min(1.02 * needed, _MOST_ROOM) if needed > 1 else 1.0
    return [replace(camera, reach=room * camera.reach) for camera in cameras]


def posed_face(take: Take, rig: Rig, label: str) -> Face:
    """The rig in the poses of a take; NaN where a frame has none.

    Raises
    ------
    InputError
        When the take has no poses, or a control that the rig has no shape for.
    """
    settings = control_settings(take, rig, range(len(take)))

    def fetch(frames: IntArray) -> FloatArray:
        return rig.deform(settings[frames])

    motion = MeshSequence(rig.whole, take.time, fetch, take.fps, take.start_timecode)
    return Face(label, motion, subject=len(rig.neutral))


def actor_face(take: Take, rig: Rig) -> Face:
    """The face of an actor whose weights were tracked; a weight that is hidden counts as 0.

    Raises
    ------
    InputError
        When the rig has a shape for none of the weights, see `facert.data.names.shape_drivers`.
    """
    index = NameIndex.among(rig.names, take.source.names, "--rig", halves=True, quiet=True)
    known = [name for name in take.source.names if index.find_halves(name)]
    if not known:
        raise _misfit("shapes for the take's weights", f"none for {take.source.names[0]!r}")
    columns = [take.source.names.index(name) for name in known]
    require_bounded(take.source.values, "/source/weights")
    weights = np.nan_to_num(take.source.values[:, columns]) @ shape_drivers(known, rig.names)
    return driven_face(take, rig, weights)


def driven_face(take: Take, rig: Rig, weights: FloatArray) -> Face:
    """The face of a take's actor: a rig with weights (T, K), NaN where nothing was observed."""
    motion = MeshSequence(
        rig.whole, take.time, lambda rows: rig.deform(weights[rows]), take.fps, take.start_timecode
    )
    return Face(ACTOR, motion, "not tracked", len(rig.neutral))


def drives(rig: Rig, names: Sequence[str]) -> bool:
    """Whether a rig has a shape, or its two halves, for every name."""
    try:
        shape_drivers(names, rig.names, quiet=True)
    except InputError:
        return False
    return True


def require_drawable(take: Take, actor: Rig | Face | None) -> None:
    """Raise InputError unless there is a face to draw a take of weights, and none for markers."""
    if take.source.kind == "markers" and actor is not None:
        raise _misfit("a take of weights", "a take of markers")
    if take.source.kind == "weights" and actor is None:
        raise _misfit("the actor's rig, for a take of weights", "none")


def _misfit(expected: str, found: str) -> InputError:
    return InputError("--rig", expected, found, "Give the rig that fits, or none for markers.")


def control_settings(take: Take, rig: Rig, frames: Sequence[int]) -> FloatArray:
    """The take's poses in some frames as the rig's parameters (n, K); other shapes stay at 0.

    Raises
    ------
    InputError
        When the take has no poses, or a control that the rig has no shape for, see
        `facert.data.names.shape_drivers`.
    """
    poses, controls = require_poses(take), take.controls
    assert controls is not None  # poses come with controls
    if rig.driven is not None:
        require_used(rig.driven.controls, controls.names)
    return np.asarray(poses[np.asarray(frames)] @ shape_drivers(controls.names, rig.names))


def require_poses(take: Take) -> FloatArray:
    """The take's poses (T, P); raises InputError when it has none, or any of absurd size."""
    if take.params is None or not len(take.labels):
        raise InputError(
            "/target/params", "poses of the character", "none", "Give a take that was retargeted."
        )
    require_bounded(take.params, "/target/params")
    return take.params


def require_deviations(take: Take) -> FloatArray | None:
    """Standard deviations of the poses (T, P), if known; raises InputError for absurd sizes."""
    if take.std is not None:
        require_bounded(take.std, "/target/std")
    return take.std


def outline(motion: MeshSequence) -> FloatArray:
    """Positions of some vertices in every frame, (T, D): enough to compare frames."""
    vertices = len(motion.neutral.vertices)
    chosen = np.arange(0, vertices, max(1, vertices // _SAMPLED))
    parts = [batch[:, chosen].reshape(len(batch), -1) for batch in motion.batches()]
    return np.concatenate(parts)


def choose_frames(poses: FloatArray, count: int) -> list[int]:
    """Frames whose poses (T, P) are far from each other, in order of time; NaN rows are left out.

    The first is the pose nearest to rest, each next one the farthest from all before.
    """
    known = np.flatnonzero(~np.isnan(poses).any(axis=1))
    if not len(known):
        raise InputError(
            "/target/params", "a pose in at least one frame", "none", "Retarget the take first."
        )
    poses = poses[known] / np.maximum(np.ptp(poses[known], axis=0), 1e-9)
    distance = np.linalg.norm(poses - np.median(poses, axis=0), axis=1)
    chosen = [int(distance.argmin())]
    distance = np.full(len(poses), np.inf)
    for _ in range(min(count, len(known)) - 1):
        distance = np.minimum(distance, np.linalg.norm(poses - poses[chosen[-1]], axis=1))
        chosen.append(int(distance.argmax()))
    return sorted(int(frame) for frame in known[np.unique(chosen)])


def require_same_length(faces: Sequence[Face]) -> None:
    """Raise InputError for the first face that has another number of frames than the first."""
    expected = len(faces[0].motion)
    for face in faces[1:]:
        if len(face.motion) != expected:
            raise InputError(
                f"--{face.label}" if face.label == "truth" else face.label,
                f"{expected} frames",
                f"{len(face.motion)}",
                "Give faces of the same performance.",
            )


def require_extents(faces: Sequence[Face]) -> None:
    """Raise InputError for a face that lies in one place, as seen from the front."""
    for face in faces:
        require_extent(face.motion.neutral.vertices[: face.subject, :2])


def require_part(part: range, length: int) -> None:
    """Raise InputError unless a part of a performance lies in it."""
    if not part or part.start < 0 or part.stop > length:
        expected, found = f"a part of 0..{length - 1}", f"{part.start}..{part.stop - 1}"
        raise InputError("--frames", expected, found, "Choose another.")

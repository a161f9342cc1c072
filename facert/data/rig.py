"""Meshes, meshes in motion, and rigs.

Plain frozen dataclasses, checked when they are made, like those of `facert.data.take`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from facert.data.arrays import (
    FloatArray,
    IntArray,
    checked_colours,
    checked_names,
    float_array,
    frozen,
    require_bounded,
    require_plain,
    require_sensible,
    require_shape,
    require_time,
    set_fields,
)
from facert.data.driven_nodes import DrivenNodes
from facert.errors import InputError

_FRAMES, _VERTICES = 64, 2**16  # at least, and of small meshes at most, in a batch
CLAY = (0.80, 0.72, 0.66)
"""What is shown without colours of its own."""


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles in space.

    Parameters
    ----------
    vertices : array, shape (V, 3)
        In `units`.
    faces : array of int, shape (F, 3)
        Triangles, anticlockwise as seen from outside.
    units : str
        Unit of length; empty when unknown.
    colours : array, shape (V, 3), optional
        Red, green and blue of every vertex, 0 to 1; for pictures only.

    Raises
    ------
    InputError
        For wrong shapes, numbers that are not finite, or faces that name no vertex.
    """

    vertices: FloatArray
    faces: IntArray
    units: str = ""
    colours: FloatArray | None = None

    def __post_init__(self) -> None:
        vertices = float_array(self.vertices, "/neutral")
        require_shape(vertices.shape, ("V", 3), "/neutral", "Give vertex positions.")
        require_sensible(vertices, "/neutral")
        require_plain(self.units, "attribute units")
        faces = np.asarray(self.faces)
        if faces.ndim != 2 or faces.shape[1] != 3 or faces.dtype.kind not in "iu":
            found = f"{faces.dtype} {faces.shape}"
            raise InputError("/faces", "integers (F, 3)", found, "Give triangles.")
        if faces.size and not (0 <= faces.min() and faces.max() < len(vertices)):
            expected = f"vertex indices 0 to {len(vertices) - 1}"
            found = f"{faces.min()} to {faces.max()}"
            raise InputError("/faces", expected, found, "Check the export.")
        colours = checked_colours(self.colours, len(vertices))
        set_fields(self, vertices=frozen(vertices), faces=frozen(faces.astype(np.int64)))
        set_fields(self, colours=colours)


def require_extent(vertices: FloatArray) -> None:
    """Refuse a mesh (V, 3) whose vertices all lie in one place: nobody can draw or drive it."""
    if not np.ptp(vertices, axis=0).any():
        fix = "Export the mesh in its rest pose."
        raise InputError("/neutral", "vertices apart from each other", "all in one place", fix)


@dataclass(frozen=True, eq=False)
class MeshSequence:
    """A mesh in motion, whose frames are fetched when they are needed: it may be large.

    Parameters
    ----------
    neutral : Mesh
        Rest pose.
    time : array, shape (T,)
        Seconds, rising.
    fetch : callable
        From frame numbers, shape (n,), to vertices (n, V, 3); NaN where a frame has no pose. It
        raises `InputError` for vertices that are absurdly far away.
    fps : float
        Nominal frames a second.
    start_timecode : str
        Of time 0; empty when unknown.
    """

    neutral: Mesh
    time: FloatArray
    fetch: Callable[[IntArray], FloatArray]
    fps: float = 30.0
    start_timecode: str = ""

    def __post_init__(self) -> None:
        time = float_array(self.time, "/time")
        require_time(time, len(time), self.fps)
        set_fields(self, time=frozen(time), fetch=_bounded(self.fetch))

    def __len__(self) -> int:
        """Number of frames T."""
        return len(self.time)

    @property
    def batch(self) -> int:
        """How many frames to take at once: the more, the smaller the mesh."""
        return max(_FRAMES, _VERTICES // max(1, len(self.neutral.vertices)))

    def batches(self, size: int | None = None) -> Iterator[FloatArray]:
        """Iterate over the frames in order as vertices (n, V, 3), `batch` at once by default."""
        size = size or self.batch
        for start in range(0, len(self), size):
            yield self.fetch(np.arange(start, min(start + size, len(self))))


def _bounded(fetch: Callable[[IntArray], FloatArray]) -> Callable[[IntArray], FloatArray]:
    """The same vertices, none of them absurdly far away."""

    def bounded(frames: IntArray) -> FloatArray:
        vertices = fetch(frames)
        require_bounded(vertices, "/vertices")
        return vertices

    return bounded


class Shaped(Protocol):
    """A character whose controls have names: a rig, or a file of one."""

    @property
    def names(self) -> tuple[str, ...]:
        """The controls."""


@dataclass(frozen=True, eq=False)
class Rig:
    """A face mesh with linear shapes: vertices = neutral + sum_p params_p * shapes_p.

    A character may have more to show: meshes that no shape moves, and nodes that controls turn.

    Parameters
    ----------
    neutral : array, shape (V, 3)
        Rest pose, in `units`.
    shapes : array, shape (P, V, 3)
        Displacement of every vertex when a control is 1.
    names : sequence of str, length P
        The controls.
    faces : array of int, shape (F, 3)
        Triangles.
    units : str
        Unit of length; empty when unknown.
    colours : array, shape (V, 3), optional
        Red, green and blue of every vertex, 0 to 1; for pictures only.
    body : Mesh, optional
        What no shape moves: eyeballs, teeth, hair, neck; for pictures only.
    driven : DrivenNodes, optional
        Bones that controls turn or shift, with all vertices, those of the body last; for pictures
        only. The shape of a control that does nothing else is 0.
    """

    neutral: FloatArray
    shapes: FloatArray
    names: tuple[str, ...]
    faces: IntArray
    units: str = ""
    colours: FloatArray | None = None
    body: Mesh | None = None
    driven: DrivenNodes | None = None

    def __post_init__(self) -> None:
        mesh = Mesh(self.neutral, self.faces, self.units, self.colours)
        shapes = float_array(self.shapes, "/shapes")
        fix = "Give one displacement a control and vertex."
        require_shape(shapes.shape, ("P", *mesh.vertices.shape), "/shapes", fix)
        require_sensible(shapes, "/shapes")
        names = checked_names(self.names, len(shapes), "/names")
        set_fields(self, neutral=mesh.vertices, faces=mesh.faces, colours=mesh.colours)
        set_fields(self, shapes=frozen(shapes), names=names)

    @property
    def mesh(self) -> Mesh:
        """The mesh of the shapes in the rest pose."""
        return Mesh(self.neutral, self.faces, self.units, self.colours)

    @cached_property
    def whole(self) -> Mesh:
        """All that is to be seen in the rest pose: the mesh of the shapes, then the body."""
        if self.body is None:
            return self.mesh
        faces = np.concatenate([self.faces, self.body.faces + len(self.neutral)])
        vertices = np.concatenate([self.neutral, self.body.vertices])
        return Mesh(vertices, faces, self.units, self._all_colours())

    def _all_colours(self) -> FloatArray | None:
        if self.body is None or (self.colours is None and self.body.colours is None):
            return self.colours
        both = ((self.colours, self.neutral), (self.body.colours, self.body.vertices))
        clay = [np.tile(CLAY, (len(at), 1)) if one is None else one for one, at in both]
        return np.concatenate(clay)

    def deform(self, params: FloatArray) -> FloatArray:
        """Vertices (T, V, 3) of `whole` for parameters (T, P); NaN where these are.

        Raises `InputError` for parameters of absurd size.
        """
        flat, params = self.shapes.reshape(len(self.shapes), -1), np.asarray(params)
        require_bounded(params, "the rig's parameters")
        vertices = self.neutral + (params @ flat).reshape(-1, *self.neutral.shape)
        if self.body is not None:
            body = np.broadcast_to(self.body.vertices, (len(vertices), *self.body.vertices.shape))
            vertices = np.concatenate([vertices, body], axis=1)
        return vertices if self.driven is None else self.driven.moved(vertices, params)

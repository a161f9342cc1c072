"""Mesh sequence files: facert's own HDF5 layout for a mesh in motion.

=============  ==================  ================================================
``/time``      (T,)                seconds, rising
``/faces``     (F, 3) int          triangles
``/neutral``   (V, 3)              rest pose
``/vertices``  (T, V, 3) float32   every vertex in every frame, a chunk a frame
``/colours``   (V, 3)              optional: red, green, blue, 0 to 1
attributes                         format, format_version, fps, units, created_by
=============  ==================  ================================================

Frames are written and read in batches, so that memory does not grow with their number.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from facert.data.arrays import FloatArray, IntArray, require_shape, require_time
from facert.data.rig import Mesh, MeshSequence
from facert.errors import InputError, reading
from facert.io.hdf5 import GuardedFile, NewRows, create, open_guarded, stated_format

FORMAT = "facert-mesh-sequence"
VERSION = 1
_LARGEST = float(np.finfo(np.float32).max)


class SequenceWriter:
    """Takes the frames of a new mesh sequence, in order."""

    def __init__(self, rows: NewRows) -> None:
        self._rows = rows

    def append(self, vertices: FloatArray) -> None:
        """Write the next frames, vertices (n, V, 3).

        Raises `InputError` when a vertex is NaN, or too far away for float32, and `ValueError` when
        the frames are of another mesh, or more than were announced.
        """
        low, high = vertices.min(initial=0.0), vertices.max(initial=0.0)
        if not (-_LARGEST <= low and high <= _LARGEST):
            lost = ~(np.abs(vertices) <= _LARGEST).all(axis=(1, 2))
            raise _not_finite(self._rows.filled + int(lost.argmax()))
        self._rows.append(vertices)


@contextmanager
def new_mesh_sequence(
    path: Path, neutral: Mesh, time: FloatArray, fps: float, overwrite: bool = False
) -> Iterator[SequenceWriter]:
    """Write a mesh sequence in batches; the file appears when the block ends well.

    `neutral` is the rest pose, `time` (T,) has the seconds of all frames that will be written.

    Raises `InputError` when the time does not rise or `path` cannot be written to,
    `OutputExistsError` when it exists and `overwrite` is not set, and `ValueError` when the block
    ends before all frames were written.

    Examples
    --------
    >>> with new_mesh_sequence(path, mesh, take.time, take.fps) as sequence:  # doctest: +SKIP
    ...     for frames in batches:
    ...         sequence.append(frames)
    """
    require_time(time, len(time), fps)
    with create(path, FORMAT, VERSION, overwrite) as file:
        file.attribute("fps", fps)
        file.array("/time", time)
        file.mesh(neutral)
        rows = file.rows("/vertices", (len(time), *neutral.vertices.shape))
        yield SequenceWriter(rows)
        if rows.filled != len(time):
            raise ValueError(f"{rows.filled} frames written of {len(time)}")


def write_mesh_sequence(sequence: MeshSequence, path: Path, overwrite: bool = False) -> None:
    """Write a whole mesh sequence, a batch at a time; see `new_mesh_sequence`."""
    arguments = (sequence.neutral, sequence.time, sequence.fps, overwrite)
    with new_mesh_sequence(path, *arguments) as new:
        for frames in sequence.batches():
            new.append(frames)


def holds_mesh_sequence(path: Path) -> bool:
    """Whether a file states that it is a mesh sequence; any other file, or none, is not."""
    return stated_format(path) == FORMAT


@contextmanager
def open_mesh_sequence(path: Path) -> Iterator[MeshSequence]:
    """Open a mesh sequence; its frames can be fetched inside the block.

    Raises `InputError` naming the file and the HDF5 path that is at fault.
    """
    with open_guarded(path) as file:
        file.require_format(FORMAT, VERSION)
        yield _sequence(file, path)


def _sequence(file: GuardedFile, path: Path) -> MeshSequence:
    neutral = file.mesh()
    time, rows = file.numbers("/time"), file.rows("/vertices")
    expected = (len(time), *neutral.vertices.shape)
    require_shape(rows.shape, expected, "/vertices", "Write all vertices of every frame.")

    def fetch(frames: IntArray) -> FloatArray:
        with reading(path):  # by then, other files may be open as well
            vertices = rows.read(frames)
            finite = np.isfinite(vertices).all(axis=(1, 2))
            if not finite.all():
                raise _not_finite(int(frames[finite.argmin()]))
            return vertices

    return MeshSequence(neutral, time, fetch, file.number_attribute("fps"))


def _not_finite(frame: int) -> InputError:
    found, fix = f"NaN or infinity in frame {frame}", "Check the program that computed them."
    return InputError("/vertices", "finite numbers", found, fix)

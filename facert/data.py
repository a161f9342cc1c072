"""The nouns: what a take, its source, its controls and a rig are.

Plain frozen dataclasses. They check themselves when they are made and raise `InputError` naming
the field by its path in the HDF5 layout; they know nothing of files. Arrays are float64 and are
made read-only, so that a take can be shared without fear.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from facert.errors import InputError

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int64]

SourceKind = Literal["markers", "weights"]
_Scalar = TypeVar("_Scalar", bound=np.generic)

# HDF5 cannot hold NUL, UTF-8 no half of a pair; control characters and line ends upset a terminal.
_FORBIDDEN = re.compile(r"[\x00-\x1f\x7f-\x9f\u2028\u2029\ud800-\udfff]")


@dataclass(frozen=True, eq=False)
class Source:
    """What was recorded of the actor: markers in space, or tracked weights.

    Parameters
    ----------
    values : array, shape (T, M, 3) or (T, D)
        Marker positions in the take's units, or weights. NaN means not observed; a marker with
        one NaN coordinate is not observed at all.
    names : sequence of str, length M or D
        One name a marker or a weight, all different.

    Raises
    ------
    InputError
        For wrong shapes, doubled names, infinite values, or a source without any observation.
    """

    values: FloatArray
    names: tuple[str, ...]

    def __post_init__(self) -> None:
        values = _float_array(self.values, "/source")
        if values.ndim not in (2, 3) or (values.ndim == 3 and values.shape[2] != 3):
            raise InputError(
                "/source",
                "markers (T, M, 3) or weights (T, D)",
                f"shape {values.shape}",
                "Write markers with three coordinates, or weights as a matrix.",
            )
        path = "/source/markers" if values.ndim == 3 else "/source/weights"
        names = _names(self.names, values.shape[1], "/source/names")
        if np.isinf(values).any():
            raise InputError(
                path,
                "finite numbers, or NaN for what was not observed",
                "infinite values",
                "Replace them by NaN.",
            )
        if values.ndim == 3:
            values[np.isnan(values).any(axis=2)] = np.nan
        if np.isnan(values).all():
            raise InputError(
                path,
                "at least one observed value",
                "NaN or invalid everywhere",
                "Check the export.",
            )
        _set(self, values=_frozen(values), names=names)

    @property
    def valid(self) -> BoolArray:
        """What was observed, (T, M) or (T, D)."""
        observed = ~np.isnan(self.values)
        return np.asarray(observed.all(axis=2)) if observed.ndim == 3 else observed

    @property
    def kind(self) -> SourceKind:
        """``"markers"`` or ``"weights"``."""
        return "markers" if self.values.ndim == 3 else "weights"

    @property
    def matrix(self) -> FloatArray:
        """The source as one row a frame, (T, D) with D = 3 M for markers; NaN: not observed."""
        return self.values.reshape(len(self.values), -1)

    def with_matrix(self, matrix: FloatArray) -> Source:
        """The same markers or weights with other values, (T, D)."""
        return Source(matrix.reshape(len(matrix), *self.values.shape[1:]), self.names)


@dataclass(frozen=True, eq=False)
class Controls:
    """The parameters of a character's rig.

    Parameters
    ----------
    names : sequence of str, length P
        One name a control, all different.
    limits : array, shape (P, 2), optional
        Lowest and highest value of each control.
    """

    names: tuple[str, ...]
    limits: FloatArray | None = None

    def __post_init__(self) -> None:
        names = _names(self.names, len(self.names), "/target/names")
        _set(self, names=names)
        if self.limits is None:
            return
        limits = _float_array(self.limits, "/target/limits")
        if limits.shape != (len(names), 2) or not (limits[:, 0] <= limits[:, 1]).all():
            raise InputError(
                "/target/limits",
                f"({len(names)}, 2), low <= high",
                f"shape {limits.shape}" if limits.shape != (len(names), 2) else "low > high or NaN",
                "Give the lowest and the highest value of each control.",
            )
        _set(self, limits=_frozen(limits))


@dataclass(frozen=True, eq=False)
class Take:
    """A recorded performance, with the poses of the character that are known.

    Parameters
    ----------
    time : array, shape (T,)
        Seconds, rising.
    source : Source
        What was recorded, T frames.
    controls : Controls, optional
        The character's controls; needed when there are poses.
    params : array, shape (T, P), optional
        Poses in the control's own units; a row of NaN means that the frame has no pose.
    std : array, shape (T, P), optional
        Predictive standard deviation of ``params``, when a method wrote them.
    animation : array, shape (n, P), optional
        Poses of the character without a source frame.
    fps : float
        Nominal frames a second.
    units : str
        Unit of the marker positions, e.g. ``"cm"``; empty when unknown.
    start_timecode, up_axis : str
        As recorded; empty when unknown.

    Raises
    ------
    InputError
        When shapes disagree, time does not rise, or a pose is given in part.
    """

    time: FloatArray
    source: Source
    controls: Controls | None = None
    params: FloatArray | None = None
    std: FloatArray | None = None
    animation: FloatArray | None = None
    fps: float = 30.0
    units: str = ""
    start_timecode: str = ""
    up_axis: str = ""
    created_by: str = field(default="")

    def __post_init__(self) -> None:
        time = _float_array(self.time, "/time")
        frames = len(self.source.values)
        if time.shape != (frames,):
            raise InputError(
                "/time", f"{frames} seconds", f"shape {time.shape}", "Give one time a frame."
            )
        if not np.isfinite(time).all() or (np.diff(time) <= 0).any():
            raise InputError(
                "/time",
                "finite, strictly rising seconds",
                "a step back, a repeat or NaN",
                "Sort the frames by time and drop repeats.",
            )
        if not (np.isfinite(self.fps) and self.fps > 0):
            raise InputError("fps", "a positive number", f"{self.fps}", "Set the frame rate.")
        for name in ("units", "start_timecode", "up_axis", "created_by"):
            _require_plain(getattr(self, name), f"attribute {name}")
        _set(self, time=_frozen(time))
        for name, rows in (("params", frames), ("std", frames), ("animation", None)):
            _set(self, **{name: self._poses(name, rows)})

    def _poses(self, name: str, rows: int | None) -> FloatArray | None:
        """Check one of the pose matrices and return it as float64."""
        value = getattr(self, name)
        if value is None:
            return None
        path = "/animation/params" if name == "animation" else f"/target/{name}"
        if self.controls is None:
            raise InputError(
                "/target/names", "the controls' names", "none", "Write /target/names (P,)."
            )
        poses = _float_array(value, path)
        expected = (len(poses) if rows is None else rows, len(self.controls.names))
        if poses.shape != expected:
            raise InputError(
                path,
                f"shape {expected}",
                f"{poses.shape}",
                "Give one row a frame and one column a control.",
            )
        known = ~np.isnan(poses)
        partial = np.flatnonzero(known.any(axis=1) & ~known.all(axis=1))
        if np.isinf(poses).any() or len(partial) or (name == "animation" and not known.all()):
            row = f"row {partial[0]} known in part" if len(partial) else "infinite or NaN values"
            raise InputError(
                path,
                "whole finite poses (a row of NaN where a frame has none)",
                row,
                "Pose every control of the frame, or none.",
            )
        return _frozen(poses)

    def __len__(self) -> int:
        """Number of frames T."""
        return len(self.time)

    @property
    def labels(self) -> IntArray:
        """Indices of the frames whose pose is known."""
        if self.params is None:
            return np.empty(0, dtype=np.int64)
        return np.flatnonzero(~np.isnan(self.params[:, 0])).astype(np.int64)


@dataclass(frozen=True, eq=False)
class Rig:
    """A face mesh with linear shapes: vertices = neutral + sum_p params_p * shapes_p.

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
    """

    neutral: FloatArray
    shapes: FloatArray
    names: tuple[str, ...]
    faces: IntArray
    units: str = ""
    colours: FloatArray | None = None

    def __post_init__(self) -> None:
        neutral = _float_array(self.neutral, "/neutral")
        shapes = _float_array(self.shapes, "/shapes")
        if neutral.ndim != 2 or neutral.shape[1] != 3 or not len(neutral):
            raise InputError("/neutral", "(V, 3)", f"{neutral.shape}", "Give vertex positions.")
        if shapes.shape[1:] != neutral.shape:
            raise InputError(
                "/shapes",
                f"(P, {len(neutral)}, 3)",
                f"{shapes.shape}",
                "Give one displacement a control and vertex.",
            )
        if not (np.isfinite(neutral).all() and np.isfinite(shapes).all()):
            raise InputError(
                "/neutral, /shapes", "finite numbers", "NaN or infinity", "Check the export."
            )
        names = _names(self.names, len(shapes), "/names")
        _require_plain(self.units, "attribute units")
        faces = np.asarray(self.faces)
        if faces.ndim != 2 or faces.shape[1] != 3 or faces.dtype.kind not in "iu":
            raise InputError(
                "/faces", "integers (F, 3)", f"{faces.dtype} {faces.shape}", "Give triangles."
            )
        if faces.size and not (0 <= faces.min() and faces.max() < len(neutral)):
            raise InputError(
                "/faces",
                f"vertex indices 0 to {len(neutral) - 1}",
                f"{faces.min()} to {faces.max()}",
                "Check the export.",
            )
        _set(
            self,
            neutral=_frozen(neutral),
            shapes=_frozen(shapes),
            names=names,
            faces=_frozen(faces.astype(np.int64)),
            colours=self._colours(len(neutral)),
        )

    def _colours(self, vertices: int) -> FloatArray | None:
        if self.colours is None:
            return None
        colours = _float_array(self.colours, "/colours")
        if colours.shape != (vertices, 3) or not ((colours >= 0) & (colours <= 1)).all():
            raise InputError(
                "/colours",
                f"({vertices}, 3) between 0 and 1",
                f"shape {colours.shape}, or values outside",
                "Give red, green and blue of every vertex, or leave the colours out.",
            )
        return _frozen(colours)

    def deform(self, params: FloatArray) -> FloatArray:
        """Vertices (T, V, 3) for parameters (T, P)."""
        flat = self.shapes.reshape(len(self.shapes), -1)
        return self.neutral + (np.asarray(params) @ flat).reshape(-1, *self.neutral.shape)


def _set(instance: object, **values: object) -> None:
    """Set fields of a frozen dataclass while it is being made."""
    for name, value in values.items():
        object.__setattr__(instance, name, value)


def _frozen(array: NDArray[_Scalar]) -> NDArray[_Scalar]:
    array.setflags(write=False)
    return array


def _float_array(value: ArrayLike, path: str) -> FloatArray:
    """A float64 array; a copy, so that freezing it never touches the caller's."""
    array = np.array(value)
    if array.dtype.kind not in "fiu" or not array.size:
        raise InputError(
            path, "numbers", f"{array.dtype} {array.shape}", "Write a numeric array with data."
        )
    return array.astype(np.float64)


def _names(names: Sequence[str], count: int, path: str) -> tuple[str, ...]:
    """Check that there is one name a column, each plain text, none empty and none twice."""
    names = tuple(str(name) for name in names)
    if len(names) != count or not names:
        raise InputError(path, f"{count} names", f"{len(names)}", "Give one name a column.")
    doubled = [name for name, count in Counter(names).items() if count > 1]
    if doubled or "" in names:
        found = f"{doubled[0]!r} twice" if doubled else "an empty name"
        raise InputError(path, "names that are all different", found, "Rename one of them.")
    for name in names:
        _require_plain(name, path)
    return names


def _require_plain(text: str, path: str) -> None:
    """Refuse text that no file can hold, or that could upset a terminal."""
    if _FORBIDDEN.search(text):
        raise InputError(
            path, "text without control characters", repr(text[:60]), "Write plain text."
        )

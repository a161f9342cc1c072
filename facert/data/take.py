"""Takes: what was recorded of an actor, and the poses of a character in it.

Plain frozen dataclasses. They check themselves when they are made and raise `InputError` naming
the field by its path in the HDF5 layout. Arrays are float64 and read-only: a take can be shared.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from facert.data.arrays import (
    LARGEST,
    BoolArray,
    FloatArray,
    IntArray,
    checked_names,
    float_array,
    frozen,
    require_finite,
    require_plain,
    require_shape,
    require_time,
    set_fields,
)
from facert.errors import InputError

SourceKind = Literal["markers", "weights"]


@dataclass(frozen=True, eq=False)
class Source:
    """The recorded performance of the actor: markers in space, or tracked weights.

    Parameters
    ----------
    values : array, shape (T, M, 3) or (T, D)
        Marker positions in the take's units, or weights. NaN means not observed; a marker with
        one NaN coordinate is not observed at all.
    names : sequence of str, length M or D
        One name a marker or a weight, all different.
    std : array, shape of the values, optional
        Standard deviation of a cleaned source; NaN where there is none.

    Raises
    ------
    InputError
        For wrong shapes, doubled names, infinite values, or a source without any observation.
    """

    values: FloatArray
    names: tuple[str, ...]
    std: FloatArray | None = None

    def __post_init__(self) -> None:
        values = float_array(self.values, "/source")
        if values.ndim not in (2, 3) or (values.ndim == 3 and values.shape[2] != 3):
            fix = "Write markers with three coordinates, or weights as a matrix."
            expected = "markers (T, M, 3) or weights (T, D)"
            raise InputError("/source", expected, f"shape {values.shape}", fix)
        path = "/source/markers" if values.ndim == 3 else "/source/weights"
        names = checked_names(self.names, values.shape[1], "/source/names")
        if np.isinf(values).any():
            expected = "finite numbers, or NaN for what was not observed"
            raise InputError(path, expected, "infinite values", "Replace them by NaN.")
        if values.ndim == 3:
            values = _whole_markers(values)
        if np.isnan(values).all():
            found = "NaN or invalid everywhere"
            raise InputError(path, "at least one observed value", found, "Check the export.")
        if self.std is not None:
            frozen(self.std)
        set_fields(self, values=frozen(values), names=names)

    @property
    def valid(self) -> BoolArray:
        """Mask of what was observed, (T, M) or (T, D)."""
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

    def with_matrix(self, matrix: FloatArray, std: FloatArray | None = None) -> Source:
        """A source with the same names and new values, (T, D), and their uncertainty."""
        shape = (len(matrix), *self.values.shape[1:])
        spread = None if std is None else std.reshape(shape)
        return Source(matrix.reshape(shape), self.names, spread)

    def followed_by(self, others: Sequence[Source]) -> Source:
        """The frames of this source and, after them, those of others with the same names."""
        if not others:
            return self
        return Source(np.concatenate([self.values, *(one.values for one in others)]), self.names)


def _whole_markers(values: FloatArray) -> FloatArray:
    """Positions (T, M, 3) of which none is known in part, copied only where one was."""
    hidden = np.isnan(values)
    in_part = hidden.any(axis=2) & ~hidden.all(axis=2)
    if in_part.any():
        values = values.copy()
        values[in_part] = np.nan
    return values


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
        names = checked_names(self.names, len(self.names), "/target/names")
        set_fields(self, names=names)
        if self.limits is None:
            return
        limits = float_array(self.limits, "/target/limits")
        path, fix = "/target/limits", "Give the lowest and the highest value of each control."
        require_shape(limits.shape, (len(names), 2), path, fix)
        low, high = limits.T
        if not (low <= high).all():
            raise InputError(path, "low <= high", "low > high or NaN", fix)
        if (low > LARGEST).any() or (high < -LARGEST).any():
            expected, found = "limits with a pose between them", "both as good as infinite"
            raise InputError(path, expected, found, fix)
        set_fields(self, limits=frozen(limits))


@dataclass(frozen=True, eq=False)
class Corrections:
    """Poses that somebody set in a result of retargeting, and what the result was without them.

    Parameters
    ----------
    frames : array of int, shape (c,)
        The corrected frames, rising.
    params : array, shape (c, P)
        Their poses.
    width : array, shape (c,), or one number
        Seconds that the window of each is wide over which its correction fades, half before it and
        half after it.
    predicted, std : array, shape (T, P), optional
        Poses of the result without corrections, and their standard deviations where there are any;
        `facert.data.corrections` fills them in.

    Raises
    ------
    InputError
        When shapes disagree, frames do not rise, or a number is not finite.
    """

    frames: IntArray
    params: FloatArray
    width: FloatArray
    predicted: FloatArray | None = None
    std: FloatArray | None = None

    def __post_init__(self) -> None:
        frames = np.array(self.frames)
        path, fix = "/corrections/frames", "Number each corrected frame from 0."
        if frames.ndim != 1 or not frames.size or frames.dtype.kind not in "iu":
            found = f"{frames.dtype} {frames.shape}"
            raise InputError(path, "a number a corrected frame", found, fix)
        if (np.diff(frames) <= 0).any() or frames[0] < 0:
            raise InputError(path, "rising numbers from 0", "others", fix)
        count = len(frames)
        params = float_array(self.params, "/corrections/params")
        layout, fix = (count, "P"), "Give a whole pose a corrected frame."
        require_shape(params.shape, layout, "/corrections/params", fix)
        require_finite(params, "/corrections/params")
        width = float_array(self.width, "/corrections/width")
        width = np.full(count, width) if width.ndim == 0 else width
        require_shape(width.shape, (count,), "/corrections/width", "Give each correction a width.")
        if not (np.isfinite(width) & (width >= 0.0)).all():
            fix = "Give each correction a width."
            raise InputError("/corrections/width", "seconds from 0", "others", fix)
        set_fields(self, frames=frozen(frames.astype(np.int64)), params=frozen(params))
        set_fields(self, width=frozen(width))

    def of_controls(self, columns: IntArray) -> Corrections:
        """The corrections with the controls in these columns, in their order."""
        return self.mapped(lambda poses: poses[:, columns])

    def mapped(self, change: Callable[[FloatArray], FloatArray]) -> Corrections:
        """The corrections with all poses, (n, P), changed alike to those of other controls."""
        predicted, std = (
            None if poses is None else change(poses) for poses in (self.predicted, self.std)
        )
        return replace(self, params=change(self.params), predicted=predicted, std=std)

    def require_fit(self, shape: tuple[int, ...]) -> None:
        """Check that these are corrections of a take with poses of this shape, (T, P)."""
        fix = "Correct the result that these corrections are of."
        if self.frames[-1] >= shape[0]:
            expected, found = f"frames up to {shape[0] - 1}", f"{self.frames[-1]}"
            raise InputError("/corrections/frames", expected, found, fix)
        require_shape(self.params.shape[1:], shape[1:], "/corrections/params", fix)


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
        Predictive standard deviation of ``params``, when a method wrote them. A pose without one,
        a row of NaN, is somebody's.
    animation : array, shape (n, P), optional
        Poses of the character without a source frame.
    fps : float
        Nominal frames a second.
    units : str
        Unit of the marker positions, e.g. ``"cm"``; empty when unknown.
    start_timecode, up_axis : str
        As recorded; empty when unknown.
    created_by, model : str
        The program that wrote the file; the model that predicted the poses. Empty when unknown.
    clock_start : float
        Seconds on the recorder's clock that are 0 in `time`; 0 where `time` is that clock.
    corrections : Corrections, optional
        Which poses of a result somebody corrected; ``params`` hold them.

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
    clock_start: float = 0.0
    corrections: Corrections | None = None
    model: str = ""

    def __post_init__(self) -> None:
        time = float_array(self.time, "/time")
        frames = len(self.source.values)
        require_time(time, frames, self.fps)
        for name in ("units", "start_timecode", "up_axis", "created_by", "model"):
            require_plain(getattr(self, name), f"attribute {name}")
        if not np.isfinite(self.clock_start):
            expected, found = "seconds on the recorder's clock", f"{self.clock_start}"
            raise InputError("attribute clock_start", expected, found, "Correct or remove it.")
        set_fields(self, time=frozen(time))
        for name in ("params", "std"):
            path = f"/target/{name}"
            set_fields(self, **{name: self._poses(getattr(self, name), path, frames)})
        animation = self._poses(self.animation, "/animation/params", None)
        set_fields(self, animation=animation, corrections=self._checked_corrections())

    def _checked_corrections(self) -> Corrections | None:
        """The corrections, with what was predicted checked as the poses are."""
        found = self.corrections
        if found is None:
            return None
        found.require_fit((0, 0) if self.params is None else self.params.shape)
        predicted = self._poses(found.predicted, "/corrections/predicted", len(self))
        return replace(
            found, predicted=predicted, std=self._poses(found.std, "/corrections/std", len(self))
        )

    def _poses(self, value: FloatArray | None, path: str, rows: int | None) -> FloatArray | None:
        """Check one of the pose matrices and return it as float64."""
        if value is None:
            return None
        if self.controls is None:
            fix = "Write /target/names (P,)."
            raise InputError("/target/names", "the controls' names", "none", fix)
        poses = float_array(value, path)
        expected = ("n" if rows is None else rows, len(self.controls.names))
        require_shape(poses.shape, expected, path, "Give a row a frame and a column a control.")
        known = ~np.isnan(poses)
        partial = np.flatnonzero(known.any(axis=1) & ~known.all(axis=1))
        if np.isinf(poses).any() or len(partial) or (rows is None and not known.all()):
            row = f"row {partial[0]} known in part" if len(partial) else "infinite or NaN values"
            whole = "whole finite poses (a row of NaN where a frame has none)"
            raise InputError(path, whole, row, "Pose every control of the frame, or none.")
        return frozen(poses)

    def __len__(self) -> int:
        """Number of frames T."""
        return len(self.time)

    def with_poses(self, controls: Controls | None, params: FloatArray | None) -> Take:
        """The take with these poses, (T, P), that somebody set, in place of those that it has."""
        return replace(self, controls=controls, params=params, std=None, corrections=None, model="")

    def with_controls(self, controls: Controls, rows: Callable[[FloatArray], FloatArray]) -> Take:
        """The take with all its poses, (n, P), brought to other controls by a function of them."""
        corrections = None if self.corrections is None else self.corrections.mapped(rows)
        params, std, animation = (
            None if poses is None else rows(poses)
            for poses in (self.params, self.std, self.animation)
        )
        return replace(
            self,
            controls=controls,
            params=params,
            std=std,
            animation=animation,
            corrections=corrections,
        )

    @property
    def labels(self) -> IntArray:
        """Indices of the frames whose pose is known."""
        if self.params is None:
            return np.empty(0, dtype=np.int64)
        return np.flatnonzero(~np.isnan(self.params[:, 0])).astype(np.int64)


def named_columns(take: Take) -> tuple[tuple[str, ...], FloatArray]:
    """Names and numbers (T, P) of the poses; of the source weights; or of markers, three each."""
    if take.controls is not None and take.params is not None:
        return take.controls.names, take.params
    if take.source.kind == "weights":
        return take.source.names, take.source.values
    names = tuple(f"{name}.{axis}" for name in take.source.names for axis in "xyz")
    return names, take.source.matrix


def named_curves(take: Take) -> tuple[tuple[str, ...], FloatArray]:
    """Names and numbers (T, P) of the poses, or of the source weights.

    Raises `InputError` when there are only markers.
    """
    if take.params is None and take.source.kind == "markers":
        expected, fix = "poses or source weights", "Retarget it first, or write a .csv or .h5 file."
        raise InputError("/target/params", expected, "markers only", fix)
    return named_columns(take)

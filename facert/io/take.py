"""Take files: facert's own HDF5 layout for a performance.

==================  =====================  =========================================================
``/time``           (T,)                   seconds, rising
``/source/markers`` (T, M, 3)              positions; or ``/source/weights`` (T, D)
``/source/names``   (M,) or (D,)           UTF-8
``/source/valid``   (T, M) or (T, D) bool  optional; False, like NaN: not observed
``/source/std``     like the source        optional: standard deviation of a cleaned source
``/source/filled``  (T, M) or (T, D) bool  optional: what cleaning filled in
``/source/head``    (T, 4, 4)              optional: the motion that was removed, see `stabilise`
``/target/params``  (T, P)                 optional; a row of NaN: this frame has no pose
``/target/names``   (P,)                   UTF-8
``/target/limits``  (P, 2)                 optional
``/target/std``     (T, P)                 optional: predictive standard deviation of the params
``/animation/params`` (n, P)               optional: poses without a source frame
``/corrections/``                          optional: which poses of a result somebody corrected
``  frames``          (c,) int             the frames; ``/target/params`` has their poses
``  width``           (c,)                 seconds from the beginning of their windows to the end
``  predicted``       (T, P)               optional: the poses without corrections
``  std``             (T, P)               optional: their standard deviation
attributes                                 format, format_version, fps, units, created_by,
                                           optional start_timecode, up_axis, clock_start, model
==================  =====================  =========================================================

``/source/std``, ``/source/filled`` and ``/source/head``, and the verdict of `facert.io.verdict`,
are written beside a take for who looks for them, as is ``/recorded/``, the source of a result
before it was cleaned, for who learns from its corrections; reading passes over these and over
anything else that it does not know.

A file with corrections has format version 2, any other 1: who does not know of corrections would
take predicted poses for somebody's.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from facert.data.arrays import BoolArray, FloatArray, frozen, require_shape
from facert.data.take import Controls, Corrections, Source, Take
from facert.errors import InputError
from facert.io.guarded import parsing
from facert.io.hdf5 import (
    TAKE_FORMAT,
    GuardedFile,
    NewFile,
    create,
    open_guarded,
    stated_format,
)
from facert.io.registry import OWN_ENDINGS

Beside = Mapping[str, NDArray[Any] | tuple[str, ...]]
"""Arrays, and lists of text, by their paths in a file."""
VERSION = 2
_WITHOUT_CORRECTIONS = 1
_LOOKED_AT = 2**18  # numbers of poses that show what a take is


def read_take(path: Path) -> Take:
    """Read a take file, written by facert or by any other program that keeps to the layout.

    Raises `InputError` naming the file and the HDF5 path that is at fault.
    """
    with open_guarded(path) as file:
        file.require_format(TAKE_FORMAT, VERSION)
        params = _frozen(file, "/target/params")
        return Take(
            time=file.numbers("/time"),
            source=_read_source(file),
            controls=read_controls(file),
            params=params,
            std=_frozen(file, "/target/std"),
            animation=_frozen(file, "/animation/params"),
            fps=file.number_attribute("fps"),
            units=file.text_attribute("units"),
            start_timecode=file.text_attribute("start_timecode"),
            up_axis=file.text_attribute("up_axis"),
            created_by=file.text_attribute("created_by"),
            model=file.text_attribute("model"),
            clock_start=file.number_attribute("clock_start", 0.0),
            corrections=None if params is None else _read_corrections(file, params),
        )


def holds_result(path: Path) -> bool:
    """Whether a file is a take all of whose poses were predicted, as far as its beginning shows."""
    poses = _first_poses(path)
    return poses is not None and poses.predicted and not poses.open


def holds_recording(path: Path) -> bool:
    """Whether a file is a take with frames that have no pose, as far as its beginning shows."""
    poses = _first_poses(path)
    return poses is not None and poses.open and not poses.predicted


def beside_recording(source: Source) -> Beside:
    """What `write_take` is to write beside a result: its source as it was recorded."""
    return {f"/recorded/{source.kind}": source.values, "/recorded/names": source.names}


def with_recording(take: Take, path: Path) -> Take:
    """A take that was read from a file, with its source as recorded where the file keeps that.

    Raises `InputError` when it is damaged, or of other frames.
    """
    if path.suffix.lower() not in OWN_ENDINGS or stated_format(path) != TAKE_FORMAT:
        return take
    with open_guarded(path) as file:
        if "/recorded/names" not in file:
            return take
        source = _read_source(file, "/recorded")
        fix = "Retarget the recording again."
        require_shape(source.values.shape[:1], (len(take),), f"/recorded/{source.kind}", fix)
        return replace(take, source=source)


def holds_corrections(path: Path) -> bool:
    """Whether a file is a take with corrections; they are not read."""
    if stated_format(path) != TAKE_FORMAT:
        return False
    with open_guarded(path) as file:
        return "/corrections/frames" in file


class _Poses(NamedTuple):
    """Poses of the first frames of a take."""

    predicted: bool
    """Whether they have a standard deviation."""
    open: bool
    """Whether any of the frames has none."""


def _first_poses(path: Path) -> _Poses | None:
    """The poses of the first frames of a take; None for any other file."""
    with suppress(InputError), parsing("file", "a take"):
        if stated_format(path) != TAKE_FORMAT:
            return None
        with open_guarded(path) as file:
            if "/target/params" not in file:
                return _Poses(predicted=False, open=True)
            rows = file.rows("/target/params")
            count = max(1, min(rows.shape[0], _LOOKED_AT // max(1, rows.shape[1])))
            unposed = np.isnan(rows.read(np.arange(count))).all(axis=1)
            return _Poses("/target/std" in file, bool(unposed.any()))
    return None


def write_take(
    take: Take,
    path: Path,
    overwrite: bool = False,
    beside: Beside = MappingProxyType({}),
) -> None:
    """Write a take file; the same take gives the same bytes.

    `beside` has further arrays and texts by their path in the file, which reading passes over.

    Raises `OutputExistsError` when `path` exists and `overwrite` is not set.
    """
    version = _WITHOUT_CORRECTIONS if take.corrections is None else VERSION
    with create(path, TAKE_FORMAT, version, overwrite) as file:
        file.attribute("fps", take.fps)
        file.attribute("units", take.units)
        file.attribute("start_timecode", take.start_timecode)
        file.attribute("up_axis", take.up_axis)
        file.attribute("model", take.model)
        file.attribute("clock_start", take.clock_start or "")
        file.array("/time", take.time)
        _write_source(file, take.source)
        _write_target(file, take)
        _write_corrections(file, take.corrections)
        for where, values in beside.items():
            if isinstance(values, tuple):
                file.names(where, values)
            else:
                file.array(where, values)


def _read_source(file: GuardedFile, root: str = "/source") -> Source:
    kinds = [kind for kind in ("markers", "weights") if f"{root}/{kind}" in file]
    if len(kinds) != 1:
        expected, found = f"either {root}/markers or {root}/weights", " and ".join(kinds)
        raise InputError(root, expected, found or "none of them", "Write one of the two.")
    path = f"{root}/{kinds[0]}"
    values = file.numbers(path)
    layout = ("T", "M", "3") if kinds[0] == "markers" else ("T", "D")
    require_shape(values.shape, layout, path, "Write one row a frame.")
    valid = read_valid(file, values.shape, root)
    if valid is not None:
        values[~valid] = np.nan
    return Source(frozen(values), file.names(f"{root}/names"))


def read_valid(
    file: GuardedFile, shape: tuple[int, ...], root: str = "/source"
) -> BoolArray | None:
    """The flags of a source of some shape, False for what was not observed, where there are any."""
    path = f"{root}/valid"
    if path not in file:
        return None
    valid = file.flags(path)
    require_shape(valid.shape, shape[:2], path, "Give one flag a frame and marker or weight.")
    return valid


def _frozen(file: GuardedFile, path: str) -> FloatArray | None:
    """The numbers at a path, if there are any, for a take to hold as they are."""
    found = file.optional(path)
    return None if found is None else frozen(found)


def read_controls(file: GuardedFile) -> Controls | None:
    """Read the character's controls, if there are any."""
    if "/target/names" not in file:
        return None
    return Controls(file.names("/target/names"), file.optional("/target/limits"))


def _read_corrections(file: GuardedFile, params: FloatArray) -> Corrections | None:
    """The corrections among poses (T, P)."""
    if "/corrections/frames" not in file:
        return None
    frames = file.integers("/corrections/frames")
    width, predicted = file.numbers("/corrections/width"), file.optional("/corrections/predicted")
    inside = (frames >= 0) & (frames < len(params))
    if params.ndim != 2 or not inside.all():
        expected, fix = f"frames of the take, 0 to {len(params) - 1}", "Correct the result anew."
        raise InputError("/corrections/frames", expected, "others", fix)
    std = file.optional("/corrections/std")
    return Corrections(frames, params[frames], width, predicted, std)


def _write_corrections(file: NewFile, corrections: Corrections | None) -> None:
    if corrections is not None:
        for name in ("frames", "width", "predicted", "std"):
            file.array(f"/corrections/{name}", getattr(corrections, name))


def _write_source(file: NewFile, source: Source) -> None:
    file.array(f"/source/{source.kind}", source.values)
    file.names("/source/names", source.names)
    file.array("/source/valid", None if source.valid.all() else source.valid)
    file.array("/source/std", source.std)


def _write_target(file: NewFile, take: Take) -> None:
    if take.controls is None:
        return
    file.names("/target/names", take.controls.names)
    file.array("/target/limits", take.controls.limits)
    file.array("/target/params", take.params)
    file.array("/target/std", take.std)
    file.array("/animation/params", take.animation)

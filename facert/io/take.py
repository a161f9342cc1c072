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
attributes                                 format, format_version, fps, units, created_by,
                                           optional start_timecode, up_axis
==================  =====================  =========================================================

``/source/std``, ``/source/filled`` and ``/source/head`` are written beside a take for who looks for
them; reading passes over these and over anything else that it does not know.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from facert.data.arrays import require_shape
from facert.data.take import Controls, Source, Take
from facert.errors import InputError
from facert.io.hdf5 import TAKE_FORMAT, GuardedFile, NewFile, create, open_guarded

VERSION = 1


def read_take(path: Path) -> Take:
    """Read a take file, written by facert or by any other program that keeps to the layout.

    Raises `InputError` naming the file and the HDF5 path that is at fault.
    """
    with open_guarded(path) as file:
        file.require_format(TAKE_FORMAT, VERSION)
        return Take(
            time=file.numbers("/time"),
            source=_read_source(file),
            controls=_read_controls(file),
            params=file.optional("/target/params"),
            std=file.optional("/target/std"),
            animation=file.optional("/animation/params"),
            fps=file.number_attribute("fps"),
            units=file.text_attribute("units"),
            start_timecode=file.text_attribute("start_timecode"),
            up_axis=file.text_attribute("up_axis"),
            created_by=file.text_attribute("created_by"),
        )


def write_take(
    take: Take,
    path: Path,
    overwrite: bool = False,
    beside: Mapping[str, NDArray[Any]] = MappingProxyType({}),
) -> None:
    """Write a take file; the same take gives the same bytes.

    `beside` has further arrays by their path in the file, which reading passes over.

    Raises `OutputExistsError` when `path` exists and `overwrite` is not set.
    """
    with create(path, TAKE_FORMAT, VERSION, overwrite) as file:
        file.attribute("fps", take.fps)
        file.attribute("units", take.units)
        file.attribute("start_timecode", take.start_timecode)
        file.attribute("up_axis", take.up_axis)
        file.array("/time", take.time)
        _write_source(file, take.source)
        _write_target(file, take)
        for where, values in beside.items():
            file.array(where, values)


def _read_source(file: GuardedFile) -> Source:
    kinds = [kind for kind in ("markers", "weights") if f"/source/{kind}" in file]
    if len(kinds) != 1:
        expected, found = "either /source/markers or /source/weights", " and ".join(kinds)
        raise InputError("/source", expected, found or "none of them", "Write one of the two.")
    path = f"/source/{kinds[0]}"
    values = file.numbers(path)
    layout = ("T", "M", "3") if kinds[0] == "markers" else ("T", "D")
    require_shape(values.shape, layout, path, "Write one row a frame.")
    if "/source/valid" in file:  # False: not observed
        valid, fix = file.flags("/source/valid"), "Give one flag a frame and marker or weight."
        require_shape(valid.shape, values.shape[:2], "/source/valid", fix)
        values[~valid] = np.nan
    return Source(values, file.names("/source/names"))


def _read_controls(file: GuardedFile) -> Controls | None:
    if "/target/names" not in file:
        return None
    return Controls(file.names("/target/names"), file.optional("/target/limits"))


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

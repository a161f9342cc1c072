"""Types of arrays, and the checks that the nouns make of what they are given."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from facert.errors import InputError

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int64]

MAX_NAMES = 2**14
"""Most markers, weights or controls: no recording of a face has so many."""
LATEST = 1e20
"""Seconds from 0 to a frame, at most: nanoseconds of a calendar, taken for seconds, are less."""
RATES = (1e-15, 1e15)
"""Frames a second, between which a rate lies."""
LARGEST = 1e15
"""No coordinate of a mesh is larger, in whatever unit: products of four are numbers still."""
SMALLEST = 1e-100
"""In a unit in which all is smaller, squares are nothing."""

_Scalar = TypeVar("_Scalar", bound=np.generic)

# HDF5 cannot hold NUL, UTF-8 no half of a pair; control characters and line ends upset a terminal.
_FORBIDDEN = re.compile(r"[\x00-\x1f\x7f-\x9f\u2028\u2029\ud800-\udfff]")


def set_fields(instance: object, **values: object) -> None:
    """Set fields of a frozen dataclass while it is being made."""
    for name, value in values.items():
        object.__setattr__(instance, name, value)


def frozen(array: NDArray[_Scalar]) -> NDArray[_Scalar]:
    """Make an array read-only, and return it."""
    array.setflags(write=False)
    return array


def float_array(value: ArrayLike, path: str) -> FloatArray:
    """A float64 array that may be frozen: the caller's where it is so already, else a copy."""
    array = np.asarray(value)
    if array.dtype.kind not in "fiu" or not array.size:
        raise InputError(
            path, "numbers", f"{array.dtype} {array.shape}", "Write a numeric array with data."
        )
    return array if array.dtype == np.float64 and is_frozen(array) else array.astype(np.float64)


def is_frozen(array: NDArray[Any]) -> bool:
    """Whether an array, or another view of all of it, was made read-only: nobody changes it."""
    owner = array if array.base is None else array.base
    whole = isinstance(owner, np.ndarray) and owner.flags.owndata and owner.nbytes == array.nbytes
    return whole and not (owner.flags.writeable or array.flags.writeable)


def require_shape(
    shape: tuple[int, ...], expected: tuple[int | str, ...], path: str, fix: str
) -> None:
    """Check the shape of an array; a letter stands for any size."""
    sizes = zip(shape, expected, strict=False)
    if len(shape) != len(expected) or any(s != e for s, e in sizes if isinstance(e, int)):
        layout = f"({', '.join(map(str, expected))})"
        whole = all(isinstance(size, int) for size in expected)
        raise InputError(path, f"shape {layout}" if whole else layout, f"shape {shape}", fix)


def require_finite(array: FloatArray, path: str, fix: str = "Check the export.") -> None:
    """Refuse NaN and infinity."""
    if not np.isfinite(array).all():
        raise InputError(path, "finite numbers", "NaN or infinity", fix)


def require_time(time: FloatArray, frames: int, fps: float) -> None:
    """Check the seconds of the frames and the nominal frame rate."""
    if time.shape != (frames,):
        found, fix = f"shape {time.shape}", "Give one time a frame."
        raise InputError("/time", f"{frames} seconds", found, fix)
    if not np.isfinite(time).all() or (np.diff(time) <= 0).any():
        expected, found = "finite, strictly rising seconds", "a step back, a repeat or NaN"
        raise InputError("/time", expected, found, "Sort the frames by time and drop repeats.")
    if np.abs(time).max(initial=0.0) > LATEST:
        found = f"up to {np.abs(time).max():.1e}"
        fix = "Check the clock, and its unit."
        raise InputError("/time", f"seconds up to {LATEST:g}", found, fix)
    if not (np.isfinite(fps) and fps > 0):
        raise InputError("fps", "a positive number", f"{fps}", "Set the frame rate.")
    if not RATES[0] <= fps <= RATES[1]:
        expected = f"a rate between {RATES[0]:g} and {RATES[1]:g}"
        raise InputError("fps", expected, f"{fps:g}", "Set the frame rate.")


def require_sensible(array: FloatArray, path: str) -> None:
    """Refuse numbers that are not finite, or so large that their squares might not be."""
    require_finite(array, path)
    require_bounded(array, path)


def require_bounded(array: FloatArray, path: str) -> None:
    """Refuse numbers so large that their squares might not be finite; NaN is none of them."""
    most = max(np.fmax.reduce(array, None, initial=0.0), -np.fmin.reduce(array, None, initial=0.0))
    if most > LARGEST:
        raise InputError(path, "numbers of a sensible size", f"{most:.1e}", "Check the units.")


def require_size(array: FloatArray, path: str) -> None:
    """Refuse numbers in a unit so large or small that nothing can be computed; 0 is in any unit."""
    require_bounded(array, path)
    most = max(np.fmax.reduce(array, None, initial=0.0), -np.fmin.reduce(array, None, initial=0.0))
    if 0.0 < most < SMALLEST:
        found = f"up to {most:.1e}"
        raise InputError(path, "numbers of a sensible size", found, "Check the units.")


def single_precision(array: FloatArray, path: str) -> NDArray[np.float32]:
    """Numbers as float32, in which other programs keep characters.

    Raises `InputError` when one is too large for it.
    """
    with np.errstate(over="ignore"):
        single = array.astype(np.float32)
    if np.isinf(single).any():
        found = f"up to {np.abs(array).max():.1e}"
        raise InputError(path, "numbers that float32 can hold", found, "Check the units.")
    return single


def checked_colours(value: ArrayLike | None, vertices: int) -> FloatArray | None:
    """Colours (V, 3) of a mesh's vertices, if there are any."""
    if value is None:
        return None
    colours = float_array(value, "/colours")
    fix = "Give red, green and blue of every vertex, or leave the colours out."
    require_shape(colours.shape, (vertices, 3), "/colours", fix)
    if not ((colours >= 0) & (colours <= 1)).all():
        raise InputError("/colours", "numbers between 0 and 1", "others", fix)
    return frozen(colours)


def checked_names(names: Sequence[str], count: int, path: str) -> tuple[str, ...]:
    """Check that there is one name a column, each plain text, none empty and none twice."""
    if len(names) > MAX_NAMES:
        found, fix = f"{len(names)}", "Leave out what is not of the face."
        raise InputError(path, f"at most {MAX_NAMES} names", found, fix)
    names = tuple(str(name) for name in names)
    if len(names) != count or not names:
        raise InputError(path, f"{count} names", f"{len(names)}", "Give one name a column.")
    doubled = [name for name, count in Counter(names).items() if count > 1]
    if doubled or "" in names:
        found = f"{doubled[0]!r} twice" if doubled else "an empty name"
        raise InputError(path, "names that are all different", found, "Rename one of them.")
    for name in names:
        require_plain(name, path)
    return names


def require_plain(text: str, path: str) -> None:
    """Refuse text that no file can hold, or that could upset a terminal."""
    if _FORBIDDEN.search(text):
        raise InputError(
            path, "text without control characters", repr(text[:60]), "Write plain text."
        )


def lengths(vectors: FloatArray) -> FloatArray:
    """Lengths of vectors (..., 3)."""
    x, y, z = np.moveaxis(vectors, -1, 0)
    squares = x * x
    squares += y * y
    squares += z * z
    return np.asarray(np.sqrt(squares, out=squares))


def rms(errors: FloatArray) -> float:
    """Root mean square over all elements, the papers' error measure."""
    return float(np.sqrt(np.mean(np.square(errors))))

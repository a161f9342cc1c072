"""Units of length and the axis that points up: converted, never guessed."""

from __future__ import annotations

import logging
from dataclasses import replace

import numpy as np

from facert.data.arrays import FloatArray
from facert.data.rig import Rig
from facert.data.take import Take
from facert.errors import InputError

log = logging.getLogger("facert")

METRES = {"m": 1.0, "dm": 0.1, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}
"""How many metres a unit is."""

_SPELLINGS = {
    "meter": "m", "meters": "m", "metre": "m", "metres": "m",
    "centimeter": "cm", "centimeters": "cm", "centimetre": "cm", "centimetres": "cm",
    "millimeter": "mm", "millimeters": "mm", "millimetre": "mm", "millimetres": "mm",
    "inch": "in", "inches": "in", "foot": "ft", "feet": "ft",
}  # fmt: skip

# What the coordinates of a y-up frame are in each, as a rotation (a right hand stays one).
_FROM_Y = {
    "x": np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]]),
    "y": np.eye(3),
    "z": np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]),
}


def with_units(found: Take | Rig, units: str) -> Take | Rig:
    """A take or rig with its positions converted to another unit.

    Where the file does not state its unit, the numbers are taken to be in `units` already, with a
    line in the log.

    Raises `InputError` for an unknown unit, of the file or asked for.
    """
    wanted = checked_unit(units, "--units")
    if not found.units:
        log.info("the file does not say its unit: it is taken to be %s", wanted)
        return replace(found, units=wanted)
    factor = METRES[checked_unit(found.units, "units")] / METRES[wanted]
    return replace(_moved(found, factor * np.eye(3)), units=wanted)


def with_up_axis(found: Take | Rig, up_axis: str, present: str) -> Take | Rig:
    """A take or rig turned so that `up_axis` points up, from a frame where `present` does.

    From z to y, (x, y, z) becomes (x, z, -y). Where `present` is empty, the positions are taken
    to stand so already, with a line in the log.

    Raises `InputError` for an axis other than x, y, z.
    """
    wanted = checked_axis(up_axis, "--up-axis")
    if not present:
        log.info("the file does not say its up axis: it is taken to be %s", wanted)
        turn = np.eye(3)
    else:
        turn = _FROM_Y[wanted] @ _FROM_Y[checked_axis(present, "up_axis")].T
    moved = _moved(found, turn)
    return moved if isinstance(moved, Rig) else replace(moved, up_axis=wanted)


def in_metres(units: str) -> float | None:
    """Length in metres of a unit in any spelling; None for an unknown one, or none."""
    short = units.strip().lower()
    return METRES.get(_SPELLINGS.get(short, short))


def checked_unit(name: str, field: str) -> str:
    """The short name of a unit in any spelling.

    Raises `InputError` naming `field`, for a unit that is not known.
    """
    short = _SPELLINGS.get(name.strip().lower(), name.strip().lower())
    if short not in METRES:
        fix = "Choose one of these; --in-units overrides a file."
        raise InputError(field, ", ".join(METRES), repr(name), fix)
    return short


def checked_axis(name: str, field: str) -> str:
    """``"x"``, ``"y"`` or ``"z"``.

    Raises `InputError` naming `field`, for anything else.
    """
    axis = name.strip().lower().removeprefix("+")
    if axis not in _FROM_Y:
        raise InputError(
            field, "x, y or z", repr(name), "Choose one of these; --in-up-axis overrides a file."
        )
    return axis


def _moved(found: Take | Rig, matrix: FloatArray) -> Take | Rig:
    """Positions times a matrix that mixes no axes; weights have no place."""
    if isinstance(found, Rig):
        body, driven = found.body, found.driven
        return replace(
            found,
            neutral=found.neutral @ matrix.T,
            shapes=found.shapes @ matrix.T,
            body=None if body is None else replace(body, vertices=body.vertices @ matrix.T),
            driven=None if driven is None else driven.transformed(matrix),
        )
    source = found.source
    if source.kind == "weights":
        return found
    std = None if source.std is None else source.std @ np.abs(matrix).T
    return replace(found, source=replace(source, values=source.values @ matrix.T, std=std))

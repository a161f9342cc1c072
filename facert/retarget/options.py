"""Options of cleaning a source before it is mapped, and adjustments of single controls after."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from facert.data.arrays import FloatArray
from facert.data.names import fitting_some, nearest
from facert.data.normalisation import Normalisation
from facert.errors import InputError
from facert.preprocess.clean_source import SourceOptions

LARGEST = 1e6
"""Beyond, a gain or a limit is a slip of the pen."""
ENTRIES = ("gain", "limits", "smoothing")
ROUNDING = 1e-14
"""Of a bound and the mean pose: what units may change in a pose on its way there and back."""
FAR = 1e100
"""As good as infinite."""


@dataclass(frozen=True, eq=False)
class Adjustments:
    """Gain, limits and smoothing of every control of a character.

    Parameters
    ----------
    gain : array, shape (P,)
        Values are multiplied by it.
    limits : array, shape (P, 2)
        Then clipped to these; infinite where nothing is clipped.
    smoothing : array, shape (P,)
        From 0, a control follows the measured source, to 1, it follows the cleaned one.
    """

    gain: FloatArray
    limits: FloatArray
    smoothing: FloatArray

    @classmethod
    def none(cls, controls: int) -> Adjustments:
        """Adjustments that change nothing."""
        return cls(np.ones(controls), np.tile([-np.inf, np.inf], (controls, 1)), np.ones(controls))

    @classmethod
    def of(cls, tables: Mapping[str, Any], names: Sequence[str]) -> Adjustments:
        """Adjustments from a table for each control, as in a TOML file.

        Parameters
        ----------
        tables : mapping
            ``{"jawOpen": {"gain": 1.1, "limits": [0.0, 0.9], "smoothing": 0.5}}``; a name may
            have wildcards, ``"eyeBlink*"``. A later table overrides an earlier one.
        names : sequence of str
            Names of the character's controls.

        Raises
        ------
        InputError
            For unknown names or entries, and values that make no sense.
        """
        made = cls.none(len(names))
        for name, table in tables.items():
            if not isinstance(table, Mapping):
                raise InputError(name, "a table such as [jawOpen]", repr(table), "Write a table.")
            unknown = [entry for entry in table if entry not in ENTRIES]
            if unknown:
                expected = "one of " + ", ".join(ENTRIES)
                near = nearest(unknown[0], ENTRIES)
                fix = f"Did you mean {near}?" if near else "Remove it."
                raise InputError(f"{name}.{unknown[0]}", expected, "another entry", fix)
            columns = fitting_some(name, names, name)
            if "gain" in table:
                made.gain[columns] = _number(name, table, "gain", -LARGEST, LARGEST)
            if "limits" in table:
                made.limits[columns] = _limits(name, table)
            if "smoothing" in table:
                made.smoothing[columns] = _number(name, table, "smoothing", 0.0, 1.0)
        return made

    @property
    def smooth_all(self) -> bool:
        """Whether every control follows the cleaned source alone."""
        return bool((self.smoothing == 1.0).all())

    def mixed(self, smooth: FloatArray, rough: FloatArray) -> FloatArray:
        """Poses between those of the cleaned and of the measured source, (T, P) each."""
        return np.asarray(self.smoothing * smooth + (1.0 - self.smoothing) * rough)


@dataclass(frozen=True)
class RetargetOptions(SourceOptions):
    """Options of retargeting a take, whatever the model: those of its source, and of controls.

    Parameters
    ----------
    adjustments : Adjustments, optional
        Adjustments of single controls.
    """

    adjustments: Adjustments | None = None


AS_IT_IS = RetargetOptions(detect=False, smooth=False)
"""Every frame on its own, as it was measured."""


class PoseScale:
    """The map from normalised poses to a character's controls, of one frame or of many.

    A pose is brought to the controls' units, clipped to the model's bounds, multiplied by the gain
    and clipped to the limits; with the bounds times the gain, that is one product, one sum and one
    clip. A pose that a method has put at its bound is there again, not a rounding short of it.

    Parameters
    ----------
    units : Normalisation
        Normalisation of the poses.
    bounds : array, shape (P, 2), or None
        What poses are clipped to.
    adjustments : Adjustments
    """

    def __init__(
        self, units: Normalisation, bounds: FloatArray | None, adjustments: Adjustments
    ) -> None:
        gain = adjustments.gain
        self._scale, self._offset = units.scale * gain, units.mean * gain
        self._std_scale = units.scale * np.abs(gain)
        ends = np.tile([[-np.inf], [np.inf]], len(gain)) if bounds is None else bounds.T
        moved = np.where(gain == 0.0, 0.0, ends * np.where(gain == 0.0, 1.0, gain))  # 0 inf is NaN
        self._low, self._high = np.clip(np.sort(moved, axis=0), *adjustments.limits.T)
        self._stretch()

    def params(self, Y: FloatArray) -> FloatArray:
        """Values of the controls from normalised poses, (T, P) or (P,)."""
        params = Y * self._scale
        params += self._offset
        np.maximum(params, self._low, out=params)
        np.minimum(params, self._high, out=params)
        return params

    def _stretch(self) -> None:
        """Widen the poses about the middle by a rounding, so that what is at a bound is cut."""
        ends = np.stack([self._low, self._high])
        size = np.abs(np.where(np.isfinite(ends), ends, 0.0)).max(axis=0) + np.abs(self._offset)
        low, high = np.clip(ends, -FAR, FAR)
        half = np.where(high > low, 0.5 * (high - low), np.inf)
        share = ROUNDING * size / half
        self._offset = self._offset + share * (self._offset - 0.5 * (low + high))
        self._scale = self._scale * (1.0 + share)

    def std(self, std: FloatArray | None) -> FloatArray | None:
        """Standard deviation of poses from that of normalised ones, (T, P) or (P,)."""
        return None if std is None else std * self._std_scale


def _number(name: str, table: Mapping[str, Any], entry: str, low: float, high: float) -> float:
    value = table[entry]
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not low <= value <= high:
        expected = f"a number from {low:g} to {high:g}"
        raise InputError(f"{name}.{entry}", expected, repr(value), "Change it.")
    return float(value)


def _limits(name: str, table: Mapping[str, Any]) -> tuple[float, float]:
    value = table["limits"]
    numbers = isinstance(value, list) and all(
        isinstance(v, (int, float)) and not isinstance(v, bool) and abs(v) <= LARGEST for v in value
    )
    if not numbers or len(value) != 2 or not value[0] <= value[1]:
        raise InputError(f"{name}.limits", "[low, high]", repr(value), "For instance [0.0, 1.0].")
    return float(value[0]), float(value[1])

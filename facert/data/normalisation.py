"""Normalised units: centred, and divided by the largest standard deviation of a dimension.

The paper centres both observation spaces and rescales them by their maximum variance; dividing by
its root makes the largest variance 1, whatever the unit of length. Dimensions keep their relative
size: a marker that hardly moves stays small.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from facert.data.arrays import FloatArray, require_size
from facert.data.blocks import blocks
from facert.errors import InputError

# Less motion than this, relative to the largest coordinate, is rounding.
STILL = 1e-9


def deviation(values: FloatArray) -> FloatArray:
    """Standard deviation of the columns of (n, d), (d,); NaN is passed over."""
    return np.asarray(np.nanstd(values, axis=0) if np.isnan(values).any() else values.std(axis=0))


@dataclass(frozen=True)
class Normalisation:
    """An affine map to normalised units."""

    mean: FloatArray
    """Of each dimension, in the data's units, (d,)."""
    scale: float
    """The largest standard deviation of a dimension, in the data's units."""

    @classmethod
    def of(cls, values: FloatArray, field: str) -> Normalisation:
        """The normalisation of rows (n, d); NaN is passed over.

        Raises `InputError` when nothing varies, or as `facert.data.arrays.require_size` does.
        """
        low, high = np.fmin.reduce(values), np.fmax.reduce(values)
        moves = bool((low < high).any())
        if moves:
            require_size(values, field)
        parts = [values[:, columns] for columns in blocks(values.shape[1], len(values))]
        mean = np.concatenate([np.nanmean(part, axis=0) for part in parts])
        scale = max(float(deviation(part).max()) for part in parts) if moves else 0.0
        if not scale > STILL * max(float(np.nanmax(high)), -float(np.nanmin(low))):
            expected, found = "values that change over the rows", "the same row throughout"
            fix = "Check that the right data was exported."
            if len(values) == 1:
                found, fix = "one row alone", "Give a longer take, or several."
            raise InputError(field, expected, found, fix)
        return cls(mean, scale)

    def seen_from(self, other: Normalisation) -> Normalisation:
        """The map from the units of another normalisation of the same data to these."""
        return Normalisation(other.apply(self.mean), self.scale / other.scale)

    def apply(self, values: FloatArray) -> FloatArray:
        """Values (n, d) in normalised units."""
        normalised = values - self.mean
        normalised /= self.scale
        return normalised

    def undo(self, values: FloatArray) -> FloatArray:
        """Values (n, d) back in the data's units."""
        result = values * self.scale
        result += self.mean
        return result

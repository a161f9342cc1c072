"""Single positions that neither the frames around nor the other markers predict."""

from __future__ import annotations

import numpy as np

from facert.data.arrays import BoolArray, FloatArray
from facert.preprocess.faults.prediction import off_in_space
from facert.preprocess.motion.series import interpolated

ORDINARY, FAR = 0.9, 3.0
"""A spike lies so many times farther off than this share of all positions do."""
SMALL = 0.05
"""Spikes of less than this share of the largest standard deviation of a coordinate are let pass."""
FEWEST = 4
"""With fewer markers the rest of the face predicts too little to find a spike by."""
ROUNDS = 3
"""Large spikes widen the distribution that small ones are judged by: look again without them."""


def single_spikes(markers: FloatArray) -> BoolArray:
    """Mask of positions that neither frames nor markers around them predict, (T, M).

    Parameters
    ----------
    markers : array, shape (T, M, 3)
        NaN: not observed.
    """
    seen = ~np.isnan(markers[:, :, 0])
    spikes = np.zeros_like(seen)
    ever = seen.any(axis=0)
    if len(markers) < 3 or ever.sum() < FEWEST:
        return spikes
    for _ in range(ROUNDS):
        left = np.where(spikes[:, ever, None], np.nan, markers[:, ever])
        largest = float(np.nanstd(left, axis=0).max())
        if largest == 0.0:
            break
        in_time = _off_in_time(left)
        off = np.minimum(in_time, off_in_space(left))
        counted = ~np.isnan(left[:, :, 0])
        far = FAR * float(np.quantile(off[counted], ORDINARY)) + SMALL * largest
        found = counted & (off > far) & _peaks(in_time)
        if not found.any():
            break
        spikes[:, ever] |= found
    return spikes


def _off_in_time(markers: FloatArray) -> FloatArray:
    """Distance of each position to a line, or a cubic, through those around, (T, M)."""
    frames = len(markers)
    X = interpolated(markers.reshape(frames, -1), np.arange(frames, dtype=np.float64))
    x = _continued(X.reshape(markers.shape))
    beside, beyond = x[1:-3] + x[3:-1], x[:-4] + x[4:]
    here = x[2:-2]
    off = np.stack([here - beside / 2.0, here - (4.0 * beside - beyond) / 6.0])
    return np.asarray(np.linalg.norm(off, axis=3).min(axis=0))


def _continued(x: FloatArray) -> FloatArray:
    """Frames extended by two at each end, along straight lines."""
    start = [4.0 * x[1] - 3.0 * x[2], 3.0 * x[1] - 2.0 * x[2]]
    end = [3.0 * x[-2] - 2.0 * x[-3], 4.0 * x[-2] - 3.0 * x[-3]]
    return np.concatenate([np.stack(start), x, np.stack(end)])


def _peaks(off: FloatArray) -> BoolArray:
    """Entries farther off than those of the frames before and after: a spike draws these along."""
    padded = np.pad(off, ((1, 1), (0, 0)), constant_values=-np.inf)
    return np.asarray((off >= padded[:-2]) & (off >= padded[2:]))

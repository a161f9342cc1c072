"""Single positions that neither the frames around nor the other markers predict."""

from __future__ import annotations

import numpy as np

from facert.data.arrays import BoolArray, FloatArray, lengths
from facert.data.blocks import blocks, spread
from facert.data.normalisation import deviation
from facert.preprocess.faults.prediction import ALL, expected_of, some_frames
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
    hidden = np.isnan(markers[:, :, 0])
    ever = np.asarray(~hidden.all(axis=0))
    spikes = np.zeros_like(hidden)
    if len(markers) < 3 or ever.sum() < FEWEST:
        return spikes
    if not ever.all():
        spikes[:, ever] = single_spikes(np.ascontiguousarray(markers[:, ever]))
        return spikes
    left = markers
    for _ in range(ROUNDS):
        largest = _largest_deviation(left)
        if largest == 0.0:
            break
        counted = ~(hidden | spikes)
        in_time = _off_in_time(left)
        off = np.minimum(in_time, _off_in_space(left))
        far = FAR * _ordinary(off, counted) + SMALL * largest
        found = counted & (off > far) & _peaks(in_time)
        if not found.any():
            break
        spikes |= found
        left = left.copy()
        left[found] = np.nan
    return spikes


def _ordinary(off: FloatArray, counted: BoolArray) -> float:
    """The distance that `ORDINARY` positions (T, M), of very many some, are not farther off."""
    some = spread(len(off), max(ALL // off.shape[1], 1))
    return float(np.quantile(off[some][counted[some]], ORDINARY))


def _off_in_space(markers: FloatArray) -> FloatArray:
    """Distance of each position to its prediction by the rest of its frame, (T, M)."""
    hidden = np.isnan(markers[:, :, 0])
    return expected_of(markers[some_frames(hidden)]).off(markers, np.zeros_like(hidden))


def _largest_deviation(markers: FloatArray) -> float:
    X = markers.reshape(len(markers), -1)
    return max(float(deviation(X[:, own]).max()) for own in blocks(X.shape[1], len(X)))


def _off_in_time(markers: FloatArray) -> FloatArray:
    """Distance of each position to a line, or a cubic, through those around, (T, M)."""
    frames, count = markers.shape[:2]
    off, time = np.empty((frames, count)), np.arange(frames, dtype=np.float64)
    for some in blocks(count, 3 * frames):
        X = interpolated(markers[:, some].reshape(frames, -1), time)
        x = _continued(X.reshape(frames, -1, 3))
        beside, beyond, here = x[1:-3] + x[3:-1], x[:-4] + x[4:], x[2:-2]
        line, cubic = here - beside / 2.0, here - (4.0 * beside - beyond) / 6.0
        off[:, some] = np.minimum(lengths(line), lengths(cubic))
    return off


def _continued(x: FloatArray) -> FloatArray:
    """Frames extended by two at each end, along straight lines."""
    start = [4.0 * x[1] - 3.0 * x[2], 3.0 * x[1] - 2.0 * x[2]]
    end = [3.0 * x[-2] - 2.0 * x[-3], 4.0 * x[-2] - 3.0 * x[-3]]
    return np.concatenate([np.stack(start), x, np.stack(end)])


def _peaks(off: FloatArray) -> BoolArray:
    """Entries farther off than those of the frames before and after: a spike draws these along."""
    padded = np.pad(off, ((1, 1), (0, 0)), constant_values=-np.inf)
    return np.asarray((off >= padded[:-2]) & (off >= padded[2:]))

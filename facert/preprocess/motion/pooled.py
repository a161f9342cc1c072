"""Noise and motion of several takes together, each of which was cleaned on its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from facert.data.arrays import FloatArray
from facert.data.normalisation import Normalisation
from facert.models.threads import threads_for
from facert.preprocess.motion.estimate import LEAST_NOISE, MotionEstimate, evenly
from facert.preprocess.motion.motion import Motion


@dataclass(frozen=True, eq=False)
class PooledEstimate:
    """What one model keeps of the noise and the motion of several takes."""

    sigma: float  # Standard deviation of the capture noise, root mean square over frames
    sigma_t: float  # How far the column that moves most goes from frame to frame, likewise
    # How the columns move, in the units of all takes; None where a column shows in no take whose
    # frames follow each other
    motion: Motion | None


def pooled(
    found: Sequence[MotionEstimate],
    measured: Sequence[FloatArray],
    times: Sequence[FloatArray],
    units: Normalisation,
) -> PooledEstimate:
    """The noise and the motion of takes.

    Parameters
    ----------
    found : sequence of MotionEstimate, length n
        Of each take.
    measured : sequence of array, shape (T_i, d)
        The frames of each; NaN: not observed.
    times : sequence of array, shape (T_i,)
    units : Normalisation
        Of all takes.
    """
    frames = np.array([len(X) for X in measured], dtype=np.float64)
    shares = frames / frames.sum()
    sigma, sigma_t = (
        float(np.sqrt(shares @ np.square(values)))
        for values in ([one.sigma for one in found], [one.sigma_t for one in found])
    )
    grids = [evenly(units.apply(X), time) for X, time in zip(measured, times, strict=True)]
    seen = np.any([~np.isnan(even).all(axis=0) for even, _, _ in grids], axis=0)
    if not seen.all():
        return PooledEstimate(sigma, sigma_t, None)
    noise = max(sigma / units.scale, LEAST_NOISE)
    with threads_for(1):
        motion = Motion.learned_over([g[0] for g in grids], noise, [g[2] for g in grids])
    return PooledEstimate(sigma, sigma_t, motion)

"""Target mapping: the character's parameters at a latent position, Eq. (18)."""

from __future__ import annotations

import numpy as np

from facert.data.arrays import FloatArray
from facert.models.gp.posterior import Predictor
from facert.models.gplvm.source_mapping import CHUNK, Mapped


def map_to_target(posterior: Predictor, mapped: Mapped) -> tuple[FloatArray, FloatArray]:
    """Most probable parameters and their standard deviation.

    The variance is that of the target view at z* plus what the uncertainty of z* itself brings,
    J_yᵀ (∇²F)⁻¹ J_y in the Laplace approximation: hidden markers widen it.
    In a stream the previous frame's x* counts as exact, so that the std of a long gap is too small.

    Parameters
    ----------
    posterior : Predictor
        The target view, Y given Z.
    mapped : Mapped
        B frames in latent space.

    Returns
    -------
    mean, std : arrays, shape (B, d_y)
        Normalised units.
    """
    means, stds = [], []
    for first in range(0, len(mapped.z), CHUNK):
        rows = slice(first, first + CHUNK)
        at = posterior.predict(mapped.z[rows])
        J = posterior.mean_jacobian(at)
        spread = np.einsum("bqd,bqd->bd", J, np.linalg.solve(mapped.hessian[rows], J))
        means.append(at.mean)
        # Where Newton's method gave up the Hessian may be indefinite.
        stds.append(np.sqrt(at.variance[:, None] + np.maximum(spread, 0.0)))
    return np.concatenate(means), np.concatenate(stds)

"""Target mapping: the character's parameters at a latent position, Eq. (18)."""

from __future__ import annotations

import numpy as np

from facert.data.arrays import FloatArray
from facert.models.gp.posterior import Predictor, namespace
from facert.models.gplvm.source_mapping import Mapped, chunks_of


def map_to_target(posterior: Predictor, mapped: Mapped) -> tuple[FloatArray, FloatArray]:
    """Most probable parameters and their standard deviation.

    The variance is that of the target view at z* plus that by the uncertainty of z*,
    J_yᵀ (∇²F)⁻¹ J_y in the Laplace approximation: hidden markers widen it.
    In a stream the previous frame's x* counts as exact, so that the std of a long gap is too small.

    Parameters
    ----------
    posterior : Predictor
        The target view, Y given Z, perhaps on a device.
    mapped : Mapped
        B frames in latent space.

    Returns
    -------
    mean, std : arrays, shape (B, d_y)
        Normalised units.
    """
    means, stds = [], []
    for rows in chunks_of(len(mapped.z), posterior):
        z, hessian = (posterior.there(array[rows]) for array in (mapped.z, mapped.hessian))
        at, xp = posterior.predict(z), namespace(z)
        J = posterior.mean_jacobian(at)
        spread = xp.einsum("bqd,bqd->bd", J, xp.linalg.solve(hessian, J))
        means.append(posterior.here(at.mean))  # Eq. (18)
        # Where Newton's method gave up the Hessian may be indefinite.
        variance = at.variance[:, None] + xp.maximum(spread, posterior.zero)
        stds.append(posterior.here(xp.sqrt(variance)))
    return np.concatenate(means), np.concatenate(stds)

"""The noise and motion of a capture, estimated where the settings leave them open.

To a model of q latent dimensions, whatever q directions cannot carry is noise, be it of the
measurement or of motion too small to model. Its variance in one direction is estimated by the
first principal variance left over, λ_{q+1}: an exact capture of simple speech gets a small one, so
that lids and brows count beside a large jaw; a rich or noisy capture a larger one.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from facert.data.arrays import FloatArray
from facert.models.leading_directions import DENSE, principal_variances
from facert.settings import Settings

# Normalised units. Below the first, source mapping begins to stick to the training latents (their
# predictive variance vanishes, see facert.models.kernels); above the second, small motion is lost.
LEAST, MOST = 0.03, 0.1
ENOUGH = 500
"""Frames of a dense source that its noise is estimated from."""
STEP = 0.3
"""Motion of a face from frame to frame where it is not given, normalised units."""


def expected_noise(X: FloatArray, latent_dim: int) -> float:
    """σ_c, the standard deviation of the noise in a normalised source.

    Parameters
    ----------
    X : array, shape (n, d)
        Normalised frames.
    latent_dim : int
        q.

    Returns
    -------
    float
        √λ_{q+1}, not below `LEAST` nor above `MOST`.
    """
    variances = principal_variances(X) / max(X.shape[1] / DENSE, 1.0)  # as methods see it
    left_over = variances[latent_dim] if latent_dim < len(variances) else 0.0
    return float(np.clip(np.sqrt(left_over), LEAST, MOST))


def enough(X: FloatArray) -> FloatArray:
    """Frames (n, d), of a dense source only some, evenly spread, to estimate the noise from."""
    return X[:: -(-len(X) // ENOUGH)] if X.shape[1] > DENSE else X


def with_noise(settings: Settings, X: FloatArray) -> Settings:
    """The settings with the noise and the motion of the source filled in where they are open.

    Parameters
    ----------
    settings : Settings
        σ_c and the source's noise floor may be None.
    X : array, shape (n, d)
        Normalised frames, the more the better.
    """
    sigma_c = settings.sigma_c
    if sigma_c is None:
        sigma_c = expected_noise(X, settings.latent_dim)
    floor = settings.source_noise_floor
    return replace(
        settings,
        sigma_c=sigma_c,
        source_noise_floor=sigma_c**2 if floor is None else floor,
        sigma_t=STEP if settings.sigma_t is None else settings.sigma_t,
    )

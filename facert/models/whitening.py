"""Source features learned from every frame, posed or not.

Let λ_i and v_i be the principal variances and directions of all source frames, and σ² the variance
of the noise in one direction. A direction is kept while λ_i > σ² (1 + √(d/n))², the largest
variance that noise alone would show (Marchenko and Pastur 1967). Its signal has the variance
s_i² = λ_i - σ², and

    φ_i = s_i^-p · s_i²/(s_i² + σ² + ε λ_1) · v_iᵀ(x - x̄)

is its best linear estimate from the noisy coordinate, divided by s_i to a power: p = 0 leaves the
source's own proportions, in which a jaw outweighs a lid a hundred times; p = 1 makes all directions
alike, noise and all; p = 1/2, half-whitening, serves captures whose small directions matter.
"""

from __future__ import annotations

import numpy as np

from facert.data.arrays import FloatArray

LEAST_DIRECTIONS = 12  # to separate noise from motion
EPSILON = 1e-5  # ε: directions smaller than this fade out, whatever the noise


def noise_variance(variances: FloatArray) -> float:
    """σ² of one direction: the median of all principal variances.

    A face moves in far fewer directions than it has coordinates, so that half of them show noise
    alone; without noise the median is zero. A few weights have no direction to spare.
    """
    return float(np.median(variances)) if len(variances) >= LEAST_DIRECTIONS else 0.0


def whitening(X: FloatArray, power: float) -> FloatArray:
    """A basis Φ with φ(x) = (x - x̄) Φ.

    Parameters
    ----------
    X : array, shape (n, d)
        All frames.
    power : float
        p, from 0 to 1.

    Returns
    -------
    array, shape (d, d)
        Directions that are not kept are columns of zero.
    """
    n, d = X.shape
    variances, directions = np.linalg.eigh(np.cov(X, rowvar=False, bias=True).reshape(d, d))
    variances = np.maximum(variances, 0.0)
    noise = noise_variance(variances)
    signal = variances - noise
    kept = (variances > noise * (1.0 + np.sqrt(d / n)) ** 2) & (signal > 0.0)
    safe = np.where(kept, signal, 1.0)
    gain = safe ** (1.0 - 0.5 * power) / (safe + noise + EPSILON * variances[-1])
    basis: FloatArray = directions * np.where(kept, gain, 0.0)
    return basis

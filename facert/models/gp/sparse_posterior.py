"""The predictions of a sparse Gaussian process, from its inducing positions alone.

With the factors of `facert.models.gp.sparse`, the mean and the variance at a new position are kᵀα
and θ1 + θ3⁻¹ - kᵀ L⁻ᵀ (I - B⁻¹) L⁻¹ k, k the kernel against the m inducing positions and

    α = L⁻ᵀ B⁻¹ A Λ^-½ X.

With B = Q diag(b) Qᵀ the quadratic form is |T k|², T = diag(1 - 1/b)^½ Qᵀ L⁻¹: a
`facert.models.gp.posterior.Predictor` of m positions, however many rows it was learned from.
"""

from __future__ import annotations

import numpy as np
import torch

from facert.data.arrays import FloatArray
from facert.models.gp.posterior import Predictor
from facert.models.gp.sparse import APPROXIMATIONS, ApproximationName, factorise
from facert.models.kernels import Kernel


def sparse_posterior(
    inducing: FloatArray,
    Z: FloatArray,
    X: FloatArray,
    kernel: Kernel,
    approximation: ApproximationName = "vfe",
    weights: FloatArray | None = None,
) -> Predictor:
    """The process given its training data, by its inducing positions.

    Parameters
    ----------
    inducing : array, shape (m, q)
        U.
    Z : array, shape (n, q)
        Training positions.
    X : array, shape (n, D)
        Observations, with mean zero.
    kernel : Kernel
        Fixed parameters.
    approximation : {"vfe", "fitc"}
        The approximation with which the parameters were found.
    weights : array, shape (n,), optional
        Weights of the rows at that time.
    """
    parts = factorise(
        torch.from_numpy(kernel.cross(inducing, inducing)),
        torch.from_numpy(kernel.cross(inducing, Z)),
        torch.from_numpy(np.ones(len(Z)) if weights is None else weights),
        kernel.variance,
        kernel.noise,
        X.shape[1],
        APPROXIMATIONS[approximation],
    )
    L_inverse, L_B = parts.L_inverse.numpy(), parts.B_cholesky.numpy()
    b, Q = np.linalg.eigh(L_B @ L_B.T)
    weighted = (parts.A * parts.diagonal.rsqrt()).numpy() @ X
    alpha = L_inverse.T @ (Q @ (Q.T @ weighted / b[:, None]))
    whitener = np.sqrt(np.maximum(1.0 - 1.0 / b, 0.0))[:, None] * (Q.T @ L_inverse)
    return Predictor(inducing, whitener, alpha, kernel)

"""The alignment matrix B of Algorithm 1: what the target is off affine maps of the source, locally.

A local structure X_i is k_i points of D coordinates (rows here, columns in the paper) with the
singular value decomposition X_i - x̄_i = G S Uᵀ. The d leading right singular vectors U span its
tangent space, in which a point has the coordinates (x - x̄_i) U (1), (2). The columns g of G are
the same coordinates, each scaled to length 1. That the tangent coordinates of the target are linear
in those of the source, (3) to (5), makes the target an affine map of these (6), hence a linear map
of G_i = [e/√k_i, g_1, ..., g_d].

Minimised over the maps (12), the objective (7) is the sum over i of trace(Y_iᵀ W_i Y_i) (13), where
W_i = I - G_i G_iᵀ takes off what G_i spans. The sum is trace(Yᵀ B Y) with B = Σ S_i W_i S_iᵀ (14),
(15): sparse, positive semidefinite, without a unit, and with the constant vector in its null space.

How much a direction counts is decided against the largest singular value σ of *all* local
structures: in a frame that stands still every direction is noise. With the penalty μ² ‖D_i‖² in
(6), μ a share of σ, the pseudo-inverse of (12) is damped: the direction of singular value s counts
s² / (s² + μ²). A threshold, which is the usual way, would make the result jump where s crosses it.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse

from facert.data.arrays import FloatArray, IntArray
from facert.errors import InputError
from facert.topology.neighbourhoods import Neighbourhoods

GUARD = 1e-8
"""The share of the largest singular value at which a direction of a surface is half noise."""


def alignment_matrix(
    X: FloatArray, neighbourhoods: Neighbourhoods, dim: int, guard: float = GUARD
) -> sparse.csc_array:
    """B of Algorithm 1, lines 1 to 6, one batch for the local structures of each size, (N, N).

    Parameters
    ----------
    X : array, shape (N, D)
        Source points: vertices of a face, or positions of a feature point over time.
    neighbourhoods : Neighbourhoods
        N points.
    dim : int
        d, the most directions of a tangent space; D and k - 1 bound it as well. With d = D, affine
        maps of the source cost nothing.
    guard : float
        μ, as a share of the largest singular value of all.

    Raises
    ------
    InputError
        For points that are not finite, or not as many as the neighbourhoods choose from.
    """
    if len(X) != neighbourhoods.points or not np.isfinite(X).all():
        raise InputError(
            "source points",
            f"{neighbourhoods.points} rows of finite numbers",
            f"{len(X)} rows" if np.isfinite(X).all() else "NaN or infinity",
            "Fill or drop what was not observed.",
        )
    if dim < 0:
        raise InputError("dim", "0 or more", f"{dim}", "2 suits a surface, 3 a moving point.")
    groups = list(neighbourhoods.by_size())  # line 3
    tangents = [tangent_coordinates(X[members], dim) for members in groups]  # line 4
    largest = max((float(spread.max(initial=0.0)) for _, spread in tangents), default=0.0)
    W = [_residual_projections(g, spread, guard * largest) for g, spread in tangents]
    rows = [np.repeat(members, members.shape[1], axis=1) for members in groups]
    columns = [np.tile(members, members.shape[1]) for members in groups]
    entries = (_joined(W), (_joined(rows), _joined(columns)))
    N = neighbourhoods.points
    return sparse.coo_array(entries, shape=(N, N)).tocsc()  # line 5: sums what coincides


def tangent_coordinates(structures: FloatArray, dim: int) -> tuple[FloatArray, FloatArray]:
    """Tangent coordinates (1) of local structures (n, k, D), as unit vectors and their lengths.

    The first are g_1 to g_d of Algorithm 1, line 4, (n, k, d), the others the singular values,
    falling, (n, d).
    """
    centred = structures - structures.mean(axis=1, keepdims=True)
    g, spread, _ = np.linalg.svd(centred, full_matrices=False)
    return g[:, :, :dim], spread[:, :dim]


def _residual_projections(g: FloatArray, spread: FloatArray, noise: float) -> FloatArray:
    """W_i = I - G_i G_iᵀ (13), (n, k, k); a g whose singular value is μ = `noise` counts half."""
    power, k = spread**2, g.shape[1]
    shares = np.divide(power, power + noise**2, out=np.zeros_like(power), where=power > 0)
    return np.asarray(np.eye(k) - 1.0 / k - (g * shares[:, None, :]) @ g.transpose(0, 2, 1))


def _joined(parts: list[FloatArray] | list[IntArray]) -> FloatArray | IntArray:
    return np.concatenate([part.ravel() for part in parts])

"""The alignment matrix B of Algorithm 1.

Minimised over the affine map of each local structure, the objective (7) is the sum over i of
trace(Y_i W_i Y_iᵀ) (13), where W_i = I - G_i G_iᵀ takes off what G_i = [e/√k_i, g_1, ..., g_d]
spans: the constant, and the tangent coordinates of the *source*. The sum is trace(Y B Yᵀ) with
B = Σ S_i W_i S_iᵀ (14), (15): sparse, positive semidefinite, without a unit, and with the constant
vector in its null space. W_i is a projection but for the directions that are hardly more than
noise, which it takes off in part (`facert.topology.tangent`).
"""

from __future__ import annotations

import numpy as np
from scipy import sparse

from facert.data.arrays import FloatArray
from facert.topology.neighbourhoods import Neighbourhoods
from facert.topology.tangent import LocalStructures, local_structures

GUARD = 1e-8
"""The share of the largest singular value at which a direction of a surface is half noise."""


def alignment_matrix(
    X: FloatArray, neighbourhoods: Neighbourhoods, dim: int, guard: float = GUARD
) -> sparse.csc_array:
    """B of Algorithm 1, steps 1 to 6, (N, N).

    Parameters
    ----------
    X : array, shape (N, D)
        Source points: vertices of a face, or positions of a feature point over time.
    neighbourhoods : Neighbourhoods
        N points.
    dim : int
        d, the dimension of the tangent spaces. With d = D, affine maps of the source cost nothing.
    guard : float
        At this share of the largest singular value, a direction is half noise.

    Raises
    ------
    InputError
        For points that are not finite, or not as many as the neighbourhoods choose from.
    """
    structures = local_structures(X, neighbourhoods, dim, guard)
    rows = [np.repeat(each.members, each.members.shape[1], axis=1).ravel() for each in structures]
    columns = [np.tile(each.members, each.members.shape[1]).ravel() for each in structures]
    values = [residual_projections(each).ravel() for each in structures]
    entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    N = neighbourhoods.points
    return sparse.coo_array(entries, shape=(N, N)).tocsc()


def residual_projections(structures: LocalStructures) -> FloatArray:
    """W_i = I - G_i G_iᵀ of each local structure (13), each g as much as it counts, (n, k, k)."""
    g, k = structures.scores, structures.members.shape[1]
    counted = g * structures.shares[:, None, :]
    return np.asarray(np.eye(k) - 1.0 / k - counted @ g.transpose(0, 2, 1))

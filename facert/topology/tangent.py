"""Local tangent coordinates, equations (1) to (5).

A local structure X_i is k points of D coordinates (rows here, columns in the paper). Its centred
matrix has the singular value decomposition X_i - x̄_i = G S Uᵀ. The d leading right singular vectors
U span the tangent space; the coordinates in it are x̃ = (x - x̄_i) U (1), of which x is nearly
x̃ Uᵀ + x̄_i (2). The columns of G are the same coordinates, each scaled to length 1: an affine map
of the tangent coordinates (5) is a linear one of [e/√k, G].

How much a direction counts is decided against the largest singular value σ of *all* local
structures: in a frame that stands still every direction is noise. With the penalty μ² ‖D_i‖² in
(6), μ a share of σ, the pseudo-inverse of (12) is damped: the direction of singular value s counts
s² / (s² + μ²). A threshold, which is the usual way, would make the result jump where s crosses it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from facert.data.arrays import FloatArray, IntArray
from facert.errors import InputError
from facert.topology.neighbourhoods import Neighbourhoods


@dataclass(frozen=True, eq=False)
class LocalStructures:
    """The n local structures of one size k, with their tangent spaces.

    Parameters
    ----------
    members : array of int, shape (n, k)
        Which points they consist of.
    means : array, shape (n, D)
        x̄_i.
    directions : array, shape (n, d, D)
        Rows: the leading singular vectors U_i.
    scores : array, shape (n, k, d)
        Columns: g_1 to g_d of Algorithm 1, step 4.
    spread : array, shape (n, d)
        Singular values, falling.
    shares : array, shape (n, d)
        How much each direction counts, from 0 to 1.
    """

    members: IntArray
    means: FloatArray
    directions: FloatArray
    scores: FloatArray
    spread: FloatArray
    shares: FloatArray

    @property
    def coordinates(self) -> FloatArray:
        """Tangent coordinates x̃ of every member (1), (n, k, d)."""
        return self.scores * self.spread[:, None, :]

    def reconstruct(self, coordinates: FloatArray) -> FloatArray:
        """Points (n, k, D) from tangent coordinates (n, k, d), equation (2)."""
        return coordinates @ self.directions + self.means[:, None, :]

    def damped(self, noise: float) -> LocalStructures:
        """The same, where a direction whose singular value is μ = `noise` counts one half."""
        power = self.spread**2
        shares = np.divide(power, power + noise**2, out=np.zeros_like(power), where=power > 0)
        return replace(self, shares=shares)


def local_structures(
    X: FloatArray, neighbourhoods: Neighbourhoods, dim: int, guard: float
) -> list[LocalStructures]:
    """Tangent spaces of all neighbourhoods, one batch a size.

    Parameters
    ----------
    X : array, shape (N, D)
        Source points.
    neighbourhoods : Neighbourhoods
    dim : int
        d, the most directions of a tangent space; D and k - 1 bound it as well.
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
    structures = [_tangent_spaces(X, members, dim) for members in neighbourhoods.by_size()]
    largest = max((float(each.spread.max(initial=0.0)) for each in structures), default=0.0)
    return [each.damped(guard * largest) for each in structures]


def _tangent_spaces(X: FloatArray, members: IntArray, dim: int) -> LocalStructures:
    local = X[members]
    means = local.mean(axis=1)
    scores, spread, directions = np.linalg.svd(local - means[:, None, :], full_matrices=False)
    return LocalStructures(
        members,
        means,
        directions[:, :dim],
        scores[:, :, :dim],
        spread[:, :dim],
        shares=np.ones_like(spread[:, :dim]),
    )

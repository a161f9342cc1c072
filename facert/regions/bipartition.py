"""Markers in two groups that move each for themselves.

Two markers are tied as far as they move together and are near,

    A_ij = (R_ij + ε) exp(-|p_i - p_j|² / 2h²),      R_ij = |C_ij|² / (|C_ii| |C_jj|),

with C_ij their cross-covariance, p_i their mean positions, and R the RV coefficient (Robert and
Escoufier 1976), which knows neither the direction nor the size of a motion. The normalised cut of
Shi and Malik (2000) parts them: the second eigenvector of the normalised Laplacian orders the
markers, and the best cut along this order is taken. The order is smoothed to a plane through the
face, so that no marker strays to the other group. No pose is looked at: a hundred frames show how
markers go together, ten labels hardly do.
"""

from __future__ import annotations

import numpy as np

from facert.data.arrays import BoolArray, FloatArray
from facert.data.memory import require_square
from facert.models.kernels import squared_exponential

TIED = 0.05  # ε: near markers are tied a little, even where noise hides how they move
NEIGHBOUR = 3  # h is twice the median distance to the neighbour of this rank
LEAST_SHARE = 0.125  # of the markers, in either group
FLAT = 1e-5  # share of their largest extent: less is how they were rounded
FEWEST = 4  # markers that can be parted


def two_groups(frames: FloatArray) -> BoolArray:
    """Part markers, or weights, in two groups.

    Parameters
    ----------
    frames : array, shape (n, M, 3) or (n, M)
        Complete; positions or weights.

    Returns
    -------
    array of bool, shape (M,)
        True for one group. With fewer than `FEWEST`, all are in the other.

    Raises
    ------
    InputError
        When there are so many that what each pair does together takes too much memory.
    """
    require_square(frames.shape[1], "/source", "Give the regions by names: --regions FILE.", 18)
    if frames.shape[1] < FEWEST:
        return np.zeros(frames.shape[1], dtype=np.bool_)
    if frames.ndim == 2:
        ties = together(frames[:, :, None])
        return _best_cut(ties, _order(ties))
    places = frames.mean(axis=0)
    ties = (together(frames) + TIED) * _nearness(places)
    return _best_cut(ties, _on_plane(_order(ties), places))


def together(frames: FloatArray) -> FloatArray:
    """RV coefficients of all pairs, 0 to 1: how far they move together.

    Parameters
    ----------
    frames : array, shape (n, M, k)
        M things of k coordinates.

    Returns
    -------
    array, shape (M, M)
        0 with what never moves.
    """
    moved = frames - frames.mean(axis=0)
    crossed = np.einsum("nik,njm->ijkm", moved, moved, optimize=True)
    squared = np.sum(crossed**2, axis=(2, 3))
    own = np.sqrt(squared.diagonal())
    sizes = np.outer(own, own)
    return np.asarray(squared / np.where(sizes > 0, sizes, np.inf))


def _nearness(places: FloatArray) -> FloatArray:
    """exp(-|p_i - p_j|² / 2h²), (M, M)."""
    squared = np.sum((places[:, None] - places) ** 2, axis=2)
    h = 2.0 * np.sqrt(np.median(np.sort(squared, axis=1)[:, NEIGHBOUR]))
    return squared_exponential(squared, 1.0 / max(h**2, np.finfo(np.float64).tiny))


def _order(ties: FloatArray) -> FloatArray:
    """Second eigenvector of the normalised Laplacian, by which markers are ordered, (M,)."""
    roots = np.sqrt(np.maximum(ties.sum(axis=1), np.finfo(np.float64).tiny))
    _, vectors = np.linalg.eigh(np.eye(len(ties)) - ties / np.outer(roots, roots))
    return np.asarray(vectors[:, 1] / roots)


def _on_plane(order: FloatArray, places: FloatArray) -> FloatArray:
    """The linear function of the places (M, 3) that comes nearest to the order, (M,)."""
    centred = places - places.mean(axis=0)
    slope = np.linalg.lstsq(centred, order - order.mean(), rcond=FLAT)[0]
    return np.asarray(centred @ slope)


def _best_cut(ties: FloatArray, order: FloatArray) -> BoolArray:
    """The markers after the cut of least normalised weight along an order, (M,)."""
    ranks = np.argsort(order, kind="stable")
    sorted_ties = ties[np.ix_(ranks, ranks)]
    count = len(ranks)
    least = max(1, int(LEAST_SHARE * count))
    sizes = np.arange(least, count - least + 1)
    # Sums over the leading block of every size, from a running sum over both axes.
    inside = np.cumsum(np.cumsum(sorted_ties, axis=0), axis=1).diagonal()[sizes - 1]
    volume = np.cumsum(sorted_ties.sum(axis=1))
    before, total = volume[sizes - 1], volume[-1]
    across = before - inside
    tiny = np.finfo(np.float64).tiny
    cost = across / np.maximum(before, tiny) + across / np.maximum(total - before, tiny)
    after = np.zeros(count, dtype=np.bool_)
    after[ranks[sizes[int(cost.argmin())] :]] = True
    return after

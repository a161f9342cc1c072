"""The prior over latent coordinates that keeps local linear structure, Eqs. (5) to (8)."""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.spatial import KDTree

from facert.data.arrays import FloatArray, IntArray

# Added to the local Gram matrix, relative to its trace, when neighbours are nearly dependent.
REGULARISATION = 1e-3
CHUNK = 512  # rows solved together; bounds the memory at CHUNK * k * d doubles


def nearest_neighbours(U: FloatArray, k: int) -> IntArray:
    """The k nearest other rows of each row of U (n, d), as indices (n, k)."""
    n = len(U)
    k = min(k, n - 1)
    found = np.asarray(KDTree(U).query(U, k=k + 1)[1])
    others = found != np.arange(n)[:, None]
    # Where frames repeat exactly, a row need not find itself: then drop the farthest instead.
    others[others.all(axis=1), -1] = False
    return np.asarray(found[others].reshape(n, k), dtype=np.int64)


def reconstruction_weights(U: FloatArray, k: int) -> sparse.csr_array:
    """C of Eq. (7): row i rebuilds u_i from its k nearest neighbours with weights of Eq. (8).

    Parameters
    ----------
    U : array, shape (n, d)
        Observations, n >= 2.
    k : int
        Neighbours; n - 1 when there are fewer.

    Returns
    -------
    csr_array, shape (n, n)
        Rows sum to 1, the diagonal is 0.
    """
    n = len(U)
    neighbours = nearest_neighbours(U, k)
    chunks = [slice(first, first + CHUNK) for first in range(0, n, CHUNK)]
    weights = np.concatenate([_local_weights(U[rows], U[neighbours[rows]]) for rows in chunks])
    k = neighbours.shape[1]
    rows = np.repeat(np.arange(n), k)
    return sparse.csr_array((weights.ravel(), (rows, neighbours.ravel())), shape=(n, n))


def _local_weights(points: FloatArray, neighbours: FloatArray) -> FloatArray:
    """Eq. (8) for points (b, d) with neighbours (b, k, d): weights (b, k) that sum to 1."""
    differences = neighbours - points[:, None, :]
    gram = differences @ differences.transpose(0, 2, 1)
    trace = np.trace(gram, axis1=1, axis2=2)
    # All neighbours may coincide with the point; any weights rebuild it then.
    ridge = np.where(trace > 0, REGULARISATION * trace, 1.0)
    count = np.arange(neighbours.shape[1])
    gram[:, count, count] += ridge[:, None]
    weights = np.linalg.solve(gram, np.ones((*gram.shape[:2], 1)))[:, :, 0]
    return np.asarray(weights / weights.sum(axis=1, keepdims=True))


def constraint_matrix(X: FloatArray, Y: FloatArray, labelled: int, k: int) -> sparse.csr_array:
    """M of Eq. (6): the reconstruction rows of both views, sharing the labelled columns.

    Parameters
    ----------
    X : array, shape (l + m, d_x)
        Source view: labelled rows first, then the source's own unlabelled rows.
    Y : array, shape (l + n, d_y)
        Target view in the same manner.
    labelled : int
        l.
    k : int
        Neighbours.

    Returns
    -------
    csr_array, shape (l + m + l + n, l + m + n)
        Each row times the latent coordinates is one reconstruction residual.
    """
    rows = view_rows(labelled, len(X) - labelled, len(Y) - labelled)
    places = sparse.eye_array(len(X) + len(Y) - labelled, format="csr")
    residuals = [sparse.eye_array(len(U)) - reconstruction_weights(U, k) for U in (X, Y)]
    blocks = [residual @ places[own] for residual, own in zip(residuals, rows, strict=True)]
    M: sparse.csr_array = sparse.vstack(blocks, format="csr")
    return M


def view_rows(labelled: int, source_only: int, target_only: int) -> tuple[IntArray, IntArray]:
    """The rows of the latent coordinates that belong to source and target, labelled ones first."""
    rows = np.arange(labelled + source_only + target_only)
    return rows[: labelled + source_only], np.delete(rows, slice(labelled, labelled + source_only))

"""Initial latent coordinates: manifold alignment (Ham, Lee and Saul 2005), or components."""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.linalg import eigh

from facert.data.arrays import FloatArray


def align(M: sparse.csr_array, latent_dim: int) -> FloatArray:
    """Latent coordinates that satisfy the reconstruction constraints of both views best.

    They are the eigenvectors of MᵀM next to the constant one, scaled to unit variance: labelled
    frames, whose columns the two views share, tie the views together.

    Parameters
    ----------
    M : csr_array, shape (constraints, N)
        See `facert.models.gplvm.lle.constraint_matrix`.
    latent_dim : int
        q, less than N.

    Returns
    -------
    array, shape (N, q)
        Columns with mean 0 and variance 1, signs fixed so that the result is unique.
    """
    product = (M.T @ M).toarray()
    # The constant vector is moved out of the way, rather than the first one dropped: where the
    # views fall into parts that no neighbour joins, there are several vectors of eigenvalue zero.
    product += np.trace(product) / len(product)
    _, vectors = eigh(product, subset_by_index=[0, latent_dim - 1])
    vectors /= vectors.std(axis=0)
    largest = np.abs(vectors).argmax(axis=0)
    aligned: FloatArray = vectors * np.sign(vectors[largest, np.arange(latent_dim)])
    return aligned


def principal_components(observations: FloatArray, latent_dim: int) -> FloatArray:
    """Latent coordinates of points whose views are all known, for the supervised model.

    Parameters
    ----------
    observations : array, shape (N, d)
        Both views side by side.
    latent_dim : int
        q, less than N.

    Returns
    -------
    array, shape (N, q)
        Principal components, the largest with variance 1.
    """
    centred = observations - observations.mean(axis=0)
    U, S, _ = np.linalg.svd(centred, full_matrices=False)
    components: FloatArray = U[:, :latent_dim] * (S[:latent_dim] / S[0]) * np.sqrt(len(U))
    return components

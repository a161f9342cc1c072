"""Laplacians of a mesh and of a path, and the energies that are made of them.

The energy ‖L Y‖² keeps each point where it lies between its neighbours: Laplacian editing (Sorkine
et al. 2004, the paper's [17]) asks L Y = L X, which is L (Y - X) = 0 for displacements. With the
cotangent weights (Pinkall and Polthier 1993) and areas it becomes the bending energy of a thin
sheet, the integral of (ΔY)².
"""

from __future__ import annotations

import numpy as np
import robust_laplacian
from scipy import sparse

from facert.data.arrays import FloatArray, IntArray
from facert.topology.neighbourhoods import adjacency


def uniform_energy(vertices: FloatArray, faces: IntArray) -> sparse.csc_array:
    """Lᵀ L with L = I - D⁻¹ A: each vertex against the mean of its neighbours, (V, V)."""
    return squared(random_walk(adjacency(faces, len(vertices))))


def cotangent_energy(vertices: FloatArray, faces: IntArray) -> sparse.csc_array:
    """Lᵀ L with the cotangent weights instead, each row divided by its diagonal, (V, V)."""
    C, _ = cotangent_matrix(vertices, faces)
    return squared(sparse.csr_array(_inverse_diagonal(C.diagonal()) @ C))


def biharmonic_energy(vertices: FloatArray, faces: IntArray) -> sparse.csc_array:
    """C M⁻¹ C, the integral of (ΔY)² over the surface, (V, V), times the mean area of a vertex."""
    C, areas = cotangent_matrix(vertices, faces)
    mean_area = float(areas.mean()) if len(areas) else 1.0
    return sparse.csc_array(mean_area * (C @ _inverse_diagonal(areas) @ C))


def path_energy(frames: int) -> sparse.csc_array:
    """Lᵀ L of a path: each frame against the mean of the ones before and after it, (T, T)."""
    return squared(path_laplacian(frames))


def path_laplacian(frames: int) -> sparse.csr_array:
    """L = I - D⁻¹ A of a path; the first and the last frame have one neighbour, (T, T)."""
    # Not by eye_array: SciPy 1.13 knows no diagonal beside that of a single frame.
    later = np.arange(1, frames)
    before = sparse.coo_array((np.ones(len(later)), (later, later - 1)), shape=(frames, frames))
    return random_walk(sparse.csr_array(before + before.T))


def random_walk(A: sparse.csr_array) -> sparse.csr_array:
    """L = I - D⁻¹ A of a graph's adjacency matrix A; zero where a point is alone, (N, N)."""
    degrees = np.asarray(A.sum(axis=1), dtype=np.float64)
    joined = sparse.diags_array((degrees > 0).astype(np.float64))
    return sparse.csr_array(joined - _inverse_diagonal(degrees) @ A)


def cotangent_matrix(vertices: FloatArray, faces: IntArray) -> tuple[sparse.csc_array, FloatArray]:
    """The cotangent matrix C (V, V), positive semidefinite, and the area of each vertex (V,).

    On the intrinsic Delaunay triangulation of the surface (Sharp and Crane 2020), whose weights
    are never negative and which may have edges of three faces. Vertices that no face uses get zero.
    """
    used = np.unique(faces)
    stiffness, mass = robust_laplacian.mesh_laplacian(vertices[used], np.searchsorted(used, faces))
    S = sparse.eye_array(len(vertices), format="csc")[:, used]  # the used among all
    return sparse.csc_array(S @ stiffness @ S.T), np.asarray(S @ mass.diagonal())


def squared(L: sparse.csr_array | sparse.csc_array) -> sparse.csc_array:
    """Lᵀ L."""
    return sparse.csc_array(L.T @ L)


def _inverse_diagonal(values: FloatArray) -> sparse.dia_array:
    """1 / values on the diagonal, and 0 where a value is 0."""
    inverse = np.divide(1.0, values, out=np.zeros_like(values), where=values > 0)
    return sparse.diags_array(inverse)

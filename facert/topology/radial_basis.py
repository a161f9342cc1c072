"""Scattered data interpolation by radial basis functions, the paper's baseline [16].

The interpolant of values at M labels p_j is Σ_j w_j φ(|x - p_j|) + c + v·x, met exactly at the
labels, with Σ_j w_j = 0 and Σ_j w_j p_j = 0. It is linear in the values. φ is r, with c alone, or
r² log r, with the affine part, which is reduced to the directions that the labels span: across
those, nothing is known of v.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from scipy.spatial.distance import cdist, pdist

from facert.data.arrays import FloatArray, IntArray
from facert.data.memory import FLOAT, require_memory
from facert.errors import InputError
from facert.models.threads import one_thread
from facert.topology.solution import Dense

RadialFunction = Literal["linear", "thin_plate_spline"]

FLAT = 1e-5  # share of the largest singular value: below, points do not extend along a direction
SAME = 1e-7  # of the extent of the labels: nearer ones are at one place


def radial_basis(X: FloatArray, labelled: IntArray, kernel: RadialFunction) -> Dense:
    """Interpolation from the labelled points to all, by Euclidean distance.

    Parameters
    ----------
    X : array, shape (N, D)
        Source points.
    labelled : array of int, shape (M,)
    kernel : {"linear", "thin_plate_spline"}

    Raises
    ------
    InputError
        When labels are at one place, or fewer than an affine map of the points has freedoms.
    """
    require_memory(3 * FLOAT * len(X) * len(labelled), "labels", "Give fewer.")
    places = X[labelled] - X[labelled].mean(axis=0)
    size = float(np.linalg.norm(places, axis=1).max()) or 1.0
    if pdist(places).min(initial=np.inf) <= SAME * size:
        raise InputError(
            "labels", "different places", "two at one place", "Use a method of the framework."
        )
    X, places = (X - X[labelled].mean(axis=0)) / size, places / size
    if kernel == "linear":
        bases, affine = cdist(X, places), np.ones((len(X), 1))
    else:
        needed = len(spanned_directions(X - X.mean(axis=0))) + 1
        if len(places) < needed:
            raise InputError(
                "labels",
                f"{needed} or more, as the points span space",
                f"{len(places)}",
                "Add labels, or use rbf-linear.",
            )
        squared = cdist(X, places, "sqeuclidean")
        bases = 0.5 * squared * np.log(np.maximum(squared, np.finfo(np.float64).tiny))
        affine = np.column_stack([np.ones(len(X)), X @ spanned_directions(places).T])
    M, parts = len(places), affine.shape[1]
    system = np.zeros((M + parts, M + parts))
    system[:M] = np.column_stack([bases[labelled], affine[labelled]])
    system[M:, :M] = affine[labelled].T
    weights = np.linalg.solve(system, np.eye(M + parts, M))
    with one_thread():
        return Dense(bases @ weights[:M] + affine @ weights[M:])


def spanned_directions(points: FloatArray) -> FloatArray:
    """An orthonormal basis of the directions along which centred points extend, (r, D)."""
    _, extent, directions = np.linalg.svd(points, full_matrices=False)
    return np.asarray(directions[extent > FLAT * extent.max(initial=0.0)])

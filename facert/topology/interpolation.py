"""Scattered data interpolation: radial basis functions, the paper's baseline [16]."""

from __future__ import annotations

from typing import Literal

import numpy as np
from scipy.interpolate import RBFInterpolator

from facert.data.arrays import FloatArray, IntArray
from facert.errors import InputError
from facert.topology.solution import Dense

Kernel = Literal["linear", "thin_plate_spline"]


def radial_basis(X: FloatArray, labelled: IntArray, kernel: Kernel) -> Dense:
    """Interpolate from the labelled points by Euclidean distance.

    With the linear kernel a constant is added, with the thin-plate one an affine map.

    Parameters
    ----------
    X : array, shape (N, D)
        Source points.
    labelled : array of int, shape (M,)
    kernel : {"linear", "thin_plate_spline"}

    Raises
    ------
    InputError
        When labels are at one place, or too few or too flat for the affine map.
    """
    places = X[labelled]
    if len(np.unique(places, axis=0)) < len(places):
        raise InputError(
            "labels", "different places", "two at one place", "Use a method of the framework."
        )
    try:
        found = RBFInterpolator(places, np.eye(len(places)), kernel=kernel)(X)
    except (ValueError, np.linalg.LinAlgError) as error:
        raise InputError(
            "labels",
            f"{X.shape[1] + 1} or more that span space",
            f"{len(places)}",
            "Add labels, or use rbf-linear.",
        ) from error
    return Dense(np.asarray(found))

"""How well some markers predict controls, told by the labels alone."""

from __future__ import annotations

import numpy as np

from facert.data.arrays import FloatArray
from facert.models.loo import KernelRidge
from facert.models.whitening import whitening

POWER = 0.5  # half-whitening of the markers
RIDGE = 0.1  # relative to the mean variance of their features
FREE = 10.0  # variance of the constant, relative to the same


def left_out_errors(frames: FloatArray, labelled: FloatArray, poses: FloatArray) -> FloatArray:
    """Mean squared error of ridge regression at labels left out, relative to a control's variance.

    The kernel is linear in half-whitened features.

    Parameters
    ----------
    frames : array, shape (n, d)
        All frames of some markers, complete, in any unit; they tell the features.
    labelled : array, shape (l, d)
        Those with a pose.
    poses : array, shape (l, P)

    Returns
    -------
    array, shape (P,)
        1 for controls that never move, and where no marker does.
    """
    if not frames.shape[1]:
        return np.ones(poses.shape[1])
    features = (labelled - labelled.mean(axis=0)) @ whitening(frames, POWER)
    K, Y = features @ features.T, poses - poses.mean(axis=0)
    scale, variances = float(np.trace(K)) / len(K), np.sum(Y**2, axis=0)
    if not scale > 0.0:
        return np.ones(poses.shape[1])
    errors = np.sum(KernelRidge.of(K / scale + FREE, Y).errors(RIDGE) ** 2, axis=0)
    moves = variances > 0.0
    return np.where(moves, errors, 1.0) / np.where(moves, variances, 1.0)

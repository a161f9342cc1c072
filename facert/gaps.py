"""Filling what was not observed in a set of frames from what was."""

from __future__ import annotations

import numpy as np

from facert.data import FloatArray

ITERATIONS = 5
RIDGE = 1e-6  # relative to the mean variance


def fill_gaps(X: FloatArray) -> FloatArray:
    """Replace every NaN by its conditional mean under a Gaussian fitted to all frames.

    A few steps of expectation maximisation (Little and Rubin 2002, section 11.2): fill, estimate
    mean and covariance (with the fill's own covariance added), fill again.

    Parameters
    ----------
    X : array, shape (n, d)
        Frames; NaN: not observed. Every column has at least one observation.

    Returns
    -------
    array, shape (n, d)
        X itself where it is complete; observed values are never changed.
    """
    missing = np.isnan(X)
    if not missing.any():
        return X
    patterns, members = np.unique(missing, axis=0, return_inverse=True)
    filled = np.where(missing, np.nanmean(X, axis=0), X)
    extra = np.diag(np.zeros(X.shape[1]))
    for _ in range(ITERATIONS):
        mean = filled.mean(axis=0)
        covariance = np.cov(filled, rowvar=False, bias=True) + extra / len(X)
        covariance[np.diag_indices_from(covariance)] += RIDGE * np.trace(covariance) / len(mean)
        extra = np.zeros_like(covariance)
        for index, hidden in enumerate(patterns):
            if not hidden.any():
                continue
            rows = np.flatnonzero(members == index)
            seen = ~hidden
            gain = np.linalg.solve(covariance[np.ix_(seen, seen)], covariance[np.ix_(seen, hidden)])
            known = filled[np.ix_(rows, seen)] - mean[seen]
            filled[np.ix_(rows, hidden)] = mean[hidden] + known @ gain
            residual = covariance[np.ix_(hidden, hidden)] - covariance[np.ix_(hidden, seen)] @ gain
            extra[np.ix_(hidden, hidden)] += len(rows) * residual
    return filled

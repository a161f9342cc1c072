"""Shrinkage of predictions towards likely poses.

Of the poses, the labels tell a regression f from the source; the others tell which poses are likely
at all. Let ȳ and C be mean and covariance of all poses, and let R hold the mean squared error of f
for each control, as found by leaving each label out. To a prediction p = y + e with e ~ N(0, R),
the most probable pose under y ~ N(ȳ, C) is

    y = ȳ + C (C + R)⁻¹ (p - ȳ):

controls that f predicts badly are told by those that it predicts well. The leave-one-out errors of
a Gaussian process are known in closed form, (K⁻¹Y)_i / (K⁻¹)_ii (Rasmussen and Williams 2006, Eq.
5.12).
"""

from __future__ import annotations

import numpy as np

from facert.data import FloatArray

# Added to the covariance of all poses, relative to its mean variance: few poses leave it singular.
RIDGE = 1e-6


def shrinkage(poses: FloatArray, errors: FloatArray) -> FloatArray:
    """(C + R)⁻¹ C, to be applied to rows of predictions less the mean pose.

    Parameters
    ----------
    poses : array, shape (n, d_y)
        All poses that are known.
    errors : array, shape (l, d_y)
        What the regression missed each label by when that label was left out.

    Returns
    -------
    array, shape (d_y, d_y)
    """
    C = np.atleast_2d(np.cov(poses, rowvar=False, bias=True))
    R = np.diag(np.mean(errors**2, axis=0) + RIDGE * np.trace(C) / len(C))
    return np.linalg.solve(C + R, C).astype(np.float64)

"""A process without some of its labels: fold after fold from one decomposition.

Let P = K⁻¹ be the inverse of the kernel of all labels, and r their poses less the pose that is
expected before any is seen. Without the labels B, the process of the same kernel has the weights

    α = P r - P_·B (P_BB)⁻¹ (P r)_B,

which are 0 at B (the inverse of a part of K, from that of the whole; of one label, Rasmussen and
Williams 2006, section 5.4.2). So folds need no factor of their own, and as they share the labels,
their poses are one product of one kernel.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from scipy.linalg import solve

from facert.data.arrays import FloatArray, IntArray
from facert.methods.processes import FeatureProcess, ProcessMap

Poses = Callable[[FloatArray], FloatArray]


def held_out(process: FeatureProcess, folds: Sequence[IntArray], means: FloatArray) -> Poses:
    """The process without the labels of each fold.

    Parameters
    ----------
    process : FeatureProcess
        Of all n labels.
    folds : sequence of array of int, length f
        Labels that are left out.
    means : array, shape (f, d_y)
        The pose that is expected before any label is seen, without those of the fold.

    Returns
    -------
    function
        From frames (T, d_x) to poses (f, T, d_y).
    """
    whole, shifts = process.process, process.mean - means
    # The folds' poses side by side are those of one process.
    targets = np.hstack([whole.Y + shift for shift in shifts])
    together = ProcessMap(whole.X, targets, whole.theta)
    solved_one = whole.whitening @ whole.whitening.sum(axis=0)  # P 1, as P = W Wᵀ
    weights = [
        _without(whole.alpha + np.outer(solved_one, shift), whole.whitening, fold)
        for shift, fold in zip(shifts, folds, strict=True)
    ]
    vars(together)["alpha"] = np.hstack(weights)
    side_by_side = FeatureProcess(process.centre, process.basis, means.ravel(), together)

    def poses(X: FloatArray) -> FloatArray:
        found = side_by_side(X)[0]
        return found.reshape(len(X), *means.shape).swapaxes(0, 1)

    return poses


def _without(solved: FloatArray, W: FloatArray, fold: IntArray) -> FloatArray:
    """α without the labels of a fold, (n, d_y), from P r and from W (n, n) with P = W Wᵀ."""
    own = W[fold]
    left = solve(own @ own.T, solved[fold], assume_a="pos")
    weights = np.asarray(solved - W @ (own.T @ left))
    weights[fold] = 0.0  # but for rounding they are
    return weights

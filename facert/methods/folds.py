"""Cross-validation over the labels."""

from __future__ import annotations

import numpy as np

from facert.data.arrays import FloatArray, IntArray

FOLDS = 5


def blocked_folds(count: int) -> list[tuple[IntArray, IntArray]]:
    """Training and test rows of each fold.

    Labelled frames come in the order of time, and neighbours in time are alike: each fold takes a
    run of them away, so that a method cannot score by remembering the frame next door.
    """
    rows = np.arange(count)
    return [(np.setdiff1d(rows, run), run) for run in np.array_split(rows, min(FOLDS, count))]


def ranked_folds(X: FloatArray) -> list[tuple[IntArray, IntArray]]:
    """Training and test rows of each fold, whatever the order of the frames X (l, d_x).

    Ranked by their distance from the mean, frames go to the folds in turn: each fold holds calm
    and extreme ones, and none has all the extremes to predict from calm ones.
    """
    ranks = np.argsort(np.sum((X - X.mean(axis=0)) ** 2, axis=1), kind="stable")
    folds = min(FOLDS, len(X))
    return [
        (np.sort(np.delete(ranks, slice(fold, None, folds))), np.sort(ranks[fold::folds]))
        for fold in range(folds)
    ]

"""Cross-validation over the labels, in blocks of time."""

from __future__ import annotations

import numpy as np
from sklearn.model_selection import KFold

from facert.data import IntArray

FOLDS = 5


def blocked_folds(count: int) -> list[tuple[IntArray, IntArray]]:
    """Training and test rows of each fold.

    Labelled frames come in the order of time, and neighbours in time are alike: each fold takes a
    run of them away, so that a method cannot score by remembering the frame next door.
    """
    return list(KFold(min(FOLDS, count)).split(np.empty(count)))

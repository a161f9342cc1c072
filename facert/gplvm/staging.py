"""Where the training of a large set begins: at a small one of the same take.

A few rows of each view, the core, are trained as the paper does, exactly. The others then find
their places by source mapping (9), each in the view that it shows: frames by the source view, poses
by the target view in the same manner. Begun there, the large model needs few iterations; begun at
coordinates of all rows at once it needs hundreds, and with thousands of rows they have been seen to
end worse than the core alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from facert.data import FloatArray, IntArray
from facert.gp.posterior import Predictor
from facert.gplvm.module import SharedGPLVM
from facert.gplvm.source_mapping import Observation, SourceMapping

# Rows of a core: labels at most, and unlabelled rows of each view.
CORE_LABELS, CORE_ALONE = 400, 100


@dataclass(frozen=True, eq=False)
class Core:
    """Rows of both views, labelled ones first.

    Parameters
    ----------
    rows_x, rows_y : arrays of int
        Rows of X and of Y.
    labelled : int
        How many of them, in front of either, are labelled.
    """

    rows_x: IntArray
    rows_y: IntArray
    labelled: int

    @classmethod
    def of(cls, X: FloatArray, Y: FloatArray, labelled: int) -> Core:
        """Labelled rows and others, evenly along either view."""
        labels = spread(0, labelled, CORE_LABELS)
        rows_x, rows_y = (
            np.concatenate([labels, spread(labelled, len(view), CORE_ALONE)]) for view in (X, Y)
        )
        return cls(rows_x, rows_y, len(labels))

    def is_all_of(self, X: FloatArray, Y: FloatArray) -> bool:
        """Whether there are no others."""
        return len(self.rows_x) == len(X) and len(self.rows_y) == len(Y)


def spread(first: int, end: int, most: int) -> IntArray:
    """The integers from `first` to below `end`, or so many of them at even distances."""
    count = min(most, end - first)
    return first + (np.arange(count) * (end - first)) // max(count, 1)


def placed(
    module: SharedGPLVM, X: FloatArray, Y: FloatArray, labelled: int, core: Core
) -> FloatArray:
    """Latent coordinates of all rows, as a trained core sees them.

    Parameters
    ----------
    module : SharedGPLVM
        Trained on the rows of the core.
    X : array, shape (l + m, d_x)
        Source view, labelled rows first.
    Y : array, shape (l + n, d_y)
        Target view in the same manner.
    labelled : int
        l.
    core : Core

    Returns
    -------
    array, shape (l + m + n, q)
        A labelled row outside of the core is placed by its source.
    """
    Z_x = _mapped(module.source_posterior(X[core.rows_x]), X)
    Z_y = _mapped(module.target_posterior(Y[core.rows_y]), Y)
    Z_x[core.rows_x], Z_y[core.rows_y] = module.latents_x, module.latents_y
    return np.vstack([Z_x, Z_y[labelled:]])


def _mapped(posterior: Predictor, observations: FloatArray) -> FloatArray:
    """Latent positions of observations (n, d) that are as noisy as the view's."""
    observed = Observation.of(observations, posterior.kernel.noise**0.5)
    return SourceMapping(posterior).solve(observed).z

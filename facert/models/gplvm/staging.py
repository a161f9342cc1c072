"""Training that begins at a trained model, in place of the alignment of both views.

That may be the model of a moment ago, to which a label was added. And for a large set it is a small
one of the same take: a few rows of each view, the core, are trained as the paper does, exactly.
Rows that the model does not know find their places by source mapping (9), each in the view that it
shows: frames by the source view, poses by the target view in the same manner. Begun there, few
iterations are needed; a large set begun at coordinates of all rows at once needs hundreds, and with
thousands of rows they have been seen to end worse than the core alone.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.distance import cdist

from facert.data.arrays import FloatArray, IntArray
from facert.data.normalisation import Normalisation
from facert.models.gp.posterior import Posterior, Predictor
from facert.models.gplvm.source_mapping import Observation, SourceMapping
from facert.models.kernels import Kernel

# Rows of a core: labels at most, and unlabelled rows of each view.
CORE_LABELS, CORE_ALONE = 400, 100
# Rows no further apart are the same frame: arithmetic in other units rounds, normalised units.
SAME = 1e-6


@dataclass(frozen=True, eq=False)
class Core:
    """Rows of both views, labelled ones first."""

    # Rows of X and of Y
    rows_x: IntArray
    rows_y: IntArray
    labelled: int  # How many of them, in front of either, are labelled

    @classmethod
    def of(cls, X: FloatArray, Y: FloatArray, labelled: int) -> Core:
        """Labelled rows and others, evenly along either view."""
        labels = spread(0, labelled, CORE_LABELS)
        rows_x, rows_y = (
            np.concatenate([labels, spread(labelled, len(view), CORE_ALONE)]) for view in (X, Y)
        )
        return cls(rows_x, rows_y, len(labels))

    def is_all_of(self, X: FloatArray, Y: FloatArray) -> bool:
        """Whether the core holds every row of both views."""
        return len(self.rows_x) == len(X) and len(self.rows_y) == len(Y)


def spread(first: int, end: int, most: int) -> IntArray:
    """The integers from `first` to below `end`, or so many of them at even distances."""
    count = min(most, end - first)
    return first + (np.arange(count) * (end - first)) // max(count, 1)


@dataclass(frozen=True, eq=False)
class TrainedViews:
    """A trained model, where another one of the same character begins."""

    # Its views
    source: Predictor
    target: Predictor
    # Units of the other model, relative to those of the views
    source_units: Normalisation
    target_units: Normalisation

    @classmethod
    def at(cls, source: Predictor, target: Predictor) -> TrainedViews:
        """Trained views whose units are those of the new model."""
        same = (Normalisation(np.zeros(view.columns), 1.0) for view in (source, target))
        return cls(source, target, *same)

    @property
    def latent_dim(self) -> int:
        """Number of latent dimensions q."""
        return int(self.source.Z.shape[1])

    @property
    def kernels(self) -> tuple[Kernel, Kernel]:
        """Kernels of source and target, in the units of the other model."""
        return (
            _divided(self.source.kernel, self.source_units.scale),
            _divided(self.target.kernel, self.target_units.scale),
        )

    def latents(self, X: FloatArray, Y: FloatArray, labelled: int) -> FloatArray:
        """Latent coordinates of all rows of the other model.

        Parameters
        ----------
        X : array, shape (l + m, d_x)
            Source view, labelled rows first.
        Y : array, shape (l + n, d_y)
            Target view in the same manner.
        labelled : int
            l.

        Returns
        -------
        array, shape (l + m + n, q)
            Rows that the model was trained on stay where they are; others are where it sees them,
            labelled ones by their source.
        """
        Z_x = _found(self.source, self.source_units.undo(X))
        Z_y = _found(self.target, self.target_units.undo(Y[labelled:]))
        return np.vstack([Z_x, Z_y])


def _divided(kernel: Kernel, unit: float) -> Kernel:
    """The kernel of observations that are divided by `unit`."""
    return replace(kernel, variance=kernel.variance / unit**2, noise=kernel.noise / unit**2)


def _found(view: Predictor, observations: FloatArray) -> FloatArray:
    """Latent positions of observations (n, d), by (9) where the view does not know them.

    They are taken to be as noisy as the view.
    """
    Z = np.empty((len(observations), view.Z.shape[1]))
    unknown = np.ones(len(observations), dtype=np.bool_)
    if isinstance(view, Posterior) and len(observations):
        away = cdist(observations, view.X, "sqeuclidean")
        rows = away.argmin(axis=1)
        unknown = away.min(axis=1) > SAME**2
        Z[~unknown] = view.Z[rows[~unknown]]
    if unknown.any():
        observed = Observation.of(observations[unknown], view.kernel.noise**0.5)
        Z[unknown] = SourceMapping(view).solve(observed).z
    return Z

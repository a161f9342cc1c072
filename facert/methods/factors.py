"""Poses by the factors that frames and poses share, see `facert.models.factors.factor_analysis`."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np

from facert.data.array_group import DAMAGED
from facert.data.arrays import FloatArray
from facert.errors import InputError
from facert.methods.base import Labelled, Unlabelled, stacked
from facert.methods.regression import Map, Variance
from facert.models.factors.censoring import CensoringLimits, ClippedMean
from facert.models.factors.factor_analysis import FactorData, learn_factors

HUGE = 1e150  # its square is finite


@dataclass(frozen=True, eq=False)
class FactorMap(Map):
    """The pose that the factors predict: a linear map, and what limits leave of it."""

    centre: Annotated[FloatArray, "x"]  # (d_x,): Mean of all frames
    weights: Annotated[FloatArray, "xy"]  # (d_x, d_y)
    # (d_y,): The free pose of the mean frame, and the standard deviation of every free pose
    offset: Annotated[FloatArray, "y"]
    spread: Annotated[FloatArray, "y"]
    # (2, d_y): Lower and upper limits, and 1 where poses pile up there, else 0
    limits: Annotated[FloatArray, "2y"]
    censored: Annotated[FloatArray, "2y"]

    def __post_init__(self) -> None:
        super().__post_init__()
        if not ((self.spread > 0.0) & (self.spread < HUGE)).all():
            raise InputError("factors.spread", "positive numbers", "others", DAMAGED)

    @classmethod
    def learn(cls, labelled: Labelled, unlabelled: Unlabelled, guess: FloatArray) -> FactorMap:
        """The factors of labelled frames, frames and poses.

        Parameters
        ----------
        labelled, unlabelled : Labelled, Unlabelled
        guess : array, shape (m, d_y)
            Poses of the frames without one, at which the search begins.
        """
        frames, poses = stacked(labelled, unlabelled)
        centre, mean, limits = frames.mean(axis=0), poses.mean(axis=0), CensoringLimits.of(poses)
        data = FactorData(
            labelled.X - centre,
            labelled.Y - mean,
            unlabelled.X - centre,
            unlabelled.Y - mean,
            CensoringLimits(limits.low - mean, limits.high - mean),
        )
        factors = learn_factors(data, guess - mean)
        weights, spread = factors.regression()
        bounds = np.stack([limits.low, limits.high])
        censored = np.isfinite(bounds)
        return cls(
            centre=centre,
            weights=weights,
            offset=mean + factors.mean,
            spread=spread,
            limits=np.where(censored, bounds, 0.0),
            censored=censored.astype(np.float64),
        )

    def __call__(self, X: FloatArray) -> tuple[FloatArray, Variance]:
        """Poses of frames X (T, d_x), (T, d_y), and the variance of the free ones."""
        free = X @ self.weights
        free += self._offset
        return self._clipped(free), lambda: np.repeat(self.spread[None] ** 2, len(X), axis=0)

    @cached_property
    def _offset(self) -> FloatArray:
        """The free pose of the frame 0, (d_y,)."""
        return np.asarray(self.offset - self.centre @ self.weights)

    @cached_property
    def _clipped(self) -> ClippedMean:
        low, high = np.where(self.censored > 0, self.limits, [[-np.inf], [np.inf]])
        return ClippedMean(CensoringLimits(low, high), self.spread)

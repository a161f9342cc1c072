"""Poses by the factors that frames and poses share, and what begins their search.

The search of `facert.models.factors` begins at what two Gaussian processes on the labels say, on
the source as it is and on half-whitened features: clean captures want the one, real markers the
other, and their mean serves all. No closed form tells what factors would say of a label left out:
they are learned five times more, each time without a fifth of the labels, and the processes with
them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from facert.data.array_group import DAMAGED
from facert.data.arrays import FloatArray
from facert.errors import InputError
from facert.methods.base import Labelled, Unlabelled
from facert.methods.folds import ranked_folds
from facert.methods.regression import Map
from facert.methods.ssgpr import Basis, FeatureProcess
from facert.models.factors.censoring import Limits
from facert.models.factors.model import Evidence, learn_factors

HUGE = 1e150  # its square is finite


@dataclass(frozen=True, eq=False)
class FactorMap(Map):
    """What the factors say about a frame's pose: a linear map, and what limits leave of it.

    Parameters
    ----------
    centre : array, shape (d_x,)
        Mean of all frames.
    weights : array, shape (d_x, d_y)
    offset, spread : arrays, shape (d_y,)
        The free pose of the mean frame, and the standard deviation of every free pose.
    limits, censored : arrays, shape (2, d_y)
        Lower and upper limits, and 1 where poses pile up there, else 0.
    """

    axes: ClassVar[Mapping[str, str]] = {
        "centre": "x",
        "weights": "xy",
        "offset": "y",
        "spread": "y",
        "limits": "2y",
        "censored": "2y",
    }

    centre: FloatArray
    weights: FloatArray
    offset: FloatArray
    spread: FloatArray
    limits: FloatArray
    censored: FloatArray

    def __post_init__(self) -> None:
        super().__post_init__()
        if not ((self.spread > 0.0) & (self.spread < HUGE)).all():
            raise InputError("factors.spread", "positive numbers", "others", DAMAGED)

    def __call__(self, X: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Poses of frames X (T, d_x), (T, d_y), and the standard deviation of the free ones."""
        free = self.offset + (X - self.centre) @ self.weights
        pose = self._limits.expected(free, self.spread)
        return pose, np.repeat(self.spread[None], len(X), axis=0)

    @cached_property
    def _limits(self) -> Limits:
        low, high = self.limits
        at_low, at_high = self.censored > 0
        return Limits(np.where(at_low, low, -np.inf), np.where(at_high, high, np.inf))


@dataclass(frozen=True, eq=False)
class Trio:
    """Three maps learned from the same data: two processes, and the factors begun at them."""

    plain: FeatureProcess
    whitened: FeatureProcess
    factors: FactorMap

    @classmethod
    def learn(cls, labelled: Labelled, unlabelled: Unlabelled) -> Trio:
        """From labelled frames, frames and poses."""
        frames = np.vstack([labelled.X, unlabelled.X])
        poses = np.vstack([labelled.Y, unlabelled.Y])
        mean = poses.mean(axis=0)
        plain = FeatureProcess.learn(labelled, Basis.plain(frames), mean)
        whitened = FeatureProcess.learn(labelled, Basis.half_whitened(frames), mean)
        guess = (plain(unlabelled.X)[0] + whitened(unlabelled.X)[0]) / 2.0
        centre, limits = frames.mean(axis=0), Limits.of(poses)
        evidence = Evidence(
            labelled.X - centre,
            labelled.Y - mean,
            unlabelled.X - centre,
            unlabelled.Y - mean,
            Limits(limits.low - mean, limits.high - mean),
        )
        factors = learn_factors(evidence, guess - mean)
        weights, spread = factors.regression()
        bounds = np.stack([limits.low, limits.high])
        censored = np.isfinite(bounds)
        linear = FactorMap(
            centre=centre,
            weights=weights,
            offset=mean + factors.mean,
            spread=spread,
            limits=np.where(censored, bounds, 0.0),
            censored=censored.astype(np.float64),
        )
        return cls(plain, whitened, linear)

    @property
    def maps(self) -> Sequence[Map]:
        """All three."""
        return self.plain, self.whitened, self.factors


def left_out_poses(labelled: Labelled, unlabelled: Unlabelled) -> FloatArray:
    """What each map of a trio says of labels that it was not given, (3, l, d_y).

    The frames stay, without their poses.
    """
    said = np.empty((3, *labelled.Y.shape))
    for train, test in ranked_folds(labelled.X):
        rest = Labelled(labelled.X[train], labelled.Y[train])
        frames = np.vstack([unlabelled.X, labelled.X[test]])
        trio = Trio.learn(rest, Unlabelled(frames, unlabelled.Y))
        said[:, test] = [map_(labelled.X[test])[0] for map_ in trio.maps]
    return said

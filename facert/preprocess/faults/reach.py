"""Values far beyond all that a training take showed, by each frame alone, as live streams need."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from facert.data.arrays import BoolArray, FloatArray
from facert.data.blocks import spread
from facert.data.normalisation import Normalisation
from facert.data.take import SourceKind
from facert.preprocess.faults.absurd import LOOKED_AT, NATURAL, REACH
from facert.preprocess.faults.quantiles import median

SPREAD = 4.0
"""Times the largest standard deviation in training, that a marker may go beside the face's size."""
LEAST = 12.0
"""The same for weights, at least: they may have rested in training."""


@dataclass(frozen=True)
class Reach:
    """How far values may be from where they were in training, in normalised units."""

    kind: SourceKind
    limit: float

    @classmethod
    def of(cls, units: Normalisation, kind: SourceKind) -> Reach:
        """The reach of markers, by the size of the face, or of weights, by what they count."""
        if kind == "weights":
            unit = NATURAL[0] if units.scale <= NATURAL[0] else NATURAL[1]
            return cls(kind, max(REACH * unit / units.scale, LEAST))
        places = units.mean.reshape(-1, 3)
        places = places[spread(len(places), LOOKED_AT)]
        size = float(np.median(np.linalg.norm(places[:, None] - places, axis=2)))
        return cls(kind, size / units.scale + SPREAD)

    def beyond(self, frames: FloatArray) -> BoolArray | None:
        """Mask of what is beyond it in normalised frames (n, d), of the same shape; None: nothing.

        Markers are compared with the others: a head may be elsewhere. Where most are beyond it,
        units or origin differ, and none is in the mask.
        """
        far = np.abs(frames) > self.limit
        if not far.any():  # as nearly always
            return None
        if self.kind == "markers":
            places = frames.reshape(len(frames), -1, 3)
            away = np.abs(places - median(places.transpose(0, 2, 1))[:, None])
            far = np.repeat((away > self.limit).any(axis=2), 3, axis=1)
        most = 2 * far.sum(axis=1) > (~np.isnan(frames)).sum(axis=1)
        far[most] = False
        return far if far.any() else None

"""The actor at rest: the same expression in the recording that was learned from and in another.

Markers are stuck on anew, a tracker is calibrated anew; the difference at rest is taken out before
frames are mapped. Weights are bounded: where they rest below a half, their rest is moved and what
is above it stretched, so that a closed lid stays a closed lid.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass

import numpy as np

from facert.data.arrays import FloatArray, IntArray
from facert.data.take import SourceKind
from facert.errors import InputError

log = logging.getLogger(__name__)

RESTLESS = 0.3
"""Motion of this share of the take's is no rest."""
FULL = 1.0
"""A weight that is fully there."""


@dataclass(frozen=True, eq=False)
class Calibration:
    """A map of frames to the training recording, by the actor at rest in both."""

    # (d,): The actor at rest, where a weight's motion begins; infinite where it is only moved
    turn: FloatArray
    shift: FloatArray  # (d,): How far the rest is moved
    stretch: FloatArray  # (d,): By how much what is above `turn` is stretched, less 1

    @classmethod
    def of(cls, own: FloatArray, learned: FloatArray, kind: SourceKind) -> Calibration:
        """The calibration by the actor at rest in this and in that recording.

        Parameters
        ----------
        own, learned : array, shape (d,)
            NaN: not known, nothing is changed.
        kind : {"markers", "weights"}
        """
        shift = np.nan_to_num(learned - own)
        if kind == "markers":
            return cls(np.full_like(shift, np.inf), shift, np.zeros_like(shift))
        own = np.where(np.isnan(own) | np.isnan(learned), 0.0, own)
        # Angles of eyes and head may be anywhere at rest; they are moved, and nothing more.
        bounded = (own >= 0.0) & (np.maximum(own, own + shift) < FULL / 2.0)
        room = FULL - np.where(bounded, own, 0.0)
        return cls(np.where(bounded, own, np.inf), shift, np.where(bounded, -shift / room, 0.0))

    def apply(self, X: FloatArray) -> FloatArray:
        """Frames (T, d) or one of them, (d,); NaN stays."""
        return np.asarray(X + self.shift + np.maximum(X - self.turn, 0.0) * self.stretch)


def at_rest(X: FloatArray, frames: IntArray) -> FloatArray:
    """Mean of the frames named as neutral, (d,); NaN where none of them shows anything.

    Raises
    ------
    InputError
        When the frames are not all there.
    """
    if not len(frames) or frames.min() < 0 or frames.max() >= len(X):
        found = "none" if not len(frames) else f"{frames.min()} to {frames.max()}"
        raise InputError(
            "neutral", f"frames from 0 to {len(X) - 1}", found, "Name frames of this take."
        )
    motion, typical = X[frames].std(axis=0), np.nanstd(X, axis=0).max()
    if np.nanmax(motion, initial=0.0) > RESTLESS * typical:
        log.warning("the actor moves in the frames named as neutral: their mean is taken for rest")
    seen = ~np.isnan(X[frames])
    total = np.where(seen, X[frames], 0.0).sum(axis=0)
    return np.where(seen.any(axis=0), total / np.maximum(seen.sum(axis=0), 1), np.nan)


def median_at_rest(X: FloatArray, scale: float) -> FloatArray:
    """The median of frames in which the actor rests but may blink, (d,); NaN where none shows it.

    Parameters
    ----------
    X : array, shape (T, d)
        NaN: not observed.
    scale : float
        Standard deviation of a source in motion, in its units.
    """
    shown = ~np.isnan(X).all(axis=0)
    rest = np.full(X.shape[1], np.nan)
    rest[shown] = np.nanmedian(X[:, shown], axis=0)
    if np.nanmax(np.nanstd(X[:, shown], axis=0), initial=0.0) > RESTLESS * scale:
        log.warning("the actor moves when at rest: the median is taken for it")
    return rest


def most_neutral(poses: FloatArray) -> int:
    """The index of the pose, of (n, P), that is nearest to all controls at zero."""
    reach = np.maximum(np.abs(poses).max(axis=0), np.finfo(float).tiny)
    return int(np.square(poses / reach).sum(axis=1).argmin())

"""What of a performance no posed frame showed.

Posed frames tell a method what goes with what the face does in them. Anything else it guesses, and
the standard deviation of a pose hardly tells: it grows with the distance of a frame from the posed
ones, in which new motion of a lid is lost beside that of a jaw.

With A (l, d) the posed frames less their mean c, a frame x is taken for a sum of these with small
weights: of its deviation there is left

    r = (x - c) μ (AᵀA + μ I)⁻¹,      μ = λ tr(AᵀA) / l,

nothing where posed frames reach, and all of it where they never went. What is left of each marker
is compared with how much it moves in the training take, posed or not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from facert.data.arrays import FloatArray
from facert.data.take import SourceKind
from facert.preprocess.motion.motion import Motion

RIDGE = 0.1
"""λ: the smaller, the further posed frames are taken to reach beyond themselves."""
STILL = 0.3
"""Markers that move less, in normalised units, are taken to move so much: of skin and noise."""
NEW = 0.6
"""A frame is new when so much of the usual motion is left of it, root mean square over markers."""
WORTH_TELLING = 0.05
"""Of all frames."""
NAMED = 3
"""So many markers at most are named, those that show this share of what the first one does."""
ALIKE = 0.25


@dataclass(frozen=True, eq=False)
class Shown:
    """What a model was shown, in normalised units.

    Parameters
    ----------
    posed : array, shape (l, d)
        Posed frames, complete.
    variance : array, shape (d,)
        Of each column in the training take.
    """

    posed: FloatArray
    variance: FloatArray

    @classmethod
    def by(cls, posed: FloatArray, motion: Motion | None) -> Self:
        """By posed frames of a take that moves so; without a motion they stand for the take."""
        if motion is None:
            return cls(posed, posed.var(axis=0))
        factors = motion.factors
        return cls(posed, np.square(factors.weights).sum(axis=1) + factors.noise)

    def left(self, frames: FloatArray, kind: SourceKind) -> FloatArray:
        """What is left of each marker or weight, 1: as much as it usually moves.

        Parameters
        ----------
        frames : array, shape (T, d)
            Complete.
        kind : {"markers", "weights"}

        Returns
        -------
        array, shape (T, n)
        """
        size = 3 if kind == "markers" else 1
        lengths = np.linalg.norm(self._residual(frames).reshape(len(frames), -1, size), axis=2)
        motion = np.sqrt(self.variance.reshape(-1, size).sum(axis=1))
        return np.asarray(lengths / np.maximum(motion, STILL))

    def _residual(self, frames: FloatArray) -> FloatArray:
        """What is left, r, of frames (T, d)."""
        centre = self.posed.mean(axis=0)
        square = (self.posed - centre).T @ (self.posed - centre)
        ridge = max(RIDGE * float(np.trace(square)) / len(self.posed), np.finfo(np.float64).tiny)
        system = square / ridge + np.eye(len(square))
        return np.asarray(np.linalg.solve(system, (frames - centre).T).T)


@dataclass(frozen=True, eq=False)
class Novelty:
    """How much of a performance is new.

    Parameters
    ----------
    share : float
        Of the frames.
    where : sequence of str
        The markers or weights that show it most.
    """

    share: float
    where: Sequence[str]

    @classmethod
    def of(cls, left: FloatArray, names: Sequence[str]) -> Self:
        """From what is left of each marker or weight, (T, n); see `Shown.left`."""
        new = np.sqrt(np.mean(left**2, axis=1)) > NEW
        if not new.any():
            return cls(0.0, ())
        amounts = np.mean(left[new] ** 2, axis=0)
        first = np.argsort(-amounts, kind="stable")[:NAMED]
        where = [names[index] for index in first if amounts[index] >= ALIKE * amounts[first[0]]]
        return cls(float(new.mean()), where)

    def __str__(self) -> str:
        return (
            f"in {self.share:.0%} of the frames the face does what no posed frame showed "
            f"(mostly {', '.join(self.where)}): facert suggest --have MODEL names frames to pose"
        )

"""Whether the head stands where it stood in training, told from the first second of a session."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from facert.data.arrays import FloatArray
from facert.data.names import NameIndex
from facert.live.frames import Frame
from facert.live.rest import RestWatch
from facert.mesh.rigid import align, determined
from facert.preprocess.live_faults import MarkerWatch

if TYPE_CHECKING:
    from facert.retarget.retargeter import Retargeter

log = logging.getLogger("facert")

SECONDS = 1.0
FAR = 2.0
"""Times the largest standard deviation in training.

An expression moves the markers as a whole by 1.7 of it at most, in any second of the real takes
without head motion.
"""


@dataclass(frozen=True)
class Away:
    """How far markers as a whole are from where they were.

    Parameters
    ----------
    spread : float
        Root of the mean square of how far each is taken, in the markers' units.
    distance : float
        How far their centre is taken.
    degrees : float
    """

    spread: float
    distance: float
    degrees: float


def away(markers: FloatArray, neutral: FloatArray) -> Away | None:
    """The rigid motion from a neutral face to markers, (M, 3) each; None where too few are seen.

    What is NaN in one of them is not looked at.
    """
    seen = np.isfinite(markers).all(axis=1) & np.isfinite(neutral).all(axis=1)
    shape, points = neutral[seen], markers[None, seen]
    if not determined(shape, np.ones((1, len(shape)), bool))[0]:
        return None
    motion = align(shape, points, np.ones((1, len(shape))))
    moved = motion.apply(shape)[0] - shape
    spread = np.sqrt(np.square(moved).sum(axis=1).mean())
    distance = np.linalg.norm(moved.mean(axis=0))
    return Away(float(spread), float(distance), float(motion.degrees[0]))


class PlacementWatch:
    """Warns about markers in another place than in training.

    Small head motion looks like an expression and is not told.

    Parameters
    ----------
    retargeter : Retargeter
        Of markers.
    names : sequence of str
        Of the session's markers, length M.
    """

    def __init__(self, retargeter: Retargeter, names: Sequence[str]) -> None:
        self._retargeter = retargeter
        index = NameIndex(names)
        found = [(index.find(name), row) for row, name in enumerate(retargeter.source_names)]
        self._rows = [(theirs, ours) for theirs, ours in found if theirs is not None]
        self._first = RestWatch(SECONDS, MarkerWatch(len(names)))

    @property
    def is_over(self) -> bool:
        """Whether the time has passed."""
        return self._first.is_over

    def see(self, frame: Frame) -> None:
        """Keep a frame of the first second."""
        self._first.see(frame)

    def tell(self) -> None:
        """Warn if they are far."""
        theirs, ours = np.array(self._rows).T
        markers = self._first.rest(scale=np.inf)[theirs]
        found = away(markers, self._retargeter.neutral.reshape(-1, 3)[ours])
        if found is None or found.spread <= FAR * self._retargeter.source_units.scale:
            return
        log.warning(
            "the head is %.3g %s and %.0f degrees from where it was in training: check origin and "
            "units; take head motion out (facert stabilise), or use --neutral",
            found.distance,
            self._retargeter.units or "units",
            found.degrees,
        )

"""The first seconds of a session: the actor at rest, and whether the head stands as in training."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from facert.data.arrays import FloatArray
from facert.data.names import NameIndex
from facert.live.frames import Frame
from facert.mesh.rigid import align, determined
from facert.preprocess.faults import FaultDetector
from facert.preprocess.neutral import median_at_rest

if TYPE_CHECKING:
    from facert.retarget.retargeter import Retargeter

log = logging.getLogger("facert")

SECONDS = 1.0
"""Of the session's start from which the place of the head is known."""
FAR = 2.0
"""Times the largest standard deviation in training.

An expression moves the markers as a whole by 1.7 of it at most, in any second of the real takes
without head motion.
"""
HUGE = 1e100  # whatever the unit, no place: what others do with it would overflow


class RestWatch:
    """Collects the frames of the first seconds, in which the actor rests.

    Parameters
    ----------
    seconds : float
        Seconds to watch, from the session's first frame on.
    watch : FaultDetector, optional
        Finds the markers that are at fault: a lost one may be written as (0, 0, 0).
    """

    def __init__(self, seconds: float, watch: FaultDetector | None = None) -> None:
        self._seconds, self._watch = seconds, watch
        self._frames: list[FloatArray] = []
        self.is_over = False
        """Whether the time has passed."""

    def see(self, frame: Frame) -> None:
        """Keep a frame, unless the time has passed."""
        self.is_over = bool(self._frames) and frame.time >= self._seconds
        if self.is_over:
            return
        values = frame.values
        if self._watch is not None:
            values = np.where(self._watch.step(values)[:, None], np.nan, values)
        self._frames.append(values)

    def rest(self, scale: float) -> FloatArray:
        """The actor at rest, shape of a frame; NaN where nothing was observed, or nothing sensible.

        Parameters
        ----------
        scale : float
            The largest standard deviation of a dimension in training: who moves like that does not
            rest, which is warned about.
        """
        frames = np.array(self._frames)
        frames[np.abs(frames) > HUGE] = np.nan
        return median_at_rest(frames.reshape(len(frames), -1), scale).reshape(frames.shape[1:])


class Displacement(NamedTuple):
    """Distances and angle by which a rigid motion moves a face."""

    spread: float
    """Root mean square distance over the markers, in their units."""
    distance: float
    """How far their centre moves."""
    degrees: float


def displacement(markers: FloatArray, neutral: FloatArray) -> Displacement | None:
    """The rigid motion from a neutral face to markers, (M, 3) each; None where too few are seen.

    Markers that are NaN in one of them are left out.
    """
    seen = np.isfinite(markers).all(axis=1) & np.isfinite(neutral).all(axis=1)
    shape, ones = neutral[seen], np.ones((1, int(seen.sum())))
    if not determined(shape, ones > 0)[0]:
        return None
    motion = align(shape, markers[None, seen], ones)
    moved = motion.apply(shape)[0] - shape
    spread = np.sqrt(np.square(moved).sum(axis=1).mean())
    return Displacement(
        float(spread), float(np.linalg.norm(moved.mean(axis=0))), float(motion.degrees[0])
    )


class PlacementWatch(RestWatch):
    """Warns about markers in another place than in training.

    Small head motion looks like an expression and is passed over.

    Parameters
    ----------
    retargeter : Retargeter
        A retargeter of markers.
    names : sequence of str
        Names of the session's markers, length M.
    """

    def __init__(self, retargeter: Retargeter, names: Sequence[str]) -> None:
        super().__init__(SECONDS, FaultDetector(len(names)))
        self._retargeter = retargeter
        own = retargeter.source_names
        index = NameIndex.among(names, own, "/source/names", quiet=True)
        found = [(index.find(name), row) for row, name in enumerate(own)]
        self._rows = [(theirs, ours) for theirs, ours in found if theirs is not None]

    def warn(self) -> None:
        """Warn if the markers are far from where they were."""
        theirs, ours = np.array(self._rows).T
        markers = self.rest(scale=np.inf)[theirs]
        found = displacement(markers, self._retargeter.neutral.reshape(-1, 3)[ours])
        if found is None or found.spread <= FAR * self._retargeter.source_units.scale:
            return
        log.warning(
            "the head is %.3g %s and %.0f degrees from where it was in training: check origin and "
            "units; take head motion out (facert stabilise), or use --neutral",
            found.distance,
            self._retargeter.units or "units",
            found.degrees,
        )

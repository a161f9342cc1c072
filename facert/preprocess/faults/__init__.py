"""Faults of a source: values that a capture system wrote and that are not what the face did.

====================  ==========================================================================
markers               how it is detected
====================  ==========================================================================
absurd                a coordinate that no capture volume holds, or one and the same far away
zero                  a position of exactly (0, 0, 0): many systems write it for a lost marker
frozen                the very same position over frames in which the others move: a held value
swapped               two markers change places from one frame to the next, and would fit better
                      to the rest of the face where they were
strayed               a position too far from where the other markers put it for skin to go
spiked                a position off the line between the frames before and after, and as far off
                      where the rest of the face says that it should be
====================  ==========================================================================

====================  ==========================================================================
weights               how it is detected
====================  ==========================================================================
absurd                a value many times beyond the others of the take, or the same one, out of
                      their range, again and again
blank                 all weights alike, in frames that come and go with a jump, or at a number
                      where hardly any weight is otherwise: no face
====================  ==========================================================================

A fast motion, of the lids say, leaves the line too, but the markers around it predict it; an odd
pose surprises these, but lasts. A spike does both; and skin does not go as far as a stray.
"""

from __future__ import annotations

from facert.preprocess.faults.detector import HELD, FaultDetector
from facert.preprocess.faults.held import held_values
from facert.preprocess.faults.kinds import Faults
from facert.preprocess.faults.reach import Reach
from facert.preprocess.faults.search import find_faults, without_faults
from facert.preprocess.faults.spiked import single_spikes
from facert.preprocess.faults.strayed import far_from_expected
from facert.preprocess.faults.swapped import exchanged

__all__ = [
    "HELD",
    "FaultDetector",
    "Faults",
    "Reach",
    "exchanged",
    "far_from_expected",
    "find_faults",
    "held_values",
    "single_spikes",
    "without_faults",
]

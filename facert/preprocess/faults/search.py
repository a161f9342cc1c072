"""The search for faults of a take, and a take without them."""

from __future__ import annotations

import logging
from dataclasses import replace

import numpy as np

from facert.data.arrays import BoolArray
from facert.data.take import Source, Take
from facert.preprocess.cache import keep_last
from facert.preprocess.faults.held import held_values
from facert.preprocess.faults.kinds import Faults
from facert.preprocess.faults.spiked import single_spikes
from facert.preprocess.faults.strayed import far_from_expected
from facert.preprocess.faults.summary import summary_lines
from facert.preprocess.faults.swapped import exchanged

log = logging.getLogger(__name__)


@keep_last
def find_faults(source: Source) -> Faults:
    """Bad markers of a take.

    Parameters
    ----------
    source : Source
        With its head motion: a held value shows only before that is taken out. Weights, which do
        rest and do jump, have no faults.

    Returns
    -------
    Faults
        An entry that was not observed is no fault.
    """
    if source.kind != "markers":
        return Faults.of(source.values.shape)
    zero = np.asarray((source.values == 0.0).all(axis=2))
    seen = np.where(zero[:, :, None], np.nan, source.values)
    frozen = held_values(seen)
    seen[frozen] = np.nan
    swapped = exchanged(seen)
    seen[swapped] = np.nan
    far = far_from_expected(seen)
    seen[far] = np.nan
    strayed = far & beside(far)
    # Across the gap that a stray leaves, a straight line says little of the frames beside it.
    spiked = (far & ~strayed) | (single_spikes(seen) & ~beside(strayed))
    return Faults.of(
        zero.shape, zero=zero, frozen=frozen, swapped=swapped, strayed=strayed, spiked=spiked
    )


def beside(mask: BoolArray) -> BoolArray:
    """Entries of which the one in the frame before or after is in a mask (T, M)."""
    result = np.zeros_like(mask)
    result[1:] |= mask[:-1]
    result[:-1] |= mask[1:]
    return result


def without_faults(take: Take) -> Take:
    """The take with its faults hidden; which, by kind, name and frame, goes to the log."""
    faults = find_faults(take.source)
    if not faults.any.any():
        return take
    log.info("bad %s, taken as not observed: %s", take.source.kind, faults)
    for line in summary_lines(faults, take.source):
        log.warning("%s: taken as not observed", line)
    return replace(take, source=faults.hidden_from(take.source))

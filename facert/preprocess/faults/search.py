"""The search for faults of a take, and a take without them."""

from __future__ import annotations

import logging
from dataclasses import replace

import numpy as np

from facert.data.arrays import LARGEST as SENSIBLE
from facert.data.arrays import FloatArray, IntArray, require_bounded
from facert.data.take import Source, Take
from facert.preprocess.cache import keep_last
from facert.preprocess.faults.absurd import absurd_positions, absurd_weights
from facert.preprocess.faults.blank import blank_frames, held_frames
from facert.preprocess.faults.held import held_values
from facert.preprocess.faults.kinds import Faults
from facert.preprocess.faults.runs import beside
from facert.preprocess.faults.spiked import single_spikes
from facert.preprocess.faults.strayed import far_from_expected
from facert.preprocess.faults.summary import summary_lines
from facert.preprocess.faults.swapped import exchanged

log = logging.getLogger(__name__)


LARGEST = 1e100
"""Larger numbers are taken for this one, whose square can still be computed with."""


@keep_last
def find_faults(source: Source, posed: IntArray | None = None) -> Faults:
    """Faults of a take.

    Parameters
    ----------
    source : Source
        With its head motion: a held value shows only before that is taken out.
    posed : array of int, optional
        Frames that somebody posed: these are not without a face.

    Returns
    -------
    Faults
        An entry that was not observed is no fault.

    Raises
    ------
    InputError
        When most of the source is so large that nothing can be computed with it.
    """
    if _largest(source) > SENSIBLE:
        usual = float(np.nanmedian(np.abs(source.values)))
        require_bounded(np.array([usual]), f"/source/{source.kind}")
    values = _computable(source)
    return _of_markers(values) if source.kind == "markers" else _of_weights(values, posed)


def _largest(source: Source) -> float:
    values = source.values
    return max(float(np.fmax.reduce(values, None)), -float(np.fmin.reduce(values, None)))


def _computable(source: Source) -> FloatArray:
    """The values of a source, those whose squares are no numbers replaced by `LARGEST`."""
    values = source.values
    return np.clip(values, -LARGEST, LARGEST) if _largest(source) > LARGEST else values


def without_faults(take: Take) -> Take:
    """The take with its faults hidden; which, by kind, name and frame, goes to the log."""
    source = take.source
    faults = find_faults(source, take.labels if source.kind == "weights" else None)
    if not faults.any.any():
        _warn_of_held(source)
        return take
    log.info("bad %s, taken as not observed: %s", source.kind, faults)
    for line in summary_lines(faults, source):
        log.warning("%s: taken as not observed", line)
    observed = faults.hidden_from(source)
    _warn_of_held(observed)
    return replace(take, source=observed)


def _warn_of_held(source: Source) -> None:
    """Warn of frames of weights that repeat, and end with a jump."""
    if source.kind == "weights":
        for first, last in held_frames(_computable(source)):
            text = "all weights stay the same in frames %d to %d, and then jump: where the face was"
            log.warning("%s lost, blank these rows", text % (first, last))


def _of_weights(weights: FloatArray, posed: IntArray | None) -> Faults:
    """Faults of weights (T, D)."""
    blank = blank_frames(weights, () if posed is None else posed)[:, None] & ~np.isnan(weights)
    absurd = absurd_weights(np.where(blank, np.nan, weights))
    return Faults.of(blank.shape, blank=blank, absurd=absurd)


def _of_markers(markers: FloatArray) -> Faults:
    """Faults of markers (T, M, 3)."""
    none = markers == 0.0
    zero, seen = none[:, :, 0] & none[:, :, 1] & none[:, :, 2], markers.copy()
    seen[zero] = np.nan
    absurd = absurd_positions(seen)
    seen[absurd] = np.nan
    frozen = held_values(seen)
    seen[frozen] = np.nan
    swapped = exchanged(seen)
    seen[swapped] = np.nan
    far = far_from_expected(seen)
    seen[far] = np.nan
    strayed = far & beside(far)
    # Across the gap that a stray leaves, a straight line says little of the frames beside it.
    spiked = (far & ~strayed) | (single_spikes(seen) & ~beside(strayed))
    kinds = {"zero": zero, "absurd": absurd, "frozen": frozen, "swapped": swapped}
    return Faults.of(zero.shape, **kinds, strayed=strayed, spiked=spiked)

"""Frames of a corrected result that are learned from with the poses that were predicted.

Corrected frames are those that a model got wrong. Alone as labels they stand for the whole shot,
and teach it their errors' opposite everywhere: the rest of it mostly got worse. Twice as many
frames that nobody corrected, evenly over the shot and away from what was corrected, keep the rest
as it was (`experiments/correcting_shots.py`).
"""

from __future__ import annotations

import logging

import numpy as np

from facert.data.arrays import IntArray
from facert.data.take import Corrections, Take
from facert.data.takes import Takes, same_recordings
from facert.data.text import plural
from facert.preprocess.training_set import MIN_OBSERVED

log = logging.getLogger("facert")

TIMES = 2
"""As many frames as predicted for each corrected one."""


def with_predicted(takes: Takes, given: Takes) -> Takes:
    """The takes with labels, and some poses as they were predicted beside those corrected.

    Parameters
    ----------
    takes : Takes
        With the poses alone that somebody set.
    given : Takes
        The same with all poses, and their corrections.
    """
    parts = list(takes.parts)
    for place, (whole, name) in enumerate(given.named):
        corrections, params = whole.corrections, parts[place].params
        if corrections is None or corrections.predicted is None or params is None:
            continue
        frames = _away(whole, corrections, _labelled(takes, place))
        frames = _evenly(frames, _wanted(corrections))
        if not len(frames):
            continue
        params = params.copy()
        params[frames] = corrections.predicted[frames]
        parts[place] = parts[place].with_poses(whole.controls, params)
        text = "%s: but %d of them, so that %s not stand for the whole shot; %s leaves them out"
        alone = plural(len(corrections.frames), "correction")
        does = "does" if len(corrections.frames) == 1 else "do"
        log.info(text, name, len(frames), f"{alone} {does}", "--corrections-only")
    return takes.with_parts(parts)


def _wanted(corrections: Corrections) -> int:
    """So many for each frame that was changed, less those that were found right: confirmed."""
    assert corrections.predicted is not None
    changed = (corrections.params != corrections.predicted[corrections.frames]).any(axis=1)
    return max(TIMES * int(changed.sum()) - int((~changed).sum()), 0)


def _labelled(takes: Takes, place: int) -> IntArray:
    """Frames of a take that have a label in it, or in another take of the same recording."""
    same = {place}
    for pair in same_recordings(takes):
        same |= set(pair) if place in pair else set()
    return np.unique(np.concatenate([takes.parts[one].labels for one in same]))


def _away(take: Take, corrections: Corrections, labelled: IntArray) -> IntArray:
    """Frames with a predicted pose that show enough, outside of all windows and not labelled."""
    assert corrections.predicted is not None
    fit = ~np.isnan(corrections.predicted).any(axis=1)
    fit &= take.source.valid.mean(axis=1) >= MIN_OBSERVED
    fit[labelled] = False
    for frame, width in zip(corrections.frames, corrections.width, strict=True):
        fit &= np.abs(take.time - take.time[frame]) > width / 2.0
    return np.flatnonzero(fit).astype(np.int64)


def _evenly(frames: IntArray, count: int) -> IntArray:
    """So many of the frames, or all, each from the middle of an equal share of them."""
    count = min(count, len(frames))
    return frames[((np.arange(count) + 0.5) * len(frames) / max(count, 1)).astype(np.int64)]

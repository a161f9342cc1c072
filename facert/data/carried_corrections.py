"""Corrections of an earlier result, for a new one of the same recording."""

from __future__ import annotations

import logging
from dataclasses import replace

import numpy as np

from facert.data.corrections import at_frames
from facert.data.names import match
from facert.data.resampling import nearest_frames
from facert.data.take import Corrections, Take
from facert.errors import InputError

log = logging.getLogger("facert")

UNLIKE = 0.5
"""Root mean square of the difference of two sources, in standard deviations: another recording."""


def carried(earlier: Take, result: Take) -> Corrections | None:
    """The corrections of an earlier result, at the same times, by the names of the controls.

    Of a source that looks like that of another recording the log warns.

    Raises
    ------
    InputError
        When the new result has other frames or other controls: then it is of another recording or
        another character.
    """
    found = earlier.corrections
    if found is None:
        return None
    assert earlier.controls is not None  # they belong to poses
    assert result.controls is not None  # it was retargeted
    _require_same_frames(earlier, result)
    if set(earlier.controls.names) - set(result.controls.names):
        _require_controls(earlier.controls.names, result.controls.names)
    columns = match(result.controls.names, earlier.controls.names, "corrected controls")
    _warn_if_unlike(earlier, result)
    frames = nearest_frames(result.time, earlier.time[found.frames])
    return at_frames(replace(found, predicted=None, std=None).of_controls(columns), frames)


def _require_controls(earlier: tuple[str, ...], new: tuple[str, ...]) -> None:
    """Refuse controls that are corrected and that the new result lacks."""
    try:
        match(earlier, new, "controls of the model")
    except InputError as error:
        error.fix = "Retarget by a model of these controls, or leave them out: --drop-corrections."
        raise


def _require_same_frames(earlier: Take, result: Take) -> None:
    """Refuse a result with other frames or times than the corrections are for."""
    same = len(earlier) == len(result)
    if same and np.abs(earlier.time - result.time).max() <= 0.5 / result.fps:
        return
    expected, found = (
        f"{len(take)} frames from {take.time[0]:.3f} to {take.time[-1]:.3f} s"
        for take in (earlier, result)
    )
    raise InputError(
        "frames of the recording",
        f"{expected}, as the corrections are for",
        found,
        "Give another OUT, or leave them out by --drop-corrections; "
        "facert convert IN POSED.h5 --poses OUT makes them poses of a recording, by time.",
    )


def _warn_if_unlike(earlier: Take, result: Take) -> None:
    """Warn of another recording that happens to have the same times."""
    old, new = earlier.source, result.source
    if old.names != new.names or old.values.shape != new.values.shape:
        return
    spread = float(np.nanstd(old.matrix - np.nanmean(old.matrix, axis=0)))
    off = np.abs(new.matrix - old.matrix)
    if spread and float(np.sqrt(np.nanmean(off**2))) > UNLIKE * spread:
        log.warning("the recording is another than that of the corrections: check them")

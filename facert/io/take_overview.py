"""A look at a long take: its clock, names and poses, and the source of some of its frames.

The source is most of a file. Its gaps and still channels show in a part of the frames, read in a
few runs, as rows that lie together are packed together.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from facert.data.arrays import FloatArray, require_time
from facert.data.overview import TakeOverview
from facert.data.take import Source
from facert.io.hdf5 import TAKE_FORMAT, GuardedFile, open_guarded, stated_format
from facert.io.registry import OWN_ENDINGS
from facert.io.take import VERSION, read_controls, read_valid

RUNS, RUN = 4, 2048
"""Frames that are looked at: so many runs of so many."""


def overview(path: Path) -> TakeOverview | None:
    """A look at a take of many frames; None for any other file, which is better read whole.

    Raises `InputError` as reading does, but for frames that are not looked at.
    """
    if path.suffix.lower() not in OWN_ENDINGS or stated_format(path) != TAKE_FORMAT:
        return None
    with open_guarded(path) as file:
        file.require_format(TAKE_FORMAT, VERSION)
        values = _some_frames(file)
        if values is None or np.isnan(values).all():
            return None
        time, fps = file.numbers("/time"), file.number_attribute("fps")
        require_time(time, file.rows(_source(file)).shape[0], fps)
        corrected = "/corrections/frames"
        return TakeOverview(
            time=time,
            source=Source(values, file.names("/source/names")),
            controls=read_controls(file),
            params=file.optional("/target/params"),
            animation=file.optional("/animation/params"),
            predicted="/target/std" in file,
            corrected=len(file.integers(corrected)) if corrected in file else None,
            fps=fps,
            units=file.text_attribute("units"),
            up_axis=file.text_attribute("up_axis"),
            start_timecode=file.text_attribute("start_timecode"),
            created_by=file.text_attribute("created_by"),
        )


def _source(file: GuardedFile) -> str:
    return "/source/markers" if "/source/markers" in file else "/source/weights"


def _some_frames(file: GuardedFile) -> FloatArray | None:
    """The source of some frames; None where that is not much less than all."""
    path = _source(file)
    if path not in file:
        return None
    rows = file.rows(path)
    if rows.shape[0] < 2 * RUNS * RUN:
        return None
    starts = np.linspace(0, rows.shape[0] - RUN, RUNS).astype(np.int64)
    runs = [np.arange(start, start + RUN) for start in starts]
    values = np.concatenate([rows.read(run) for run in runs])
    valid = read_valid(file, rows.shape)
    if valid is not None:
        values[~valid[np.concatenate(runs)]] = np.nan
    return values

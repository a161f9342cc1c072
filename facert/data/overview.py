"""What there is to say about a take, all of it read or not."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from facert.data.arrays import FloatArray, IntArray
from facert.data.take import Controls, Source, Take


@dataclass(frozen=True, eq=False)
class TakeOverview:
    """A take whose source may be that of some of its frames.

    Parameters
    ----------
    time : array, shape (T,)
    source : Source
        Of all frames, or of some.
    controls, params, animation, fps, units, up_axis, start_timecode, created_by
        As in `facert.data.take.Take`.
    predicted : bool
        Whether poses have a standard deviation.
    corrected : int or None
        How many frames somebody corrected.
    """

    time: FloatArray
    source: Source
    controls: Controls | None
    params: FloatArray | None
    animation: FloatArray | None
    predicted: bool
    corrected: int | None
    fps: float
    units: str
    up_axis: str
    start_timecode: str
    created_by: str

    @classmethod
    def of(cls, take: Take) -> Self:
        """Of a take that was read whole."""
        return cls(
            time=take.time,
            source=take.source,
            controls=take.controls,
            params=take.params,
            animation=take.animation,
            predicted=take.std is not None,
            corrected=None if take.corrections is None else len(take.corrections.frames),
            fps=take.fps,
            units=take.units,
            up_axis=take.up_axis,
            start_timecode=take.start_timecode,
            created_by=take.created_by,
        )

    def __len__(self) -> int:
        """Number of frames T."""
        return len(self.time)

    @property
    def labels(self) -> IntArray:
        """Indices of the frames whose pose is known."""
        if self.params is None:
            return np.empty(0, dtype=np.int64)
        return np.flatnonzero(~np.isnan(self.params[:, 0])).astype(np.int64)

"""A take that is being posed: its labels, what a model predicted, and the file that keeps them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from facert.data.arrays import FloatArray, IntArray
from facert.data.corrections import WIDTH, put_in, taken_out
from facert.data.labelling import predicted_poses, without_predicted
from facert.data.names import match
from facert.data.take import Controls, Corrections, Source, Take
from facert.io.take import beside_recording, write_take


@dataclass(frozen=True, eq=False)
class Label:
    """A pose that somebody set."""

    pose: FloatArray
    """(P,)."""
    width: float = WIDTH
    """Seconds over which it is blended with what was predicted around it."""


@dataclass(frozen=True, eq=False)
class PosedTake:
    """A take, its labels and, once there is a model, the poses of all its frames.

    Where there are predicted poses, labels are blended into them as corrections are.
    """

    recording: Take
    """As it was recorded, without poses."""
    labels: Mapping[int, Label]
    """By their frames."""
    result: Take | None = None
    """With predicted poses, and no others."""
    output: Path | None = None
    name: str = "take"
    """In messages: its file."""
    is_result: bool = False
    """Whether it is what `retarget` wrote: then its file keeps the predicted poses as well."""

    @cached_property
    def take(self) -> Take:
        """The recording with its labels."""
        assert self.recording.controls is not None  # see `posed_take`
        params = np.full((len(self.recording), len(self.recording.controls.names)), np.nan)
        for frame, label in self.labels.items():
            params[frame] = label.pose
        return replace(self.recording, params=params)

    @cached_property
    def shown(self) -> Take | None:
        """The predicted poses, with the labels blended in as corrections."""
        frames = sorted(self.labels)
        if self.result is None or not frames:
            return self.result
        labels = [self.labels[frame] for frame in frames]
        poses, widths = (np.array([getattr(one, key) for one in labels]) for key in _FIELDS)
        return put_in(self.result, Corrections(np.array(frames), poses, widths))

    def pose(self, frame: int) -> tuple[FloatArray | None, FloatArray | None]:
        """The label of a frame, else the prediction with its standard deviation, else None."""
        if frame in self.labels:
            return self.labels[frame].pose, None
        if self.shown is None or self.shown.params is None:
            return None, None
        std = self.shown.std
        return self.shown.params[frame], None if std is None else std[frame]

    def with_label(self, frame: int, label: Label | None) -> PosedTake:
        """The same with another label of a frame, or without one."""
        labels = {other: one for other, one in self.labels.items() if other != frame}
        return replace(self, labels=labels if label is None else labels | {frame: label})

    def write(self) -> Path:
        """Write it to its file, which appears whole or not at all.

        Raises
        ------
        InputError
            When the file cannot be written.
        """
        assert self.output is not None  # the caller has looked
        if self.is_result and self.shown is not None:
            recorded = self.recording.source
            beside = {} if recorded is self.shown.source else beside_recording(recorded)
            write_take(self.shown, self.output, overwrite=True, beside=beside)
        else:
            write_take(self.take, self.output, overwrite=True)
        return self.output


_FIELDS = ("pose", "width")


def is_result(take: Take) -> bool:
    """Whether a take is what `retarget` wrote, corrected perhaps."""
    return take.corrections is not None or predicted_poses(take) > 0


def posed_take(
    take: Take,
    controls: Controls,
    output: Path | None = None,
    name: str = "take",
    recorded: Source | None = None,
) -> PosedTake:
    """A take with its poses in the order of a character's controls.

    Of a result, `recorded` is its source before it was cleaned, where its file keeps that. Poses
    with a standard deviation were predicted: they are no labels.

    Raises
    ------
    InputError
        When the take's controls are not the character's.
    """
    found = without_predicted(take)
    columns = None
    if take.controls is not None:
        columns = match(controls.names, take.controls.names, "/target/names")
    animation = _ordered(take.animation, columns)
    recording = replace(
        take, controls=controls, params=None, std=None, animation=animation, corrections=None
    )
    labels: dict[int, Label] = {}
    if found.params is not None and columns is not None:
        labels = {int(f): Label(found.params[f, columns]) for f in found.labels}
    if take.corrections is not None:
        widths = zip(take.corrections.frames.tolist(), take.corrections.width, strict=True)
        labels |= {f: Label(labels[f].pose, float(w)) for f, w in widths if f in labels}
    result = None
    if is_result(take):
        base = taken_out(take)
        params, std = _ordered(base.params, columns), _ordered(base.std, columns)
        result = replace(recording, params=params, std=std, animation=None)
    if recorded is not None:
        recording = replace(recording, source=recorded)
    return PosedTake(recording, labels, result, output, name, is_result(take))


def _ordered(poses: FloatArray | None, columns: IntArray | None) -> FloatArray | None:
    return None if poses is None or columns is None else poses[:, columns]

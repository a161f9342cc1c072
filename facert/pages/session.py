"""A recording that is being posed: its labels, the model that learns from them, and its files."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from facert.data.arrays import FloatArray, rms
from facert.data.labelling import without_predicted
from facert.data.limits import bounds_of, rig_controls
from facert.data.names import match
from facert.data.rig import Rig
from facert.data.take import Controls, Take
from facert.errors import InputError
from facert.io.take import write_take
from facert.posing.completed_pose import LEAST
from facert.posing.suggested_frames import Suggestion, suggest_frames
from facert.preprocess.known_poses import KnownPoses, keep
from facert.retarget.retargeter import Retargeter
from facert.retarget.training import train

ENDING = ".posed.h5"


@dataclass(frozen=True)
class Trained:
    """The outcome of training."""

    labels: int
    """How many poses it learned from."""
    seconds: float
    change: float | None
    """RMS by which the poses of the take moved; None the first time."""


class PosingSession:
    """A session of posing a take, frame by frame.

    Parameters
    ----------
    controls : Controls
        The character's.
    take : Take, optional
        What was recorded; its poses are the first labels, unless they were predicted by a model.
    model : Retargeter, optional
        Predicts a pose for every frame, and holds the poses that the character makes.
    output : Path, optional
        Where `save` writes the take with its labels. The model of `train` is beside it.

    Raises
    ------
    InputError
        When the take's controls are not the character's.
    """

    def __init__(
        self,
        controls: Controls,
        take: Take | None = None,
        model: Retargeter | None = None,
        output: Path | None = None,
    ) -> None:
        self.controls, self.model, self.output = controls, model, output
        self._saved: set[int] = set()
        self.take = None if take is None else _labels_only(take, controls)
        self.result: Take | None = None
        self._animation = model.poses if model is not None else None
        if self.take is not None and model is not None:
            self.result = model.retarget(self.take)

    @property
    def model_path(self) -> Path | None:
        """Path to which `train` writes the model."""
        return None if self.output is None else self.output.with_suffix(".safetensors")

    @property
    def known(self) -> KnownPoses | None:
        """The poses that the character is known to make; None when they are too few."""
        labels, animation = np.empty((0, len(self.controls.names))), self._animation
        if self.take is not None and self.take.params is not None:
            labels = self.take.params[self.take.labels]
        if self.take is not None and self.take.animation is not None:
            animation = self.take.animation
        poses = keep(labels, animation, seed=0)
        if len(poses) < LEAST:
            return None
        return KnownPoses(poses, bounds_of(self.controls.limits, poses))

    def pose(self, frame: int) -> tuple[FloatArray | None, FloatArray | None]:
        """The label of a frame, else the prediction with its standard deviation, else None."""
        if self.labelled(frame) and self.take is not None and self.take.params is not None:
            return self.take.params[frame], None
        return self._predicted(frame)

    def labelled(self, frame: int) -> bool:
        """Whether a frame has a label."""
        return self.take is not None and frame in self.take.labels

    def _predicted(self, frame: int) -> tuple[FloatArray | None, FloatArray | None]:
        if self.result is None or self.result.params is None:
            return None, None
        std = self.result.std
        return self.result.params[frame], None if std is None else std[frame]

    @property
    def saved(self) -> int:
        """How many frames have a pose that was saved in this session."""
        return len(self._saved)

    def saved_pose(self, frame: int) -> FloatArray | None:
        """The label of a frame, (P,), if it has one."""
        take = self.take
        return (
            take.params[frame]
            if take and take.params is not None and frame in take.labels
            else None
        )

    def save(self, frame: int, pose: FloatArray) -> Path:
        """Make a pose the label of a frame, and write the take with all labels; see `put`."""
        return self.put(frame, pose)

    def put(self, frame: int, pose: FloatArray | None) -> Path:
        """Make a pose (P,) the label of a frame, or leave it without, and write the take.

        The file appears whole or not at all, and the label counts when it is written.

        Raises
        ------
        InputError
            When the file cannot be written.
        """
        take, output = self._require_take()
        params = np.full((len(take), len(self.controls.names)), np.nan)
        if take.params is not None:
            params[:] = take.params
        params[frame] = np.nan if pose is None else pose
        labelled = replace(take, params=params)
        write_take(labelled, output, overwrite=True)
        self.take = labelled
        (self._saved.discard if pose is None else self._saved.add)(frame)
        return output

    def suggestion(self, count: int) -> Suggestion:
        """Frames to pose next, going on from the labels, and from the model if there is one."""
        take, _ = self._require_take()
        certain = self.result is not None and self.result.std is not None
        return suggest_frames(take, count, self.model if self.model and certain else take.labels)

    def train(self) -> Trained:
        """Learn from the labels; retarget the take anew, and write the model beside it.

        What the first model knew of the character's poses is kept as animation.

        Raises
        ------
        InputError
            When the labels are too few, or the model cannot be written.
        """
        take, _ = self._require_take()
        if take.animation is None and self._animation is not None:
            take = replace(take, animation=self._animation)
        model = train(take, start=self.model)
        result = model.retarget(take)
        if self.model_path is not None:
            model.save(self.model_path, overwrite=True)
        change = None
        if self.result is not None and self.result.params is not None:
            assert result.params is not None  # it was retargeted
            change = rms(result.params - self.result.params)
        self.model, self.result = model, result
        return Trained(len(take.labels), model.figures["seconds"], change)

    def _require_take(self) -> tuple[Take, Path]:
        if self.take is None or self.output is None:
            raise InputError("--take", "a recording to pose", "none", "Give one with --take.")
        return self.take, self.output


def output_beside(take: Path) -> Path:
    """Path for the labels of a take: ``performance.posed.h5`` for ``performance.h5``."""
    if take.name.endswith(ENDING):
        return take
    return take.with_name(take.name.removesuffix(take.suffix) + ENDING)


def character_controls(model: Retargeter | None, take: Take | None, rig: Rig | None) -> Controls:
    """The controls to pose: the model's, else the take's, else the rig's shapes.

    Raises
    ------
    InputError
        When there is none of the three.
    """
    if model is not None:
        return model.controls
    if take is not None and take.controls is not None:
        return take.controls
    if rig is not None:
        return rig_controls(rig)
    expected, fix = "a model, a take with controls, or a rig", "Give --model or --rig."
    raise InputError("the character", expected, "none", fix)


def _labels_only(take: Take, controls: Controls) -> Take:
    """The take with its labels and animation in the order of the controls.

    Predicted poses are no labels; corrections of a result are.
    """
    take = without_predicted(take)
    if take.controls is None:
        return replace(take, controls=controls)
    columns = match(controls.names, take.controls.names, "/target/names")
    params = None if take.params is None else take.params[:, columns]
    animation = None if take.animation is None else take.animation[:, columns]
    return replace(
        take,
        controls=controls,
        params=params,
        animation=animation,
    )

"""Recordings that are being posed: their labels, the model that learns from them, and its file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from facert.data.arrays import FloatArray, rms
from facert.data.corrections import WIDTH
from facert.data.limits import bounds_of, rig_controls
from facert.data.matching_takes import as_takes
from facert.data.rig import Rig
from facert.data.take import Controls, Source, Take
from facert.data.verdict import Verdict
from facert.errors import InputError
from facert.io.registry import OWN_ENDINGS
from facert.pages.posed_take import Label, PosedTake, is_result, posed_take
from facert.posing.completed_pose import LEAST
from facert.posing.suggested_frames import Suggestion, suggest_frames
from facert.preprocess.known_poses import KnownPoses, keep
from facert.retarget.retargeter import Retargeter
from facert.retarget.training import train
from facert.retarget.verdict import judge

ENDING = ".posed.h5"


@dataclass(frozen=True, eq=False)
class Trained:
    """The outcome of training."""

    model: Retargeter
    results: tuple[Take, ...]
    """Each take, retargeted."""
    labels: int
    """How many poses it learned from."""
    seconds: float
    error: float | None
    """RMS of its poses of labels that were left out while it learned, in the controls' units."""
    change: float | None
    """RMS by which the poses of the takes moved; None the first time."""


class PosingSession:
    """A session of posing takes, frame by frame; one of them is looked at.

    Parameters
    ----------
    controls : Controls
        The character's.
    take : Take, or sequence of Take, optional
        What was recorded; its poses are the first labels, unless they were predicted by a model.
    model : Retargeter, optional
        Predicts a pose for every frame, and holds the poses that the character makes.
    output : Path, or one for each take, optional
        Where `put` writes a take with its labels. The model of `train` is beside the first.
    names : sequence of str
        Of each take, for people: its file.
    recorded : sequence of Source
        Of each take, before a result was cleaned.

    Raises
    ------
    InputError
        When a take's controls are not the character's.
    """

    def __init__(
        self,
        controls: Controls,
        take: Take | Sequence[Take] | None = None,
        model: Retargeter | None = None,
        output: Path | Sequence[Path] | None = None,
        names: Sequence[str] = (),
        recorded: Sequence[Source] = (),
    ) -> None:
        self.controls, self.model, self.here = controls, model, 0
        takes = [] if take is None else [take] if isinstance(take, Take) else list(take)
        paths = list(output) if isinstance(output, Sequence) else [output] * len(takes)
        names = names or [f"take {number}" for number in range(1, len(takes) + 1)]
        sources = recorded or [one.source for one in takes]
        given = zip(takes, paths, names, sources, strict=True)
        self.parts = [
            posed_take(one, controls, path, name, source) for one, path, name, source in given
        ]
        self._saved: set[tuple[int, int]] = set()
        self._animation = model.poses if model is not None else None
        if model is not None:
            self.parts = [
                part if part.is_result else replace(part, result=model.retarget(part.take))
                for part in self.parts
            ]

    @property
    def part(self) -> PosedTake | None:
        """What is looked at."""
        return self.parts[self.here] if self.parts else None

    @property
    def take(self) -> Take | None:
        """The take that is looked at, with its labels."""
        return None if self.part is None else self.part.take

    @property
    def result(self) -> Take | None:
        """What the model predicts for the take that is looked at."""
        return None if self.part is None else self.part.result

    @property
    def output(self) -> Path | None:
        """Path to which `put` writes the take that is looked at."""
        return None if self.part is None else self.part.output

    @property
    def model_path(self) -> Path | None:
        """Path to which `train` writes the model."""
        first = self.parts[0].output if self.parts else None
        return None if first is None else first.with_suffix(".safetensors")

    @property
    def labels(self) -> int:
        """Number of labels of all takes."""
        return sum(len(part.labels) for part in self.parts)

    @property
    def saved(self) -> int:
        """How many frames have a pose that was saved in this session."""
        return len(self._saved)

    def saved_of(self, take: int) -> int:
        """How many of them are of one of the takes."""
        return sum(place[0] == take for place in self._saved)

    @property
    def known(self) -> KnownPoses | None:
        """The poses that the character is known to make; None when they are too few.

        Where nobody set enough, those that were predicted for a result count.
        """
        labels = [label.pose for part in self.parts for label in part.labels.values()]
        old = [part.recording.animation for part in self.parts]
        if not any(one is not None for one in old):
            old = [self._animation]
        if len(labels) + sum(len(one) for one in old if one is not None) < LEAST:
            old = [part.result.params for part in self.parts if part.is_result and part.result]
        there = [one for one in old if one is not None]
        poses = keep(
            np.array(labels).reshape(len(labels), len(self.controls.names)),
            np.concatenate(there) if there else None,
            seed=0,
        )
        if len(poses) < LEAST:
            return None
        return KnownPoses(poses, bounds_of(self.controls.limits, poses))

    def pose(self, frame: int) -> tuple[FloatArray | None, FloatArray | None]:
        """The label of a frame, else the prediction with its standard deviation, else None."""
        return (None, None) if self.part is None else self.part.pose(frame)

    def label(self, frame: int) -> Label | None:
        """The label of a frame of the take that is looked at."""
        return None if self.part is None else self.part.labels.get(frame)

    def labelled(self, frame: int) -> bool:
        """Whether a frame has a label."""
        return self.label(frame) is not None

    def save(self, frame: int, pose: FloatArray, width: float = WIDTH) -> Path:
        """Make a pose the label of a frame, and write the take with all labels; see `put`."""
        return self.put(frame, Label(pose, width))

    def put(self, frame: int, label: Label | None) -> Path:
        """Give a frame a label, or leave it without one, and write the take.

        The file appears whole or not at all, and the label counts when it is written.

        Raises
        ------
        InputError
            When the file cannot be written.
        """
        self._require_take()
        changed = self.parts[self.here].with_label(frame, label)
        path = changed.write()
        self.parts[self.here] = changed
        (self._saved.discard if label is None else self._saved.add)((self.here, frame))
        return path

    def suggestion(self, count: int) -> Suggestion:
        """Frames to pose next, going on from the labels, and from the model if there is one."""
        self._require_take()
        parts, model = list(self.parts), self.model
        takes = as_takes([part.take for part in parts], names=[part.name for part in parts])
        certain = all(part.result is not None and part.result.std is not None for part in parts)
        labels = [part.take.labels for part in parts]
        have = labels if len(parts) > 1 else labels[0]
        return suggest_frames(takes, count, model if model and certain else have)

    def learn(self) -> Trained:
        """Learn from all labels, retarget the takes, and write the model beside the first.

        What the first model knew of the character's poses is kept as animation. What comes of it
        counts from `accept` on.

        Raises
        ------
        InputError
            When the labels are too few or only corrections of results, or the model cannot be
            written.
        """
        self._require_take()
        parts = list(self.parts)
        if all(part.is_result for part in parts):
            expected, fix = (
                "a take that was posed",
                "Give it as well: --take POSED.h5 --take RESULT.",
            )
            raise InputError("--take", expected, "corrections of a result alone", fix)
        takes = [part.take for part in parts]
        if all(take.animation is None for take in takes) and self._animation is not None:
            takes[0] = replace(takes[0], animation=self._animation)
        names = [part.name for part in parts]
        model = train(as_takes(takes, names=names), start=self.model)
        results = tuple(model.retarget(take) for take in takes)
        if self.model_path is not None:
            model.save(self.model_path, overwrite=True)
        error = model.figures.get("cross-validation error")
        change = _change([part.result for part in parts], results)
        labels = sum(len(part.labels) for part in parts)
        return Trained(model, results, labels, model.figures["seconds"], error, change)

    def accept(self, trained: Trained) -> None:
        """Go on with a model that was trained, and write anew the results that it retargeted."""
        self.model = trained.model
        pairs = zip(self.parts, trained.results, strict=True)
        self.parts = [replace(part, result=result) for part, result in pairs]
        for part in self.parts:
            if part.is_result:
                part.write()

    def train(self) -> Trained:
        """Learn, and go on with what was learned; see `learn`."""
        trained = self.learn()
        self.accept(trained)
        return trained

    def verdict(self) -> Verdict | None:
        """What to think of the poses of the take that is looked at; None without a model."""
        part, model = self.part, self.model
        if part is None or model is None or part.result is None:
            return None
        return judge(part.recording, part.result, model)

    def _require_take(self) -> None:
        if self.part is None or self.part.output is None:
            raise InputError("--take", "a recording to pose", "none", "Give one with --take.")


def output_beside(path: Path, take: Take) -> Path:
    """Path for the labels of a take: ``performance.posed.h5`` for ``performance.h5``.

    Corrections of a result stay in its own file.
    """
    if path.name.endswith(ENDING) or (is_result(take) and path.suffix.lower() in OWN_ENDINGS):
        return path
    return path.with_name(path.name.removesuffix(path.suffix) + ENDING)


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


def _change(before: Sequence[Take | None], after: Sequence[Take]) -> float | None:
    """RMS by which poses moved; None where there were none before."""
    moved = [
        new.params - old.params
        for old, new in zip(before, after, strict=True)
        if old is not None and old.params is not None and new.params is not None
    ]
    return rms(np.concatenate(moved)) if moved else None

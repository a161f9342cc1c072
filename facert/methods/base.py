"""The small interface of every retargeting method.

A method works on normalised arrays, one row a frame or a pose, and knows nothing of takes or
files: `facert.retarget.retargeter` stands between.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar, Protocol, Self, runtime_checkable

import numpy as np

from facert.data.array_group import Shaped
from facert.data.arrays import FloatArray
from facert.data.normalisation import Normalisation
from facert.models.optim.monitor import Monitor
from facert.models.optim.optimiser import Result
from facert.settings import Settings


@dataclass(frozen=True)
class Labelled:
    """Frames with their poses: X (l, d_x) and Y (l, d_y), complete."""

    X: FloatArray
    Y: FloatArray


@dataclass(frozen=True)
class Unlabelled:
    """Frames without a pose, X (m, d_x), and poses without a frame, Y (n, d_y), complete.

    Predictions are clipped to `bounds`, (2, d_y), infinite where they are not; by default to the
    range of all poses. A method may use that.
    """

    X: FloatArray
    Y: FloatArray
    bounds: FloatArray | None = None

    @property
    def counts(self) -> dict[str, float]:
        """Numbers of frames and poses, as figures of a report."""
        return {"unlabelled frames": len(self.X), "unlabelled poses": len(self.Y)}


def stacked(labelled: Labelled, unlabelled: Unlabelled) -> tuple[FloatArray, FloatArray]:
    """Stack frames (l + m, d_x) and poses (l + n, d_y), the labelled ones first."""
    return np.vstack([labelled.X, unlabelled.X]), np.vstack([labelled.Y, unlabelled.Y])


@dataclass(frozen=True)
class Prediction:
    """Poses of T frames and what comes with them, in normalised units."""

    Y: FloatArray  # (T, d_y): Poses
    # (T, d_y): Their predictive standard deviation, where the method has one
    std: FloatArray | None
    X: FloatArray  # (T, d_x): The cleaned source


@dataclass(frozen=True)
class TrainingReport:
    """The course of a training, for people and for the model file."""

    result: Result | None = None  # Of the optimiser, where the method descends step by step
    # Numbers by their names, e.g. kernel parameters.
    figures: Mapping[str, float] = field(default_factory=dict)
    # Figures in the unit of normalised poses, e.g. errors.
    pose_figures: Mapping[str, float] = field(default_factory=dict)


class Stream(Protocol):
    """Maps one frame after the other, each with the memory of those before."""

    def step(self, frame: FloatArray, input_variance: FloatArray | None = None) -> Prediction:
        """The prediction for one more frame, (1, d_x); see `Method.predict`."""
        ...


class Method(Protocol):
    """A way to learn the map from source to target; after `fit`, its settings are complete."""

    settings: Settings
    most_unlabelled: ClassVar[int | None]
    """Frames and poses that it has use for, of each; None: all."""
    stepwise: ClassVar[bool]
    """Whether it trains step by step, on the device of the settings, and can be watched, stopped
    and resumed; another learns in one go, on the CPU."""

    def __init__(self, settings: Settings) -> None: ...

    @property
    def dimensions(self) -> tuple[int, int]:
        """Dimensions d_x and d_y of the training data."""
        ...

    def fit(
        self, labelled: Labelled, unlabelled: Unlabelled, monitor: Monitor = ...
    ) -> TrainingReport:
        """Learn from labelled frames and whatever unlabelled data the method can use."""
        ...

    def predict(self, frames: FloatArray, input_variance: FloatArray | None = None) -> Prediction:
        """Map frames (T, d_x), each on its own.

        Parameters
        ----------
        frames : array, shape (T, d_x)
            NaN: not observed.
        input_variance : array, shape (T, d_x), optional
            Variance of each number, where it was not measured but filled in.
        """
        ...

    def unclipped(self) -> Self:
        """The trained method without limits on its poses; itself where it has none of its own."""
        ...

    def on(self, device: str) -> Self:
        """The trained method, whose `predict` computes on a device, ``"cpu"`` or ``"cuda"``.

        One that learns in one go stays on the CPU, with a warning.

        Raises
        ------
        DeviceError
            When the device is not there.
        """
        ...

    def stream(self) -> Stream:
        """Begin to map frames one after the other."""
        ...

    def save(self) -> dict[str, FloatArray]:
        """The arrays that were learned, by their names."""
        ...

    def check(self, arrays: Mapping[str, Shaped]) -> tuple[int, int]:
        """Dimensions d_x and d_y of arrays that `load` could take over, by their shapes alone.

        A file is asked before any array of it is read.

        Raises
        ------
        InputError
            When an array is absent or unknown, or shapes do not fit together.
        """
        ...

    def load(self, arrays: Mapping[str, FloatArray]) -> None:
        """Take over what `save` returned; raises InputError as `check`, and for wrong numbers."""
        ...


@runtime_checkable
class WarmStart(Protocol):
    """A method that trains step by step, and may begin at a trained one."""

    def begin_at(self, other: Method, source: Normalisation, target: Normalisation) -> None:
        """Let `fit` begin at what a method of the same settings has learned.

        Parameters
        ----------
        other : Method
            Trained.
        source, target : Normalisation
            The units that `fit` will be given, in those that the other was.
        """
        ...

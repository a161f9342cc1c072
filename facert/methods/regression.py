"""What all methods share that regress poses directly on frames.

Such a method learns a `Map`: plain arrays, and a formula that takes complete frames to poses.
Around it, `Regression` fills the gaps of the source, saves and loads, and streams.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import ClassVar

import numpy as np

from facert.data import FloatArray
from facert.errors import InputError
from facert.gaps import Gaussian
from facert.methods.base import Labelled, Prediction, Report, Stream, Unlabelled
from facert.metrics import rms
from facert.optim.monitor import Monitor
from facert.settings import Settings
from facert.threads import threads_for

DAMAGED = "The model file is damaged: train it again."


@dataclass(frozen=True, eq=False)
class Map(ABC):
    """A trained map from complete frames to poses; every field is an array.

    `axes` spells the shape of each field, a letter an axis. A letter stands for one size in all of
    them ("x" for d_x, "y" for d_y), a digit for itself: ``{"weights": "xy", "offset": "y"}``.

    Raises
    ------
    InputError
        When the arrays do not fit together.
    """

    axes: ClassVar[Mapping[str, str]]

    def __post_init__(self) -> None:
        check_axes(self.arrays, self.axes)

    @property
    def arrays(self) -> dict[str, FloatArray]:
        """The fields by name."""
        return {field.name: getattr(self, field.name) for field in fields(self)}

    @abstractmethod
    def __call__(self, X: FloatArray) -> tuple[FloatArray, FloatArray | None]:
        """Poses of frames X (T, d_x), (T, d_y), and their standard deviation if there is one."""


class Regression(ABC):
    """A method that learns a `Map`.

    What a frame does not show is filled in first, by what all training frames tell of how the
    source's dimensions go together; the cleaned source of a prediction is the filled one.

    Parameters
    ----------
    settings : Settings
        Only the name of the method is used.
    """

    map_type: ClassVar[type[Map]]
    least_labels: ClassVar[int] = 3

    map_: Map

    def __init__(self, settings: Settings) -> None:
        self.settings = settings

    @property
    def dimensions(self) -> tuple[int, int]:
        """d_x and d_y of what it was trained on."""
        sizes = check_axes(self.map_.arrays, self.map_.axes)
        return sizes["x"], sizes["y"]

    def fit(
        self,
        labelled: Labelled,
        unlabelled: Unlabelled,
        monitor: Monitor | None = None,  # noqa: ARG002  done in one go: nothing to watch
    ) -> Report:
        """Learn the map, and how the source's dimensions go together.

        Parameters
        ----------
        labelled, unlabelled : Labelled, Unlabelled
            Normalised and complete; labelled frames in the order of time.
        monitor : Monitor, optional
            Not used.

        Raises
        ------
        InputError
            With fewer than `least_labels` labelled frames.
        """
        count = len(labelled.X)
        if count < self.least_labels:
            raise InputError(
                "labels",
                f"at least {self.least_labels} posed frames for {self.settings.method}",
                f"{count}",
                "Pose more frames (10 to 40 serve well).",
            )
        with threads_for(count):
            self.gaps_ = Gaussian.of(np.vstack([labelled.X, unlabelled.X]))
            self.map_, figures = self._learn(labelled, unlabelled)
            residual = rms(self.map_(labelled.X)[0] - labelled.Y)
        return Report(figures={**figures, "training reconstruction": residual})

    @abstractmethod
    def _learn(self, labelled: Labelled, unlabelled: Unlabelled) -> tuple[Map, dict[str, float]]:
        """The map, and what to report of it."""

    def predict(self, frames: FloatArray) -> Prediction:
        """Map frames (T, d_x), each on its own; NaN: not observed."""
        X = self.gaps_.fill(frames)
        Y, std = self.map_(X)
        return Prediction(Y, std, X)

    def stream(self) -> Stream:
        """Begin to map frames one after the other; none remembers those before."""
        return _MemorylessStream(self)

    def save(self) -> dict[str, FloatArray]:
        """The arrays of the map, and mean and covariance of the source."""
        arrays = {f"map.{name}": array for name, array in self.map_.arrays.items()}
        return {
            "source.mean": self.gaps_.mean,
            "source.covariance": self.gaps_.covariance,
            **arrays,
        }

    def load(self, arrays: Mapping[str, FloatArray]) -> None:
        """Take over what `save` returned.

        Raises
        ------
        InputError
            When an array is absent or the shapes do not fit together.
        """
        parts = {f"map.{name}": axes for name, axes in self.map_type.axes.items()}
        check_axes(arrays, {"source.mean": "x", "source.covariance": "xx", **parts})
        try:
            np.linalg.cholesky(arrays["source.covariance"])
        except np.linalg.LinAlgError:
            raise InputError(
                "source.covariance", "a positive definite matrix", "another", DAMAGED
            ) from None
        self.gaps_ = Gaussian(arrays["source.mean"], arrays["source.covariance"])
        self.map_ = self.map_type(**{name: arrays[f"map.{name}"] for name in self.map_type.axes})


class SupervisedRegression(Regression):
    """A method whose map is learned from the labelled frames alone."""

    def _learn(
        self,
        labelled: Labelled,
        unlabelled: Unlabelled,  # noqa: ARG002  they only help to fill gaps
    ) -> tuple[Map, dict[str, float]]:
        return self._regress(labelled.X, labelled.Y)

    @abstractmethod
    def _regress(self, X: FloatArray, Y: FloatArray) -> tuple[Map, dict[str, float]]:
        """The map from frames X (l, d_x) with poses Y (l, d_y), and what to report of it."""


class _MemorylessStream:
    def __init__(self, method: Regression) -> None:
        self.method = method

    def step(self, frame: FloatArray) -> Prediction:
        """Map one more frame (1, d_x)."""
        return self.method.predict(frame)


def check_axes(arrays: Mapping[str, FloatArray], axes: Mapping[str, str]) -> dict[str, int]:
    """The size that each letter stands for, found in the arrays; see `Map`.

    Raises
    ------
    InputError
        When an array is absent or empty, or its shape is not as spelt.
    """
    sizes: dict[str, int] = {}
    for name, letters in axes.items():
        array = arrays.get(name)
        if array is None or array.ndim != len(letters) or not array.size:
            found = "nothing" if array is None else f"shape {array.shape}"
            raise InputError(name, f"an array of {len(letters)} dimensions", found, DAMAGED)
        for letter, size in zip(letters, array.shape, strict=True):
            expected = int(letter) if letter.isdigit() else sizes.setdefault(letter, size)
            if size != expected:
                raise InputError(name, f"{expected} for {letter}", f"shape {array.shape}", DAMAGED)
    return sizes

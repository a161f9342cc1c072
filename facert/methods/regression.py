"""Regression of poses on frames: the base of every method that learns a `Map`.

A map is plain arrays, and a formula that takes complete frames to poses. Around it, `Regression`
fills the gaps of the source, saves and loads, and streams.
"""

from __future__ import annotations

import logging
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar, Self

import numpy as np

from facert.data.array_group import DAMAGED, ArrayGroup, Shaped, check_axes, require_known_arrays
from facert.data.arrays import FloatArray, rms
from facert.errors import InputError
from facert.methods.base import Labelled, Prediction, Stream, TrainingReport, Unlabelled, stacked
from facert.models.device import find_device
from facert.models.gaussian import Gaussian
from facert.models.optim.monitor import Monitor
from facert.models.threads import threads_for
from facert.settings import Settings

log = logging.getLogger(__name__)

MOST_KERNELS = 2**23
"""Numbers of kernels between frames and labels that are held at a time."""
Variance = Callable[[], FloatArray]
"""Works out the variance of poses, (T, d_y), when asked: in a stream, it hardly ever is."""


@dataclass(frozen=True, eq=False)
class Map(ArrayGroup, ABC):
    """A trained map from complete frames to poses, quick for a single frame and for many."""

    predicts_std: ClassVar[bool] = True
    """Whether poses come with their variance."""

    @abstractmethod
    def __call__(self, X: FloatArray) -> tuple[FloatArray, Variance | None]:
        """Poses of frames X (T, d_x), (T, d_y), and their variance if there is one."""


class Regression(ABC):
    """A method that learns a `Map`.

    What a frame does not show is filled in first, from how the source's dimensions go together in
    all training frames; the cleaned source of a prediction is the filled one. What the fill leaves
    open adds to the variance of a pose, as it would with the best linear stand-in for the map,
    y = const + x B: see `facert.models.gaussian.Gaussian.fill_for`.

    Parameters
    ----------
    settings : Settings
        Only the name of the method, the seed and the device are used.
    """

    map_type: ClassVar[type[Map]]
    least_labels: ClassVar[int] = 3
    most_unlabelled: ClassVar[int | None] = None
    stepwise: ClassVar[bool] = False

    gaps_: Gaussian
    map_: Map
    response_: FloatArray
    """B, (d_x, d_y); (d_x, 0) where the map predicts no standard deviation."""

    def __init__(self, settings: Settings) -> None:
        self.settings = settings

    @property
    def dimensions(self) -> tuple[int, int]:
        """d_x and d_y of what it was trained on."""
        sizes = check_axes(self.map_.arrays, self.map_.all_axes())
        return sizes["x"], sizes["y"]

    def fit(
        self,
        labelled: Labelled,
        unlabelled: Unlabelled,
        monitor: Monitor | None = None,  # noqa: ARG002  done in one go: nothing to watch
    ) -> TrainingReport:
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
        DeviceError
            When the settings ask for a device that is not there.
        """
        self._stay_on_cpu(self.settings.device, "trains")
        count = len(labelled.X)
        if count < self.least_labels:
            raise InputError(
                "labels",
                f"at least {self.least_labels} posed frames for {self.settings.method}",
                f"{count}",
                "Pose more frames (10 to 40 serve well).",
            )
        with threads_for(count):
            frames, _ = stacked(labelled, unlabelled)
            self.gaps_ = Gaussian.of(frames)
            self.map_, report = self._learn(labelled, unlabelled)
            self.response_ = self._linear_response(frames)
            residual = rms(self.map_(labelled.X)[0] - labelled.Y)
        errors = {**report.pose_figures, "training reconstruction": residual}
        return replace(report, pose_figures=errors)

    @abstractmethod
    def _learn(self, labelled: Labelled, unlabelled: Unlabelled) -> tuple[Map, TrainingReport]:
        """The map, and a report of it."""

    def _linear_response(self, frames: FloatArray) -> FloatArray:
        """Matrix B of least squares from frames (n, d_x) to the map's poses, with a ridge."""
        if not self.map_.predicts_std:
            return np.empty((frames.shape[1], 0))
        poses, _ = self.map_(frames)
        products = (frames - self.gaps_.mean).T @ (poses - poses.mean(axis=0)) / len(frames)
        return np.linalg.solve(self.gaps_.covariance, products).astype(np.float64)

    def predict(self, frames: FloatArray, input_variance: FloatArray | None = None) -> Prediction:
        """Map frames (T, d_x), each on its own; NaN: not observed. See `Method.predict`."""
        X, variance = self.fill(frames, input_variance)
        Y, own = self.map_(X)
        return Prediction(Y, None if own is None else np.sqrt(own() + variance), X)

    def fill(
        self, frames: FloatArray, input_variance: FloatArray | None
    ) -> tuple[FloatArray, FloatArray]:
        """Complete frames (T, d_x), and the variance of poses (T, d_y) that the filling leaves."""
        X, variance = self.gaps_.fill_for(frames, self.response_)
        if input_variance is not None:
            variance = variance + np.nan_to_num(input_variance) @ self.response_**2
        return X, variance

    def unclipped(self) -> Self:
        """Return the method itself, which has no limits. See `Method.unclipped`."""
        return self

    def on(self, device: str) -> Self:
        """Return the method itself, which computes on the CPU alone. See `Method.on`."""
        self._stay_on_cpu(device, "maps")
        return self

    def _stay_on_cpu(self, device: str, does: str) -> None:
        """Warn that another device than the CPU is not used; it must exist nonetheless."""
        if device != "cpu" and find_device(device).type != "cpu":  # the second imports torch
            log.warning("%s %s on the CPU: %s is not used", self.settings.method, does, device)

    def stream(self) -> Stream:
        """Begin to map frames one after the other; none remembers those before."""
        return _FrameStream(self)

    def save(self) -> dict[str, FloatArray]:
        """The arrays of the map, mean and covariance of the source, and B if there is one."""
        arrays = {f"map.{name}": array for name, array in self.map_.arrays.items()}
        if self.map_.predicts_std:
            arrays["source.response"] = self.response_
        return {
            "source.mean": self.gaps_.mean,
            "source.covariance": self.gaps_.covariance,
            **arrays,
        }

    def check(self, arrays: Mapping[str, Shaped]) -> tuple[int, int]:
        """Dimensions d_x and d_y of arrays that `load` could take over; see `Method.check`."""
        axes = {f"map.{name}": letters for name, letters in self.map_type.all_axes().items()}
        if self.map_type.predicts_std:
            axes["source.response"] = "xy"
        axes = {"source.mean": "x", "source.covariance": "xx", **axes}
        require_known_arrays(arrays, axes)
        sizes = check_axes(arrays, axes)
        return sizes["x"], sizes["y"]

    def load(self, arrays: Mapping[str, FloatArray]) -> None:
        """Take over what `save` returned.

        Raises
        ------
        InputError
            When an array is absent or the shapes do not fit together.
        """
        self.check(arrays)
        try:
            np.linalg.cholesky(arrays["source.covariance"])
        except np.linalg.LinAlgError:
            raise InputError(
                "source.covariance", "a positive definite matrix", "another", DAMAGED
            ) from None
        self.gaps_ = Gaussian(arrays["source.mean"], arrays["source.covariance"])
        self.map_ = self.map_type.of(arrays, "map.")
        none = np.empty((len(self.gaps_.mean), 0))
        self.response_ = arrays["source.response"] if self.map_type.predicts_std else none


class SupervisedRegression(Regression):
    """A method whose map is learned from the labelled frames alone."""

    def _learn(
        self,
        labelled: Labelled,
        unlabelled: Unlabelled,  # noqa: ARG002  they only help to fill gaps
    ) -> tuple[Map, TrainingReport]:
        map_, figures = self._regress(labelled.X, labelled.Y)
        return map_, TrainingReport(figures=figures)

    @abstractmethod
    def _regress(self, X: FloatArray, Y: FloatArray) -> tuple[Map, dict[str, float]]:
        """The map from frames X (l, d_x) with poses Y (l, d_y), and figures for the report."""


class _FrameStream:
    """Maps frames one after the other, each on its own."""

    def __init__(self, method: Regression) -> None:
        self._map, self._gaps, self._fill = method.map_, method.gaps_, method.fill

    def step(self, frame: FloatArray, input_variance: FloatArray | None = None) -> Prediction:
        """Map one more frame (1, d_x); see `facert.methods.base.Method.predict`."""
        frame = frame.copy()  # by the time the variance is asked for, it may hold another one
        X = self._gaps.fill(frame)
        Y, own = self._map(X)
        if own is None:
            return Prediction(Y, None, X)
        return _FramePrediction(Y, X, lambda: own() + self._fill(frame, input_variance)[1])


class _FramePrediction(Prediction):
    """A prediction whose standard deviation is worked out on demand."""

    def __init__(self, Y: FloatArray, X: FloatArray, variance: Variance) -> None:
        vars(self).update(Y=Y, X=X, _variance=variance)  # it is frozen

    @cached_property
    def std(self) -> FloatArray:
        """Standard deviation of the pose, (1, d_y)."""
        return np.asarray(np.sqrt(vars(self)["_variance"]()))

"""A method on a source of many columns, which it sees by its leading directions.

The scores of frames (see `facert.models.leading_directions`) take the place of the frames. They are
divided by the square root of how many times `DENSE` the columns are, so that the source looks as if
fewer markers had recorded it: what methods hold for small, or for noise, was set for some forty.
"""

from __future__ import annotations

from collections.abc import Container, Mapping
from copy import copy
from dataclasses import replace
from functools import cached_property
from typing import ClassVar, Self

import numpy as np

from facert.data.array_group import (
    DAMAGED,
    Shaped,
    check_axes,
    part_of,
    require_known_arrays,
)
from facert.data.arrays import FloatArray
from facert.data.normalisation import Normalisation
from facert.errors import InputError
from facert.methods.base import (
    Labelled,
    Method,
    Prediction,
    Stream,
    TrainingReport,
    Unlabelled,
    WarmStart,
)
from facert.models.leading_directions import RANK, LeadingDirections
from facert.models.optim.monitor import Monitor
from facert.models.threads import threads_for
from facert.settings import Settings

FRAMES = 1000
"""Frames with a pose, and without, that directions are found from, at most, evenly spread."""
DIRECTIONS, INNER = "directions.", "scores."
"""What stands before the names of arrays of the directions, and of the method on the scores."""


def is_dense(arrays: Container[str]) -> bool:
    """Whether arrays with these names are those of a method on leading directions."""
    return f"{DIRECTIONS}basis" in arrays


class Dense:
    """A method whose frames are scores.

    Parameters
    ----------
    method : Method
        Untrained.
    """

    most_unlabelled: ClassVar[int | None] = None
    stepwise: ClassVar[bool] = False

    directions_: LeadingDirections

    def __init__(self, method: Method) -> None:
        self.method = method
        self.settings: Settings = method.settings
        self._begun = False

    @property
    def dimensions(self) -> tuple[int, int]:
        """Dimensions d_x and d_y of the training data."""
        return len(self.directions_.mean), self.method.dimensions[1]

    def fit(
        self, labelled: Labelled, unlabelled: Unlabelled, monitor: Monitor | None = None
    ) -> TrainingReport:
        """Find the directions of all frames, and fit the method to the scores."""
        with threads_for(RANK):
            if not self._begun:
                some = [X[:: max(-(-len(X) // FRAMES), 1)] for X in (labelled.X, unlabelled.X)]
                self.directions_ = LeadingDirections.learned(np.vstack(some))
            own = Labelled(self.scores(labelled.X), labelled.Y)
            rest = replace(unlabelled, X=self.scores(unlabelled.X))
        report = self.method.fit(own, rest, monitor or Monitor())
        self.settings = self.method.settings  # it filled in what was open
        return report

    def scores(self, X: FloatArray) -> FloatArray:
        """The scores of complete frames (T, d_x) as the method is given them, (T, r)."""
        return self.directions_.scores(X) / self.directions_.density

    def given(
        self, frames: FloatArray, input_variance: FloatArray | None
    ) -> tuple[FloatArray, FloatArray, FloatArray | None]:
        """Filled frames (T, d_x), their scores, and the variance of these, (T, r).

        Columns beside each other are filled with one error: as many as count for one of a source
        of `DENSE` columns. So the variance of a score is not divided as its square is.
        """
        found = self.directions_
        filled, variance = found.fill(frames)
        if variance is not None:
            variance = variance / found.density**2
        if input_variance is not None:
            own = np.nan_to_num(input_variance) @ self._squares
            variance = own if variance is None else own + variance
        return filled, self.scores(filled), variance

    @cached_property
    def _squares(self) -> FloatArray:
        return np.asarray(self.directions_.basis**2)

    def cleaned(self, filled: FloatArray, scores: FloatArray, by_method: FloatArray) -> FloatArray:
        """Filled frames (T, d_x); of a method that cleans scores, what these stand for."""
        if np.array_equal(by_method, scores):
            return filled
        found = self.directions_
        return np.asarray(found.mean + found.density * by_method @ found.basis.T)

    def predict(self, frames: FloatArray, input_variance: FloatArray | None = None) -> Prediction:
        """Map frames (T, d_x), each on its own; NaN: not observed. See `Method.predict`."""
        with threads_for(RANK):
            filled, scores, variance = self.given(frames, input_variance)
            found = self.method.predict(scores, variance)
            return replace(found, X=self.cleaned(filled, scores, found.X))

    def unclipped(self) -> Self:
        """A copy without limits; see `Method.unclipped`."""
        return self._with(self.method.unclipped())

    def on(self, device: str) -> Self:
        """A copy that maps on a device; see `Method.on`."""
        return self._with(self.method.on(device))

    def _with(self, method: Method) -> Self:
        other = copy(self)
        other.method = method
        return other

    def stream(self) -> Stream:
        """Begin to map frames one after the other."""
        return _DenseStream(self)

    def save(self) -> dict[str, FloatArray]:
        """The directions, and what the method learned."""
        own = {f"{DIRECTIONS}{name}": array for name, array in self.directions_.arrays.items()}
        return own | {f"{INNER}{name}": array for name, array in self.method.save().items()}

    def check(self, arrays: Mapping[str, Shaped]) -> tuple[int, int]:
        """Dimensions d_x and d_y of arrays that `load` could take over; see `Method.check`."""
        axes = {f"{DIRECTIONS}{name}": a for name, a in LeadingDirections.all_axes().items()}
        require_known_arrays([name for name in arrays if not name.startswith(INNER)], axes)
        sizes = check_axes(arrays, axes)
        if sizes["r"] > RANK:
            expected, found = f"at most {RANK} columns", f"{sizes['r']}"
            raise InputError(f"{DIRECTIONS}basis", expected, found, DAMAGED)
        rank, d_y = self.method.check(part_of(arrays, INNER))
        if rank != sizes["r"]:
            expected, found = f"{sizes['r']} columns", f"{rank}"
            raise InputError(INNER.rstrip("."), expected, found, DAMAGED)
        return sizes["x"], d_y

    def load(self, arrays: Mapping[str, FloatArray]) -> None:
        """Take over what `save` returned.

        Raises
        ------
        InputError
            When an array is absent, shapes do not fit together, or a variance is negative.
        """
        self.check(arrays)
        found = LeadingDirections.of(arrays, DIRECTIONS)
        self.method.load(part_of(arrays, INNER))
        self.directions_ = found


class DenseStepwise(Dense):
    """The same of a method that trains step by step."""

    stepwise: ClassVar[bool] = True

    def begin_at(self, other: Method, source: Normalisation, target: Normalisation) -> None:
        """Let `fit` begin at a trained model, and keep its directions; see `WarmStart.begin_at`."""
        assert isinstance(other, Dense)
        assert isinstance(self.method, WarmStart)
        before = other.directions_
        # In other units the directions are the same, and all lengths change alike.
        self.directions_ = LeadingDirections(
            (before.mean - source.mean) / source.scale,
            before.basis,
            before.variances / source.scale**2,
            before.noise / source.scale**2,
        )
        self._begun = True
        of_scores = Normalisation(np.zeros(before.basis.shape[1]), source.scale)
        self.method.begin_at(other.method, of_scores, target)


class _DenseStream:
    """Maps frames one after the other by their scores."""

    def __init__(self, method: Dense) -> None:
        self._method, self._stream = method, method.method.stream()

    def step(self, frame: FloatArray, input_variance: FloatArray | None = None) -> Prediction:
        """Map one more frame (1, d_x); see `facert.methods.base.Method.predict`."""
        filled, scores, variance = self._method.given(frame, input_variance)
        found = self._stream.step(scores, variance)
        return _FramePrediction(self._method, filled.copy(), scores, found)


class _FramePrediction(Prediction):
    """A prediction whose deviation and cleaned source, seldom wanted, are worked out on demand."""

    def __init__(
        self, method: Dense, filled: FloatArray, scores: FloatArray, found: Prediction
    ) -> None:
        vars(self).update(Y=found.Y, _of=(method, filled, scores, found))  # it is frozen

    @cached_property
    def std(self) -> FloatArray | None:
        """Standard deviation of the pose, (1, d_y), where the method has one."""
        std: FloatArray | None = vars(self)["_of"][3].std
        return std

    @cached_property
    def X(self) -> FloatArray:
        """The cleaned source, (1, d_x)."""
        method, filled, scores, found = vars(self)["_of"]
        return np.asarray(method.cleaned(filled, scores, found.X))

"""A cell of an evaluation: one method on one draw of the data, and what came of it."""

from __future__ import annotations

import logging
import time
import traceback
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from facert.data.take import Take
from facert.data.typed import typed
from facert.errors import FacertError
from facert.evaluation.metrics import Scores, score
from facert.evaluation.protocol import Draw, Problem, draw, held_out_take, training_take, true_poses
from facert.models.threads import threads_for
from facert.preprocess.training_set import MIN_LABELS
from facert.retarget.options import AS_IT_IS
from facert.retarget.training import train
from facert.settings import Settings


@dataclass(frozen=True)
class Cell:
    """One evaluated case: a method, the numbers of labels and unlabelled data, the repeat."""

    method: str
    labels: int
    unlabelled: int
    repeat: int


@dataclass(frozen=True)
class Outcome:
    """Result of evaluating one cell."""

    cell: Cell
    scores: Scores | None = None  # None when the method could not run
    fit_seconds: float = 0.0  # Training, wall-clock
    frame_ms: float = 0.0  # Mapping, milliseconds a frame, all frames at once
    failure: str = ""  # Why the method could not run; empty when it did
    details: str = ""  # The traceback of an unexpected failure; empty for others

    def as_dict(self) -> dict[str, Any]:
        """Convert to plain values for a file."""
        return asdict(self)

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Outcome:
        """Rebuild an outcome from what `as_dict` made.

        Raises
        ------
        InputError
            When the values are of something else.
        """
        return typed(cls, values, "the outcome", "Evaluate the cell again.")


def evaluate(problem: Problem, cell: Cell, settings: Settings) -> Outcome:
    """Train and test a method on the draw of its cell, on one thread.

    Whatever goes wrong is in the outcome: one cell never ends an evaluation.

    Parameters
    ----------
    problem : Problem
    cell : Cell
    settings : Settings
        Everything about training that the cell leaves open.
    """
    with threads_for(1), _quiet():
        try:
            chosen = draw(problem, cell.labels, cell.unlabelled, cell.repeat)
            return _evaluate(problem, cell, chosen, cell_settings(problem, cell, settings))
        except FacertError as error:
            return Outcome(cell, failure=str(error))
        except Exception as error:
            failure = " ".join(f"unexpected {type(error).__name__}: {error}".split())
            return Outcome(cell, failure=failure, details=traceback.format_exc())


def cell_settings(problem: Problem, cell: Cell, settings: Settings) -> Settings:
    """The settings with which a cell is trained: all labels and unlabelled data of its draw.

    Frames are drawn at random, so each is taken as it was measured.
    """
    return replace(
        settings,
        method=cell.method,
        labels=None,
        unlabelled=cell.unlabelled,
        seed=problem.protocol.seed + cell.repeat,
        detect=False,
        smooth=False,
    )


def _evaluate(problem: Problem, cell: Cell, chosen: Draw, settings: Settings) -> Outcome:
    _warm_up(problem, settings)
    training = training_take(problem, chosen, cell.repeat)
    frames = held_out_take(problem, chosen, cell.repeat)
    began = time.perf_counter()
    retargeter = train(training, settings)
    trained = time.perf_counter()
    result: Take = retargeter.retarget(frames, options=AS_IT_IS, device=settings.device)
    ended = time.perf_counter()
    assert result.params is not None  # retarget poses every frame
    errors = result.params - true_poses(problem, chosen)
    if not np.isfinite(errors).all():
        return Outcome(cell, failure="poses that are not finite")
    return Outcome(
        cell,
        score(errors, problem.in_time(chosen.test), problem.ranges, problem.gram),
        fit_seconds=trained - began,
        frame_ms=1e3 * (ended - trained) / len(frames),
    )


_warm: set[str] = set()
"""Methods that this process has run: the first run of each imports its libraries."""


def _warm_up(problem: Problem, settings: Settings) -> None:
    """Run a method once on little data, so that no import counts in the time of the first cell."""
    if settings.method in _warm:
        return
    _warm.add(settings.method)
    with suppress(FacertError):
        few = draw(problem, MIN_LABELS, 0, 0)
        short = replace(settings, unlabelled=0, max_iterations=1)
        train(training_take(problem, few, 0), short).retarget(held_out_take(problem, few, 0))


@contextmanager
def _quiet() -> Iterator[None]:
    """Silence the log: the notes of training would come hundreds of times."""
    before = logging.root.manager.disable
    logging.disable(logging.WARNING)
    try:
        yield
    finally:
        logging.disable(before)

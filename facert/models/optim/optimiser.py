"""The interface of an optimiser: a state that can be saved, and a way to advance it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Literal, Protocol

import numpy as np

from facert.data.arrays import FloatArray
from facert.errors import NumericalError

Objective = Callable[[FloatArray], tuple[float, FloatArray]]
Status = Literal["converged", "iteration limit", "stalled", "interrupted"]


@dataclass(frozen=True)
class State:
    """State of a minimisation after an iteration."""

    x: FloatArray  # (n,): Best vector so far
    value: float  # Objective at x
    gradient_norm: float  # Euclidean norm of the gradient at x
    iterations: int  # Iterations so far
    # Whatever else the optimiser goes on from, exactly as if it had not stopped
    memory: Mapping[str, FloatArray] = field(default_factory=dict)
    stalled: bool = False  # No further descent is possible from here


# Called after each iteration that descended; True ends the run.
Watcher = Callable[[State], bool]


class Optimiser(Protocol):
    """A minimiser that can be stopped after any `advance` and resumed from its state."""

    def start(self, objective: Objective, x: FloatArray) -> State:
        """The state before the first iteration."""
        ...

    def advance(self, objective: Objective, state: State, iterations: int, watch: Watcher) -> State:
        """Run at most so many further iterations; `watch` sees each descent and may end the run."""
        ...


@dataclass(frozen=True)
class Result:
    """Outcome of a minimisation."""

    # Objective and norm of its gradient at the end
    value: float
    gradient_norm: float
    # How many were made; evaluations count this run only, not those before a resume
    iterations: int
    evaluations: int
    seconds: float  # Wall-clock time of this run
    status: Status  # Why it ended
    message: str  # The same for people


def initial_state(objective: Objective, x: FloatArray) -> tuple[State, FloatArray]:
    """Evaluate the start and refuse one that has no finite value."""
    value, gradient = objective(x)
    if not np.isfinite(value):
        raise NumericalError("the objective is not finite at the start of the optimisation")
    return State(x.copy(), value, float(np.linalg.norm(gradient)), 0), gradient

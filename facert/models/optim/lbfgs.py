"""L-BFGS through SciPy, run in stages that can be resumed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.optimize import OptimizeResult, minimize

from facert.data.arrays import FloatArray
from facert.models.optim.optimiser import Objective, State, Watcher, initial_state

MOST_REMEMBERED = 2**28  # bytes of gradients that a stage may remember
LEAST_ITERATIONS = 20  # of a stage, however large its gradients are


class LBFGS:
    """Limited-memory BFGS (Byrd, Lu, Nocedal and Zhu 1995).

    There are no bounds: they would double what SciPy itself takes for an iteration, and where an
    exponential overflows the objective is infinite, which is survived.

    SciPy does not hand out its correction pairs, so that each stage begins with an empty memory,
    and a state within a stage remembers what the objective was since it began. When such a state is
    resumed, SciPy is told the same again, and goes on exactly as a run that was not interrupted.

    Parameters
    ----------
    corrections : int
        Pairs kept; 20 suits latent coordinates.
    """

    def __init__(self, corrections: int = 20) -> None:
        self.corrections = corrections

    def start(self, objective: Objective, x: FloatArray) -> State:
        """The state before the first iteration."""
        return initial_state(objective, x)[0]

    def advance(self, objective: Objective, state: State, iterations: int, watch: Watcher) -> State:
        """Run at most so many further iterations; `watch` sees each and may end the run."""
        most = max(LEAST_ITERATIONS, MOST_REMEMBERED // state.x.nbytes)
        stage = _Stage(objective, state, watch)
        made = state.iterations - stage.begin.iterations
        length = stage.length = min(made + iterations, most)
        found = minimize(
            stage.evaluate,
            stage.begin.x,
            jac=True,
            method="L-BFGS-B",
            callback=stage.note,
            options={
                "maxiter": length,
                "maxfun": 20 * length,
                "maxcor": self.corrections,
                # Convergence is judged in one place for all optimisers, by the watcher.
                "ftol": 0.0,
                "gtol": 0.0,
            },
        )
        # 0 and 2 end by themselves: no descent is left. 1 is the iteration limit, 99 the watcher.
        return replace(stage.state, stalled=found.status in (0, 2), memory={})


class _Stage:
    """One run of SciPy's minimiser: its objective, and the state it has come to."""

    def __init__(self, objective: Objective, state: State, watch: Watcher) -> None:
        self.begin, self.values = _remembered(state, objective)
        self.state, self.watch, self._resumed = self.begin, watch, state.iterations
        self.length = 0  # in iterations; set once it is known
        self._gradient = np.zeros_like(state.x)  # at the state; set by the first evaluation
        self._gradients: dict[bytes, FloatArray] = {}  # since the last iteration

    def evaluate(self, x: FloatArray) -> tuple[float, FloatArray]:
        value, gradient = self.values(x)
        if not np.isfinite(value):
            return self._steep(x)
        self._gradients[x.tobytes()] = gradient
        if np.array_equal(x, self.state.x):
            self._gradient = gradient
        return value, gradient

    def _steep(self, x: FloatArray) -> tuple[float, FloatArray]:
        """A large finite value for infinity, which SciPy's line search cannot take.

        A parabola from the state through x, so steep that its minimum is a tenth of the way.
        """
        step = x - self.state.x
        fall = abs(float(self._gradient @ step))
        return self.state.value + 4.0 * fall, 9.0 * fall / float(step @ step) * step

    def note(self, intermediate_result: OptimizeResult) -> None:
        x = np.array(intermediate_result.x)
        self._gradient = self._gradients[x.tobytes()]
        self._gradients.clear()
        norm, iterations = float(np.linalg.norm(self._gradient)), self.state.iterations + 1
        memory = _begin_arrays(self.begin, self.length) | self.values.arrays
        self.state = State(x, float(intermediate_result.fun), norm, iterations, memory)
        if iterations > self._resumed and self.watch(self.state):
            raise StopIteration


class _Remembering:
    """An objective that remembers its values and gradients in the order in which it was called.

    Those that it knows already are returned for the first calls.
    """

    def __init__(self, objective: Objective, values: FloatArray, gradients: FloatArray) -> None:
        self._objective = objective
        self._values, self._gradients = values, gradients
        self._known, self._calls = len(values), 0

    def __call__(self, x: FloatArray) -> tuple[float, FloatArray]:
        if self._calls == self._known:
            self._add(*self._objective(x))
        self._calls += 1
        return float(self._values[self._calls - 1]), self._gradients[self._calls - 1].copy()

    @property
    def arrays(self) -> dict[str, FloatArray]:
        """What was returned so far; views, as this is asked for after every iteration."""
        return {"values": self._values[: self._calls], "gradients": self._gradients[: self._calls]}

    def _add(self, value: float, gradient: FloatArray) -> None:
        if self._known == len(self._values):  # twice the room
            more = max(self._known, 16)
            self._values = np.concatenate([self._values, np.empty(more)])
            empty = np.empty((more, len(gradient)))
            self._gradients = np.concatenate([self._gradients, empty])
        self._values[self._known], self._gradients[self._known] = value, gradient
        self._known += 1


def _begin_arrays(begin: State, length: int) -> dict[str, FloatArray]:
    scalars = [begin.value, begin.gradient_norm, float(begin.iterations), float(length)]
    return {"begin": begin.x, "scalars": np.array(scalars)}


def _remembered(state: State, objective: Objective) -> tuple[State, _Remembering]:
    """The state that the stage of another one began at, and the objective as it was since then."""
    value, norm, iterations, length = state.memory.get("scalars", np.zeros(4)).tolist()
    if state.iterations >= iterations + length:  # that stage is over, or there is none
        fresh = replace(state, memory={})
        return fresh, _Remembering(objective, np.empty(0), np.empty((0, len(state.x))))
    begin = State(state.memory["begin"], value, norm, int(iterations))
    known = state.memory["values"], state.memory["gradients"]
    return begin, _Remembering(objective, *known)

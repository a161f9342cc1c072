"""L-BFGS through SciPy, run in stages that can be resumed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.optimize import OptimizeResult, minimize

from facert.data.arrays import FloatArray
from facert.models.optim.optimiser import Objective, State, Watcher, initial_state


class LBFGS:
    """Limited-memory BFGS (Byrd, Lu, Nocedal and Zhu 1995).

    There are no bounds: they would double what SciPy itself takes for an iteration, and where an
    exponential overflows the objective is infinite, which is survived.

    SciPy does not hand out its correction pairs, so that each `advance` begins with an empty
    memory. A run that was stopped between two stages and resumed therefore retraces an
    uninterrupted one exactly.

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
        stage = _Stage(objective, state, watch)
        found = minimize(
            stage.evaluate,
            state.x,
            jac=True,
            method="L-BFGS-B",
            callback=stage.note,
            options={
                "maxiter": iterations,
                "maxfun": 20 * iterations,
                "maxcor": self.corrections,
                # Convergence is judged in one place for all optimisers, by the watcher.
                "ftol": 0.0,
                "gtol": 0.0,
            },
        )
        # 0 and 2 end by themselves: no descent is left. 1 is the iteration limit, 99 the watcher.
        return replace(stage.state, stalled=found.status in (0, 2))


class _Stage:
    """One run of SciPy's minimiser: its objective, and the state it has come to."""

    def __init__(self, objective: Objective, state: State, watch: Watcher) -> None:
        self.objective, self.state, self.watch = objective, state, watch
        self._gradient = np.zeros_like(state.x)  # at the state; set by the first evaluation
        self._gradients: dict[bytes, FloatArray] = {}  # since the last iteration

    def evaluate(self, x: FloatArray) -> tuple[float, FloatArray]:
        value, gradient = self.objective(x)
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
        norm = float(np.linalg.norm(self._gradient))
        self.state = State(x, float(intermediate_result.fun), norm, self.state.iterations + 1)
        if self.watch(self.state):
            raise StopIteration

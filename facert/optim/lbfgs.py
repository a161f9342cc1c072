"""L-BFGS-B through SciPy, run in stages that can be resumed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.optimize import OptimizeResult, minimize

from facert.data import FloatArray
from facert.optim.base import Objective, State, Watcher, initial_state


class LBFGS:
    """Limited-memory BFGS with bounds (Byrd, Lu, Nocedal and Zhu 1995).

    SciPy does not hand out its correction pairs, so that each `advance` begins with an empty
    memory. A run that was stopped between two stages and resumed therefore retraces an
    uninterrupted one exactly.

    Parameters
    ----------
    corrections : int
        Pairs kept; 20 suits latent coordinates.
    bound : float
        Box on every variable. Far outside of any sensible log-parameter or latent coordinate; it
        keeps the line search from overflowing the exponentials.
    """

    def __init__(self, corrections: int = 20, bound: float = 30.0) -> None:
        self.corrections = corrections
        self.bound = bound

    def start(self, objective: Objective, x: FloatArray) -> State:
        """The state before the first iteration."""
        return initial_state(objective, x)[0]

    def advance(self, objective: Objective, state: State, iterations: int, watch: Watcher) -> State:
        """At most so many further iterations; `watch` sees each and may end the run."""
        latest = state
        gradients: dict[bytes, float] = {}

        def evaluate(x: FloatArray) -> tuple[float, FloatArray]:
            value, gradient = objective(x)
            gradients[x.tobytes()] = float(np.linalg.norm(gradient))
            return value, gradient

        def callback(intermediate_result: OptimizeResult) -> None:
            nonlocal latest
            x = np.array(intermediate_result.x)
            norm = gradients.get(x.tobytes(), np.nan)
            gradients.clear()
            latest = State(x, float(intermediate_result.fun), norm, latest.iterations + 1)
            if watch(latest):
                raise StopIteration

        found = minimize(
            evaluate,
            state.x,
            jac=True,
            method="L-BFGS-B",
            bounds=[(-self.bound, self.bound)] * len(state.x),
            callback=callback,
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
        return replace(latest, stalled=found.status in (0, 2))

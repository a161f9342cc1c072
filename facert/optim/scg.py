"""Scaled conjugate gradients (Møller 1993), the optimiser of Bouaziz and Pauly (2014)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from facert.data import FloatArray
from facert.optim.base import Objective, State, Watcher, initial_state

SIGMA = 1e-5  # step of the finite difference that gives the curvature, relative to 1/|p|
LAMBDA_START, LAMBDA_MIN, LAMBDA_MAX = 1e-6, 1e-15, 1e20


class SCG:
    """Conjugate gradients whose step length comes from a scaled curvature, without line search.

    Steps are numbered as in Møller's algorithm. Value and gradient come from one call, so that an
    iteration costs two calls: one for the curvature along p (step 2), one for the trial (step 5).
    The state holds gradient, direction and scale: a resumed run continues exactly.
    """

    def start(self, objective: Objective, x: FloatArray) -> State:
        """Step 1: the first direction is the steepest descent."""
        state, gradient = initial_state(objective, x)
        memory = _memory(gradient, -gradient, LAMBDA_START, np.nan, 0)
        return replace(state, memory=memory)

    def advance(self, objective: Objective, state: State, iterations: int, watch: Watcher) -> State:
        """At most so many further iterations; `watch` sees each and may end the run."""
        for _ in range(iterations):
            state = self._step(objective, state)
            if state.stalled or watch(state):
                break
        return state

    def _step(self, objective: Objective, state: State) -> State:
        x, value = state.x, state.value
        gradient, direction = state.memory["gradient"], state.memory["direction"]
        scale, curvature, successes = state.memory["scalars"]

        slope = float(direction @ gradient)
        if slope >= 0.0:  # no longer a descent direction: begin again
            direction, slope, curvature, successes = (
                -gradient,
                -float(gradient @ gradient),
                np.nan,
                0,
            )
        squared = float(direction @ direction)
        if squared == 0.0:
            return replace(state, stalled=True)

        if np.isnan(curvature):  # step 2; after a rejected trial x and p are the same, and so is it
            sigma = SIGMA / np.sqrt(squared)
            _, ahead = objective(x + sigma * direction)
            curvature = float(direction @ (ahead - gradient)) / sigma

        # Steps 3 and 4: make the scaled curvature positive.
        scaled = curvature + scale * squared
        if scaled <= 0.0:
            scale = 2.0 * (scale - scaled / squared)
            scaled = curvature + scale * squared
        alpha = -slope / scaled

        # Steps 5 to 7: compare the decrease with the quadratic model's.
        trial = x + alpha * direction
        trial_value, trial_gradient = objective(trial)
        comparison = 2.0 * scaled * (value - trial_value) / slope**2
        accepted = bool(comparison >= 0.0)  # false for an infinite trial value as well

        if not accepted or comparison < 0.25:
            rise = scaled * (1.0 - comparison) / squared if np.isfinite(comparison) else 4.0 * scale
            scale = max(scale + rise, 4.0 * scale)
        elif comparison > 0.75:
            scale = max(0.25 * scale, LAMBDA_MIN)

        iterations = state.iterations + 1
        if not accepted:
            memory = _memory(gradient, direction, scale, curvature, successes)
            return replace(state, iterations=iterations, memory=memory, stalled=scale > LAMBDA_MAX)
        successes += 1
        if successes % len(x) == 0:
            direction = -trial_gradient
        else:
            beta = float(trial_gradient @ (trial_gradient - gradient)) / -slope
            direction = beta * direction - trial_gradient
        memory = _memory(trial_gradient, direction, scale, np.nan, successes)
        norm = float(np.linalg.norm(trial_gradient))
        return State(trial, trial_value, norm, iterations, memory)


def _memory(
    gradient: FloatArray, direction: FloatArray, scale: float, curvature: float, successes: float
) -> dict[str, FloatArray]:
    return {
        "gradient": gradient,
        "direction": direction,
        "scalars": np.array([scale, curvature, successes]),
    }

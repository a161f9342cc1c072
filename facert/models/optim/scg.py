"""Scaled conjugate gradients (Møller 1993), the optimiser of Bouaziz and Pauly (2014)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from facert.data.arrays import FloatArray
from facert.models.optim.optimiser import Objective, State, Watcher, initial_state

SIGMA = 1e-5  # step of the finite difference that gives the curvature, relative to 1/|p|
SCALE_START, SCALE_MIN, SCALE_MAX = 1e-6, 1e-15, 1e20  # Møller's λ
FLAT = 1e-150  # a slope this small cannot be squared
# Comparison (step 6) that stands for an infinite trial: the next step is a fifth as long.
INFINITELY_WORSE = -3.0


@dataclass(frozen=True)
class _Memory:
    """State of the search besides x; the curvature along p is known after a rejection."""

    gradient: FloatArray
    direction: FloatArray
    scale: float
    successes: int = 0
    curvature: float | None = None

    @classmethod
    def of(cls, arrays: Mapping[str, FloatArray]) -> _Memory:
        scale, successes, *curvature = arrays["scalars"].tolist()
        known = curvature[0] if curvature else None
        return cls(arrays["gradient"], arrays["direction"], scale, int(successes), known)

    def arrays(self) -> dict[str, FloatArray]:
        known = [] if self.curvature is None else [self.curvature]
        return {
            "gradient": self.gradient,
            "direction": self.direction,
            "scalars": np.array([self.scale, self.successes, *known]),
        }

    def descending(self) -> _Memory:
        """Steepest descent in place of a direction that no longer descends."""
        if self.direction @ self.gradient < 0.0:
            return self
        return _Memory(self.gradient, -self.gradient, self.scale)


class SCG:
    """Conjugate gradients whose step length comes from a scaled curvature, without line search.

    Steps are numbered as in Møller's algorithm. Value and gradient come from one call, so that an
    iteration costs two calls: one for the curvature along p (step 2), one for the trial (step 5).
    The state holds gradient, direction and scale: a resumed run continues exactly.
    """

    def start(self, objective: Objective, x: FloatArray) -> State:
        """Step 1: the first direction is the steepest descent."""
        state, gradient = initial_state(objective, x)
        return replace(state, memory=_Memory(gradient, -gradient, SCALE_START).arrays())

    def advance(self, objective: Objective, state: State, iterations: int, watch: Watcher) -> State:
        """Run at most so many further iterations; `watch` sees each descent and may end the run."""
        for _ in range(iterations):
            before = state.value
            state = self._step(objective, state)
            # A rejected trial is no sign of convergence: the next one is shorter.
            if state.stalled or (state.value < before and watch(state)):
                break
        return state

    def _step(self, objective: Objective, state: State) -> State:
        memory = _Memory.of(state.memory).descending()
        gradient, direction = memory.gradient, memory.direction
        slope = float(direction @ gradient)
        squared = float(direction @ direction)
        if slope > -FLAT:
            return replace(state, stalled=True)

        curvature = memory.curvature
        if curvature is None:  # step 2
            sigma = SIGMA / np.sqrt(squared)
            _, ahead = objective(state.x + sigma * direction)
            curvature = float(direction @ (ahead - gradient)) / sigma
        scale = memory.scale
        scaled = curvature + scale * squared  # step 3
        if scaled <= 0.0:  # step 4
            scale = 2.0 * (scale - scaled / squared)
            scaled = curvature + scale * squared

        trial = state.x - slope / scaled * direction  # step 5
        value, trial_gradient = objective(trial)
        comparison = INFINITELY_WORSE
        if np.isfinite(value):  # step 6
            comparison = 2.0 * scaled * (state.value - value) / slope**2
        scale = _rescaled(scale, scaled / squared, comparison)  # steps 7 and 8
        state = replace(state, iterations=state.iterations + 1, stalled=scale > SCALE_MAX)

        if comparison < 0.0:
            rejected = replace(memory, scale=scale, curvature=curvature)
            return replace(state, memory=rejected.arrays())
        successes = memory.successes + 1
        following = -trial_gradient
        if successes % len(trial):  # otherwise begin again with the steepest descent
            beta = float(trial_gradient @ (trial_gradient - gradient)) / -slope
            following += beta * direction
        accepted = _Memory(trial_gradient, following, scale, successes)
        return replace(
            state,
            x=trial,
            value=value,
            gradient_norm=float(np.linalg.norm(trial_gradient)),
            memory=accepted.arrays(),
        )


def _rescaled(scale: float, curvature: float, comparison: float) -> float:
    """λ for the next step, by how well the quadratic model predicted this one's decrease."""
    if comparison < 0.25:
        return max(scale + curvature * (1.0 - comparison), 4.0 * scale)
    if comparison > 0.75:
        return max(0.25 * scale, SCALE_MIN)
    return scale

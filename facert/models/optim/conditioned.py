"""A search in stages, each in variables in which the curvature where it begins is the identity.

The shared model is badly conditioned: conjugate gradients and L-BFGS take hundreds of iterations,
on the way of which rounding grows a billionfold, so that they end somewhere else on every machine.
With the Hessian at the beginning of each stage, H + shift = L Lᵀ, and y = Lᵀ x in place of x, a few
dozen iterations reach the end, and rounding has no time to grow. The first stage goes without: far
from the end the Hessian soon means nothing, and its iterations are cheap.

Where the watcher ends the run the gradient is small, and not yet zero. Newton's method for a zero
of the gradient then leads to the same point from wherever near it the run has ended.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Protocol, runtime_checkable

import numpy as np

from facert.data.arrays import FloatArray
from facert.models.optim.arrow import Arrow, ArrowFactor
from facert.models.optim.optimiser import Objective, Optimiser, State, Watcher

FIRST, STAGE = 40, 20  # iterations of the first stage, and of each other
LAST = 6  # steps of Newton's method at the end, at most
SHORTER = (1.0, 0.5, 0.25, 0.1)  # of a step, where the gradient has grown after it
SETTLED = 1e-6  # a longest step of any variable after which no other is needed
# Added to the Hessian, relative to its diagonal, until it is positive definite. The least keeps
# directions out in which nothing changes, such as rotations of latent coordinates.
SHIFTS = tuple(10.0**power for power in range(-6, 4))


@runtime_checkable
class Curved(Protocol):
    """An objective that knows its second derivatives."""

    def curvature(self, x: FloatArray) -> Arrow | None:
        """The Hessian at x; None where it cannot be had."""
        ...


class Conditioned:
    """An optimiser in conditioned variables; in plain ones where the objective is not `Curved`.

    A stage does not know of the one before, and states within one remember where it began, so that
    a run that is resumed from any of them goes on as if it had not stopped.

    Parameters
    ----------
    inner : Optimiser
        How to descend within a stage.
    """

    def __init__(self, inner: Optimiser) -> None:
        self.inner = inner

    def start(self, objective: Objective, x: FloatArray) -> State:
        """The state before the first iteration."""
        return self.inner.start(objective, x)

    def advance(self, objective: Objective, state: State, iterations: int, watch: Watcher) -> State:
        """Run at most so many further iterations; `watch` sees each and may end the run."""
        end, watched = state.iterations + iterations, _Watched(watch)
        while state.iterations < end and not watched.over:
            before = state
            state = self._next(objective, state, end, watched)
            if state.stalled and before.stalled and not state.value < before.value:
                return state  # neither of two stages has found a descent
        if watched.over:
            ended, state = state, _settled(objective, state)
            if state is not ended:
                watch(state)
        return state

    def _next(self, objective: Objective, state: State, end: int, watch: Watcher) -> State:
        """The state after the rest of a stage, or after the next one."""
        if "stage" in state.memory:
            return self._resume(objective, state, watch)
        left = end - state.iterations
        if state.iterations < FIRST and not state.stalled:
            return self._plain(objective, state, min(FIRST - state.iterations, left), watch)
        factor = _factor(objective, state.x)
        if factor is not None:
            return self._begin(_Stage(objective, factor, state, min(STAGE, left)), watch)
        return state if state.stalled else self._plain(objective, state, left, watch)

    def _plain(self, objective: Objective, state: State, left: int, watch: Watcher) -> State:
        """Descend in the variables of the run."""
        if not state.memory:  # a conditioned stage leaves none
            state = replace(state, memory=self.inner.start(objective, state.x).memory)
        return self.inner.advance(objective, state, left, watch)

    def _begin(self, stage: _Stage, watch: Watcher) -> State:
        began = stage.began
        inner = self.inner.start(stage.evaluate, np.zeros_like(began.x))
        state = State(inner.x, began.value, inner.gradient_norm, began.iterations, inner.memory)
        return self._descend(stage, state, stage.length, watch)

    def _resume(self, objective: Objective, state: State, watch: Watcher) -> State:
        """Finish the stage within which a state was kept."""
        value, norm, iterations, length, inner_norm = state.memory["of_stage"].tolist()
        began = State(state.memory["stage"], value, norm, int(iterations))
        left = began.iterations + int(length) - state.iterations
        # Without a factor there it began on a machine that rounds otherwise.
        factor = _factor(objective, began.x) if left else None
        if factor is None:
            return replace(state, memory={})
        stage = _Stage(objective, factor, began, int(length))
        within = State(state.memory["y"], state.value, inner_norm, state.iterations, state.memory)
        return self._descend(stage, within, left, watch)

    def _descend(self, stage: _Stage, state: State, left: int, watch: Watcher) -> State:
        ended = self.inner.advance(stage.evaluate, state, left, lambda s: watch(stage.within(s)))
        return stage.restored(ended)


class _Watched:
    """A watcher that remembers whether the run is over."""

    def __init__(self, watch: Watcher) -> None:
        self.watch, self.over = watch, False

    def __call__(self, state: State) -> bool:
        self.over = self.watch(state)
        return self.over


class _Stage:
    """The objective in the variables of a stage, and its states in those of the run."""

    def __init__(
        self, objective: Objective, factor: ArrowFactor, began: State, length: int
    ) -> None:
        self.objective, self.factor, self.began = objective, factor, began
        self.length = length  # in iterations
        self._norms: dict[bytes, float] = {}  # of the gradients since the last iteration

    def evaluate(self, y: FloatArray) -> tuple[float, FloatArray]:
        value, gradient = self.objective(self.began.x + self.factor.restore(y))
        self._norms[y.tobytes()] = float(np.linalg.norm(gradient))
        return value, self.factor.whiten(gradient)

    def within(self, state: State) -> State:
        """The restored state, which remembers where the stage began."""
        began, restored = self.began, self.restored(state)
        scalars = [began.value, began.gradient_norm, began.iterations, self.length]
        of_stage = np.array([*scalars, state.gradient_norm])
        own = {"stage": began.x, "of_stage": of_stage, "y": state.x}
        return replace(restored, memory={**state.memory, **own})

    def restored(self, state: State) -> State:
        norm = self._norms.get(state.x.tobytes(), self.began.gradient_norm)
        self._norms = {state.x.tobytes(): norm}
        x = self.began.x + self.factor.restore(state.x)
        return State(x, state.value, norm, state.iterations, stalled=state.stalled)


def _settled(objective: Objective, state: State) -> State:
    """The zero of the gradient beside a state; the state itself after the first stage alone."""
    if state.iterations <= FIRST:
        return state
    _, gradient = objective(state.x)
    for _ in range(LAST):
        hessian = _curvature(objective, state.x)
        if hessian is None:
            break
        step = hessian.solve(gradient, SHIFTS[0])
        found = _nearer(objective, state, step)
        if found is None:
            break
        state, gradient = found
        if np.abs(step).max() < SETTLED:
            break
    return state


def _nearer(
    objective: Objective, state: State, step: FloatArray
) -> tuple[State, FloatArray] | None:
    """The state after so much of a step that the gradient is smaller, and the gradient there."""
    for share in SHORTER:
        x = state.x - share * step
        value, gradient = objective(x)
        norm = float(np.linalg.norm(gradient))
        if np.isfinite(value) and norm < state.gradient_norm:
            return State(x, value, norm, state.iterations + 1), gradient
    return None


def _curvature(objective: Objective, x: FloatArray) -> Arrow | None:
    curved: object = objective
    return curved.curvature(x) if isinstance(curved, Curved) else None


def _factor(objective: Objective, x: FloatArray) -> ArrowFactor | None:
    """The factor of the Hessian with the least shift by which it has one."""
    hessian = _curvature(objective, x)
    if hessian is None:
        return None
    factors = (hessian.factor(shift) for shift in SHIFTS)
    return next((factor for factor in factors if factor is not None), None)

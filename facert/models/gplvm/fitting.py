"""The training loop: iterate and keep checkpoints until the objective no longer falls."""

from __future__ import annotations

import time
from dataclasses import replace

from torch import nn

from facert.errors import InputError, NumericalError
from facert.models.optim.flat import FlatObjective
from facert.models.optim.monitor import Monitor, Progress
from facert.models.optim.optimiser import Optimiser, Result, State, Status


def train(
    module: nn.Module,
    optimiser: Optimiser,
    *,
    tolerance: float,
    max_iterations: int,
    checkpoint_every: int,
    fingerprint: str,
    monitor: Monitor,
    magnitude: float = 1.0,
    checkpoint_seconds: float = 10.0,
) -> Result:
    """Minimise the module's output; its parameters are then the best that were found.

    Parameters
    ----------
    module : Module
        Begins at its present parameters, or at the monitor's checkpoint.
    optimiser : Optimiser
        How to descend.
    tolerance : float
        Relative decrease an iteration below which the run has converged.
    max_iterations : int
        Counted over all resumed runs.
    checkpoint_every : int
        Iterations of a stage, after which L-BFGS begins anew.
    fingerprint : str
        Identifies the problem, by its data and its settings; after a colon a phase of the training.
    monitor : Monitor
        Sees every iteration, keeps checkpoints, and has that of an earlier run.
    magnitude : float
        The decrease is taken relative to this at least: an objective that passes through zero is
        no measure of itself.
    checkpoint_seconds : float
        Time between two checkpoints; it changes nothing about the result.

    Returns
    -------
    Result
        Ctrl-C does not raise: it ends the run with status ``"interrupted"``.
    """
    began = time.perf_counter()
    objective = FlatObjective(module)
    progress = monitor.resume(fingerprint) or Progress(optimiser.start(objective, objective.vector))
    if progress.state.x.shape != objective.vector.shape:
        raise InputError(
            "the checkpoint",
            f"{objective.vector.shape} variables",
            f"{progress.state.x.shape}",
            "Train without --resume.",
        )

    # A run that goes on from where it was over would not end there: kept is the state before that.
    due, kept = began + checkpoint_seconds, progress

    def converged() -> bool:
        value = max(abs(progress.state.value), 1.0)
        return progress.converged(tolerance * max(magnitude / value, 1.0))

    def watch(state: State) -> bool:
        nonlocal progress, kept, due
        progress = Progress(state, (*progress.curve, state.value))
        over = converged()
        monitor.iteration(state)
        kept = kept if over else progress  # when it is logged: a run may be ended at any moment
        if not over and time.perf_counter() >= due:
            monitor.checkpoint(kept)
            due = time.perf_counter() + checkpoint_seconds
        return over

    status: Status = "iteration limit"
    try:
        while progress.state.iterations < max_iterations:
            made = progress.state.iterations
            stage = min(checkpoint_every - made % checkpoint_every, max_iterations - made)
            state = optimiser.advance(objective, progress.state, stage, watch)
            progress = replace(progress, state=state)
            if converged():
                status = "converged"
                break
            if state.stalled:
                status = "stalled"
                break
            kept = progress
            monitor.checkpoint(kept)
    except KeyboardInterrupt:
        status = "interrupted"
        monitor.checkpoint(kept)
    objective.vector = progress.state.x
    if not progress.state.value < float("inf"):
        raise NumericalError("training ended without a finite objective")
    return Result(
        value=progress.state.value,
        gradient_norm=progress.state.gradient_norm,
        iterations=progress.state.iterations,
        evaluations=objective.evaluations,
        seconds=time.perf_counter() - began,
        status=status,
        message=_MESSAGES[status],
    )


_MESSAGES: dict[Status, str] = {
    "converged": "the objective no longer falls by the tolerance",
    "iteration limit": "the iteration limit was reached before convergence",
    "stalled": "no descent is possible within rounding",
    "interrupted": "stopped by hand; the best state was kept",
}

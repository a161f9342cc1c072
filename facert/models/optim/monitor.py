"""The progress of a minimisation, and a monitor that follows it."""

from __future__ import annotations

from dataclasses import dataclass, field

from facert.models.optim.optimiser import State

# The relative change is averaged over so many iterations: one short step is not convergence.
WINDOW = 5


@dataclass(frozen=True)
class Progress:
    """The progress of a run, from which a stopped one goes on."""

    state: State  # Of the optimiser
    curve: tuple[float, ...] = field(default=())  # The objective after each iteration so far

    def converged(self, tolerance: float) -> bool:
        """Whether the relative decrease an iteration fell below the tolerance."""
        if len(self.curve) <= WINDOW:
            return False
        fall = self.curve[-1 - WINDOW] - self.curve[-1]
        return fall <= WINDOW * tolerance * max(abs(self.curve[-1]), 1.0)


class Monitor:
    """A monitor of a training run; this one does nothing.

    Subclasses draw a progress bar, write checkpoints, log the curve.
    """

    def resume(self, fingerprint: str) -> Progress | None:  # noqa: ARG002  a hook
        """State at which an earlier run with this fingerprint stopped, or None to begin anew.

        Called once for each phase of a training, whose name follows the fingerprint after a colon.
        """
        return None

    def iteration(self, state: State) -> None:
        """Called after every iteration."""

    def checkpoint(self, progress: Progress) -> None:
        """Called after every stage, at times within one, and when the run is interrupted."""

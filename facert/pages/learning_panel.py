"""The panel of what is learned: training, its error, and what to think of its poses."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from viser import Icon

from facert.data.moments import frame_label
from facert.data.verdict import Verdict
from facert.pages.posed_take import PosedTake
from facert.pages.session import Trained
from facert.pages.take_panel import Place
from facert.pages.widgets import ButtonList, Text

if TYPE_CHECKING:
    from viser import ViserServer

TRAIN, TRAINING = "Train on the labels", "Training ..."
LOOKED_AT = 5  # frames


class LearningActions(Protocol):
    """What a person can ask for, as `facert.pages.pose_page.PosePage` does it."""

    def train(self) -> None:
        """Train on what is saved."""

    def go_to(self, place: Place) -> None:
        """Go to a frame of a take."""


class LearningPanel:
    """Training, its outcome, and the verdict on the poses of the take that is looked at.

    Parameters
    ----------
    server : ViserServer
    page : LearningActions
    there : bool
        Whether there is a take to learn from.
    """

    def __init__(self, server: ViserServer, page: LearningActions, there: bool) -> None:
        self._train = server.gui.add_button(TRAIN, icon=Icon.SCHOOL, visible=there)
        self._train.on_click(lambda _: page.train())
        self.outcome, self._verdict = Text(server), Text(server)
        self._worst: ButtonList[Place] = ButtonList(server, "Look at", page.go_to)

    def show_labels(self, count: int) -> None:
        """Show how many labels there are to learn from."""
        self._train.hint = f"{count} labels"

    def show_training(self, under_way: bool) -> None:
        """Show whether a model is being trained."""
        self._train.disabled, self._train.label = under_way, TRAINING if under_way else TRAIN

    def show_trained(self, trained: Trained, file: str) -> None:
        """Show what came of a training."""
        lines = [f"Learned from {trained.labels} labels in {trained.seconds:.1f} s."]
        if trained.error is not None:
            lines.append(
                f"Error at poses left out: {trained.error:.3f} (RMS), mostly that of extremes."
            )
        if trained.change is not None:
            lines.append(f"Poses moved by {trained.change:.3f} (RMS).")
        self.outcome.write("\n".join([*lines, f"{file} is written."]))

    def show_verdict(self, verdict: Verdict | None, take: int, part: PosedTake | None) -> None:
        """Show what to think of a take, why, and its frames to look at first."""
        if verdict is None or part is None:
            self._verdict.write("")
            self._worst.show({})
            return
        recording, name = part.recording, part.name
        reasons = [f"{reason.kind}: {reason.text}" for reason in verdict.reasons]
        matter = [reason for reason in verdict.reasons if reason.level != "good"]
        cures = dict.fromkeys(reason.cure_for(name, "MODEL") for reason in matter)
        self._verdict.write("\n".join([f"Verdict: {verdict.level}.", *reasons, *cures]))
        worst = verdict.worst(LOOKED_AT).tolist()
        self._worst.show({(take, f): f"frame {frame_label(recording, f)}" for f in worst})

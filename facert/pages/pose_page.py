"""The page of `facert pose --view`: pose a frame, save it, train, look, pose the next."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

from facert.data.rig import Rig
from facert.data.text import plural
from facert.data.verdict import Verdict
from facert.errors import InputError
from facert.io.video_frames import VideoFrames
from facert.pages.learning_panel import LearningPanel
from facert.pages.pose_editing import PoseEditing
from facert.pages.server import show_errors
from facert.pages.session import PosingSession, Trained
from facert.pages.take_panel import Place
from facert.pages.worker import Worker
from facert.posing.suggested_frames import Suggestion
from facert.render.faces import Face

if TYPE_CHECKING:
    from viser import ViserServer

log = logging.getLogger(__name__)

SUGGESTED = 5


class PosePage(PoseEditing):
    """A character to pose, and what is learned from its poses.

    Training, suggestions and the verdict, which take a second, run in a worker of their own, so
    that the sliders stay quick.

    Parameters
    ----------
    server : ViserServer
    rig : Rig
        The character.
    session : PosingSession
    actors : sequence of Face or None
        The actor's face in each take, for sources of weights.
    video : VideoFrames, optional
        The performer's, of the only take.
    """

    def __init__(
        self,
        server: ViserServer,
        rig: Rig,
        session: PosingSession,
        actors: Sequence[Face | None] = (),
        video: VideoFrames | None = None,
    ) -> None:
        super().__init__(server, rig, session, actors, video)
        self._learning = LearningPanel(server, self, bool(session.parts))
        self._learning.show_labels(session.labels)
        self.start()
        self.slow = Worker(show_errors(server))
        self.seek(0)
        self.suggest()
        self.judge()

    def stop(self) -> None:
        """Stop the workers."""
        self.slow.stop()
        super().stop()

    def train(self) -> None:
        """Train on all labels, and show the result."""
        self._learning.show_training(True)
        self.slow.do("train", self._train)

    def suggest(self) -> None:
        """List the frames that are most worth posing now."""
        if self.session.parts:
            self.slow.do("suggest", self._suggest)

    def judge(self) -> None:
        """Show what to think of the poses of the take that is looked at."""
        if self.session.model is not None:
            self.slow.do("judge", self._judge)

    def _go_to(self, place: Place) -> None:
        turned = place[0] != self.session.here
        super()._go_to(place)
        if turned:
            self.judge()

    def _learned_labels(self) -> None:
        super()._learned_labels()
        self._learning.show_labels(self.session.labels)
        self.suggest()

    def _train(self) -> None:
        """Train in the slow worker, and show the outcome from the other."""
        try:
            trained = self.session.learn()
        finally:
            self._learning.show_training(False)
        self.worker.do(object(), partial(self._trained, trained))

    def _trained(self, trained: Trained) -> None:
        self.session.accept(trained)
        self._learned_labels()
        if not self.editor.edit.is_change:
            self._show_frame()
        path = self.session.model_path
        self._learning.show_trained(trained, "The model" if path is None else path.name)
        self.judge()

    def _judge(self) -> None:
        take, part = self.session.here, self.session.part
        verdict: Verdict | None = self.session.verdict()
        self.worker.do("judged", lambda: self._learning.show_verdict(verdict, take, part))

    def _suggest(self) -> None:
        """Find the frames to pose next, in the slow worker."""
        try:
            found = self.session.suggestion(SUGGESTED)
        except InputError as error:  # nearly all frames are posed
            log.debug("nothing to suggest: %s", error)
            self.worker.do("suggested", partial(self._suggested, None))
            return
        self.worker.do("suggested", partial(self._suggested, found))

    def _suggested(self, found: Suggestion | None) -> None:
        assert self._takes is not None  # it was asked for some
        if found is None:
            self._takes.suggest({})
            return
        places = zip(found.takes.tolist(), found.frames.tolist(), strict=True)
        shares = dict(zip(places, found.shares.tolist(), strict=True))
        self._takes.suggest(
            {
                place: f"{self.frame_name(place)}   stands for {share:.0%}"
                for place, share in shares.items()
            }
        )
        rest, labels = sum(shares.values()), self.session.labels
        others = f"; these frames would for {rest:.0%}" if shares else ""
        verb = "stands" if labels == 1 else "stand"
        covered = f"{plural(labels, 'label')} {verb} for {1 - rest:.0%} of all frames{others}."
        self._takes.coverage.write(covered if labels else "")

"""The stage of the page to pose on: the actor, the posed character, and other poses."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from facert.data.arrays import FloatArray
from facert.data.drivers import require_used
from facert.data.names import shape_drivers
from facert.data.rig import Rig
from facert.io.video_frames import VideoFrames
from facert.pages.paint import skin
from facert.pages.session import PosingSession
from facert.pages.stage import ActorParts, FacePart, Stage
from facert.pages.video_part import VideoPart
from facert.render.faces import Face

if TYPE_CHECKING:
    from viser import ViserServer

SAMPLES = 3  # other plausible poses
BAR = 0.22  # of the picture's height, which the bar with Save covers


class PoseStage:
    """The actor in a frame, the posed character, and other poses below it.

    Raises
    ------
    InputError
        When the rig lacks a shape for a control.
    """

    def __init__(
        self,
        server: ViserServer,
        rig: Rig,
        session: PosingSession,
        actors: Sequence[Face | None] = (),
        video: VideoFrames | None = None,
    ) -> None:
        self._parts, self._actors = session.parts, [*actors, *[None] * len(session.parts)]
        self._rig, self._drivers = rig, shape_drivers(session.controls.names, rig.names)
        if rig.driven is not None:
            require_used(rig.driven.controls, session.controls.names)
        self._stage = Stage(server, BAR)
        take = session.take
        source = None if take is None else take.source
        self._video = None
        if video is not None and take is not None:
            self._video = self._stage.add(VideoPart(server, video, take.time))
        face = next(iter(self._actors), None)
        self._actor = ActorParts(server, self._stage, source, face)
        mesh = (rig.whole, skin(rig.whole), len(rig.neutral))
        self._character = self._stage.add(FacePart(server, "character", *mesh))
        others = range(1, SAMPLES + 1)
        self._samples = [FacePart(server, f"other {number}", *mesh) for number in others]
        for part in self._samples:
            part.root.visible = False
            self._stage.add(part, row=1)

    def turn_to(self, take: int) -> None:
        """Show another take."""
        self._actor.turn_to(self._parts[take].recording.source, self._actors[take])
        self._stage.arrange()

    def draw(self, frame: int, pose: FloatArray) -> None:
        """A frame of the actor, and the character's pose (P,); the samples leave."""
        self._actor.draw(frame)
        if self._video is not None:
            self._video.draw(frame)
        self._character.draw(self._vertices(pose[None])[0])
        self.show_samples(np.empty((0, len(pose))))

    def show_samples(self, poses: FloatArray) -> None:
        """Other poses (n, P) beside the character, at most `SAMPLES`."""
        changed = sum(part.root.visible for part in self._samples) != len(poses)
        for part, vertices in zip(self._samples, self._vertices(poses), strict=False):
            part.draw(vertices)
        for number, part in enumerate(self._samples):
            part.root.visible = number < len(poses)
        if changed:
            self._stage.arrange()

    def _vertices(self, poses: FloatArray) -> FloatArray:
        return self._rig.deform(poses @ self._drivers)

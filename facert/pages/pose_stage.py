"""What stands on the page of `facert pose --view`: the actor, the character, and other poses."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from facert.data.arrays import FloatArray
from facert.data.names import shape_drivers
from facert.data.rig import Rig
from facert.pages.paint import skin
from facert.pages.session import PosingSession
from facert.pages.stage import FacePart, MarkerPart, Stage
from facert.render.faces import Face

if TYPE_CHECKING:
    from viser import ViserServer

SAMPLES = 3


class PoseStage:
    """The actor in a frame, the character as it is posed, and samples when they are asked for.

    Raises
    ------
    InputError
        When the rig lacks a shape for a control.
    """

    def __init__(
        self, server: ViserServer, rig: Rig, session: PosingSession, actor: Face | None
    ) -> None:
        self._rig, self._drivers = rig, shape_drivers(session.controls.names, rig.names)
        self._stage = Stage(server)
        self._source = None if session.take is None else session.take.source
        self._markers: MarkerPart | None = None
        if self._source is not None and self._source.kind == "markers":
            self._markers = MarkerPart(server, "markers", self._source.values)
            self._stage.add(self._markers)
        self._actor = actor
        self._actor_part: FacePart | None = None
        if actor is not None:
            self._actor_part = FacePart(
                server, actor.label, actor.motion.neutral, skin(actor.motion.neutral)
            )
            self._stage.add(self._actor_part)
        own = skin(rig.mesh)
        self._character = FacePart(server, "character", rig.mesh, own)
        self._stage.add(self._character)
        self._samples = [
            FacePart(server, f"other {number}", rig.mesh, own) for number in range(1, SAMPLES + 1)
        ]
        for part in self._samples:
            part.shown = False
            self._stage.add(part, row=1)

    def draw(self, frame: int, pose: FloatArray) -> None:
        """A frame of the actor, and the character's pose (P,); the samples leave."""
        if self._markers is not None and self._source is not None:
            self._markers.draw(self._source.values[frame])
        if self._actor is not None and self._actor_part is not None:
            self._actor_part.draw(self._actor.motion.fetch(np.array([frame]))[0])
        self._character.draw(self._vertices(pose[None])[0])
        self.show_samples(np.empty((0, len(pose))))

    def show_samples(self, poses: FloatArray) -> None:
        """Other poses (n, P) beside the character, at most `SAMPLES`."""
        changed = [part.shown for part in self._samples].count(True) != len(poses)
        for part, vertices in zip(self._samples, self._vertices(poses), strict=False):
            part.draw(vertices)
        for number, part in enumerate(self._samples):
            part.shown = number < len(poses)
        if changed:
            self._stage.arrange()

    def _vertices(self, poses: FloatArray) -> FloatArray:
        return self._rig.deform(poses @ self._drivers)

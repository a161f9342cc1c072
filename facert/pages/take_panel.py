"""The panel of the takes that are posed: which one, which frame, and lists of others."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Protocol

from facert.errors import escaped
from facert.pages.session import PosingSession
from facert.pages.widgets import ButtonList, PlayControls, Text, Timeline

if TYPE_CHECKING:
    from viser import ViserServer

Place = tuple[int, int]
"""Which take, from 0, and which frame of it."""


class TakeActions(PlayControls, Protocol):
    """What a person can ask for, as `facert.pages.pose_editing.PoseEditing` does it."""

    def go_to(self, place: Place) -> None:
        """Go to a frame of a take."""

    def turn_to(self, take: int) -> None:
        """Look at another take."""


class TakePanel:
    """The take that is looked at, its frames, and lists of frames of all takes.

    Parameters
    ----------
    server : ViserServer
    page : TakeActions
    session : PosingSession
        With a take.
    """

    def __init__(self, server: ViserServer, page: TakeActions, session: PosingSession) -> None:
        assert session.take is not None  # the caller has looked
        self._session = session
        names = [part.name for part in session.parts]
        self._choices = [escaped(f"{number}  {name}") for number, name in enumerate(names, 1)]
        self._choice = server.gui.add_dropdown("take", self._choices, visible=len(names) > 1)
        self._timeline = Timeline(server, session.take, page)
        self._suggested: ButtonList[Place] = ButtonList(server, "Pose next", page.go_to)
        self.coverage = Text(server)
        self._unsaved: ButtonList[Place] = ButtonList(server, "Changed and not saved", page.go_to)

        @self._choice.on_update
        def _(event: object) -> None:
            if getattr(event, "client", None) is not None:  # a person, and not the page itself
                page.turn_to(self._choices.index(self._choice.value))

        self.mark()

    def turn_to(self, take: int) -> None:
        """Show another take."""
        self._choice.value = self._choices[take]  # type: ignore[misc]
        self._timeline.turn_to(self._session.parts[take].recording)
        self.mark()

    def mark(self) -> None:
        """Show where the labels are."""
        take = self._session.take
        assert take is not None  # there is one as long as the panel
        self._timeline.mark(take.labels)

    def show(self, frame: int, unsaved: Mapping[Place, str]) -> None:
        """Show which frame is looked at, and which are changed and not saved."""
        self._timeline.show(frame)
        self._unsaved.show(unsaved)

    def suggest(self, frames: Mapping[Place, str]) -> None:
        """List the frames to pose next."""
        self._suggested.show(frames)

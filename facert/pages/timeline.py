"""The part of a page that says which frame is shown, and lists of frames to go to."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from html import escape
from typing import TYPE_CHECKING

import numpy as np
from viser import Icon

from facert.data.arrays import IntArray
from facert.data.take import Take
from facert.data.timecode import timecode
from facert.pages.playback import Playback

if TYPE_CHECKING:
    from viser import GuiButtonHandle, GuiEvent, GuiSliderHandle, ViserServer

MARKED = 60  # key poses under the slider; more would run together

Pick = Callable[[int], None]


class Timeline:
    """A slider over the frames, buttons beside it, and what moment it is.

    Parameters
    ----------
    server : ViserServer
    take : Take
    playback : Playback
        Of its frames.
    seek : callable
        Told the frame that was asked for.
    """

    def __init__(self, server: ViserServer, take: Take, playback: Playback, seek: Pick) -> None:
        self._server, self._take = server, take
        self._playback, self._seek = playback, seek
        self._key_poses: list[int] = []
        self._moment = server.gui.add_html("")
        self._place = server.gui.add_folder(None)
        self._slider = self._add_slider()
        self._play = server.gui.add_button("Play", icon=Icon.PLAYER_PLAY)
        steps = server.gui.add_button_group("", ("◂ key", "◂", "▸", "key ▸"))
        self._play.on_click(lambda _: self._toggle())
        steps.on_click(lambda event: self._step(str(event.target.value)))

    def mark(self, key_poses: IntArray) -> None:
        """Show where the key poses are."""
        self._key_poses = key_poses.tolist()
        self._slider.remove()  # viser's marks stay as they were made
        self._slider = self._add_slider()

    def show(self, frame: int) -> None:
        """Say where the performance stands."""
        self._slider.value = frame  # type: ignore[misc]
        seconds = float(self._take.time[frame])
        code = timecode(self._take.start_timecode, seconds, self._take.fps)
        posed = " · <b>key pose</b>" if frame in self._key_poses else ""
        text = f"frame {frame} of {len(self._take)} · {seconds:.2f} s {escape(code)}{posed}"
        self._moment.content = f'<div style="padding:6px 12px 0;font-size:13px">{text}</div>'

    def _add_slider(self) -> GuiSliderHandle[int]:
        marks = tuple(self._key_poses) if 0 < len(self._key_poses) <= MARKED else None
        last = max(len(self._take) - 1, 1)
        with self._place:
            slider = self._server.gui.add_slider(
                "frame", 0, last, 1, self._playback.frame, marks=marks
            )
        slider.on_update(self._slid)
        return slider

    def _slid(self, event: GuiEvent[GuiSliderHandle[int]]) -> None:
        if event.client is not None:  # a person, and not the page itself
            self._seek(int(event.target.value))

    def _toggle(self) -> None:
        self._playback.playing = not self._playback.playing
        playing = self._playback.playing
        self._play.label = "Pause" if playing else "Play"
        self._play.icon = Icon.PLAYER_PAUSE if playing else Icon.PLAYER_PLAY

    def _step(self, button: str) -> None:
        """To the next frame or key pose, or back."""
        forward = button.endswith("▸")
        frame = self._playback.frame
        if "key" not in button:
            self._seek(frame + (1 if forward else -1))
            return
        keys = np.array(self._key_poses, dtype=np.int64)
        beyond = keys[keys > frame] if forward else keys[keys < frame][::-1]
        if len(beyond):
            self._seek(int(beyond[0]))


class FrameList:
    """A list of frames that are worth going to, each a button."""

    def __init__(self, server: ViserServer, title: str, pick: Pick) -> None:
        self._server, self._pick = server, pick
        self._folder = server.gui.add_folder(title)
        self._buttons: list[GuiButtonHandle] = []

    def show(self, places: Sequence[tuple[int, str]]) -> None:
        """List other frames, with what to say of each."""
        for button in self._buttons:
            button.remove()
        self._buttons = []
        self._folder.visible = len(places) > 0
        with self._folder:
            for frame, text in places:
                self._buttons.append(self._button(frame, text))

    def _button(self, frame: int, text: str) -> GuiButtonHandle:
        button = self._server.gui.add_button(text, color="gray")
        button.on_click(lambda _: self._pick(frame))
        return button

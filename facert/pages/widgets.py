"""Elements of pages: sliders of controls, lists of buttons, and a timeline."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from html import escape
from typing import TYPE_CHECKING

import numpy as np
from viser import Icon, IconName

from facert.data.arrays import FloatArray, IntArray
from facert.data.names import control_groups
from facert.data.take import Take
from facert.data.timecode import timecode
from facert.pages.worker import Playback

if TYPE_CHECKING:
    from viser import GuiButtonHandle, GuiEvent, GuiSliderHandle, ViserServer

PIN = "● "
UNFOLDED = 30  # controls; of more, only the shorter groups are open, such as the jaw's
FINE = 100  # steps of a slider, at least
MARKED = 60  # key poses under the slider of frames; more would run together


def unfolded_groups(groups: Mapping[str, IntArray]) -> set[str]:
    """The groups that are open at first: the shortest, up to the one that makes it too many."""
    left, found = UNFOLDED, set()
    for group in sorted(groups, key=lambda group: len(groups[group])):
        if left > 0:
            found.add(group)
        left -= len(groups[group])
    return found


class Sliders:
    """A slider for every control of a character, grouped by the parts of the face.

    Parameters
    ----------
    server : ViserServer
    names : sequence of str, length P
    bounds : array, shape (P, 2)
        Lowest and highest value of each.
    moved : callable
        Called with the control and its value when a person moves a slider.
    """

    def __init__(
        self,
        server: ViserServer,
        names: tuple[str, ...],
        bounds: FloatArray,
        moved: Callable[[int, float], None],
    ) -> None:
        self._names, self._bounds, self._moved = names, bounds, moved
        self._handles: dict[int, GuiSliderHandle[float]] = {}
        groups = control_groups(names)
        unfolded = unfolded_groups(groups)
        for group, members in groups.items():
            with server.gui.add_folder(group, expand_by_default=group in unfolded):
                for control in members.tolist():
                    self._handles[control] = self._add(server, control)

    def show(self, pose: FloatArray, pins: Mapping[int, float]) -> None:
        """Move the sliders to a pose (P,), and mark those that are pinned."""
        for control, handle in self._handles.items():
            low, high = self._bounds[control]
            value = float(np.clip(np.round(pose[control] / handle.step) * handle.step, low, high))
            label = PIN * (control in pins) + self._names[control]
            if abs(handle.value - value) > handle.step / 2:
                handle.value = value  # type: ignore[misc]
            if handle.label != label:
                handle.label = label

    def _add(self, server: ViserServer, control: int) -> GuiSliderHandle[float]:
        low, high = map(float, self._bounds[control])
        high = max(high, low + 1e-6)
        step = float(10.0 ** np.floor(np.log10(high - low)) / FINE)
        handle = server.gui.add_slider(
            self._names[control], low, high, step, float(np.clip(0.0, low, high))
        )

        @handle.on_update
        def _(event: GuiEvent[GuiSliderHandle[float]]) -> None:
            if event.client is not None:  # a person, and not the page itself
                self._moved(control, float(handle.value))

        return handle


class ButtonList:
    """A folder of buttons, hidden while it is empty.

    Parameters
    ----------
    server : ViserServer
    title : str
    clicked : callable
        Called with the key of a button that is clicked: a frame, or a control.
    icon : Icon, optional
        On each button.
    """

    def __init__(
        self,
        server: ViserServer,
        title: str,
        clicked: Callable[[int], None],
        icon: IconName | None = None,
    ) -> None:
        self._server, self._clicked, self._icon = server, clicked, icon
        self._folder = server.gui.add_folder(title, visible=False)
        self._buttons: dict[int, GuiButtonHandle] = {}

    def show(self, labels: Mapping[int, str]) -> None:
        """List buttons with these labels by their keys, in this order."""
        if list(labels) != list(self._buttons):
            for button in self._buttons.values():
                button.remove()
            self._buttons = {key: self._add(key) for key in labels}
        for key, label in labels.items():
            self._buttons[key].label = label
        self._folder.visible = len(labels) > 0

    def _add(self, key: int) -> GuiButtonHandle:
        with self._folder:
            button = self._server.gui.add_button("", color="gray", icon=self._icon)
        button.on_click(lambda _: self._clicked(key))
        return button


class Timeline:
    """A slider over the frames, buttons beside it, and what moment it is.

    Parameters
    ----------
    server : ViserServer
    take : Take
    playback : Playback
        Playback of the take's frames.
    seek : callable
        Called with the frame that was asked for.
    """

    def __init__(
        self, server: ViserServer, take: Take, playback: Playback, seek: Callable[[int], None]
    ) -> None:
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
        """Show which frame the performance stands at."""
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
        playing = self._playback.playing = not self._playback.playing
        self._play.label = "Pause" if playing else "Play"
        self._play.icon = Icon.PLAYER_PAUSE if playing else Icon.PLAYER_PLAY

    def _step(self, button: str) -> None:
        """Step to the next frame or key pose, or back."""
        forward = button.endswith("▸")
        frame = self._playback.frame
        if "key" not in button:
            self._seek(frame + (1 if forward else -1))
            return
        keys = np.array(self._key_poses, dtype=np.int64)
        beyond = keys[keys > frame] if forward else keys[keys < frame][::-1]
        if len(beyond):
            self._seek(int(beyond[0]))

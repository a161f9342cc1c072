"""Elements of pages: sliders of controls, lists of buttons, and a timeline."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Generic, Protocol, TypeVar

import numpy as np
from viser import Icon, IconName

from facert.data.arrays import FloatArray, IntArray
from facert.data.names import control_groups
from facert.data.take import Take
from facert.data.text import for_html
from facert.data.timecode import timecode
from facert.errors import escaped
from facert.pages.worker import Playback

if TYPE_CHECKING:
    from viser import GuiButtonHandle, GuiEvent, GuiSliderHandle, ViserServer

PIN = "● "
KEY = "#1f6f8b"
UNFOLDED = 30  # controls; of more, only the shorter groups are open, such as the jaw's
FINE = 100  # steps of a slider, at least
TRACK = "-10px 65px 2px 118px"  # from the panel's edges to the track of the slider of frames


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
            with server.gui.add_folder(escaped(group), expand_by_default=group in unfolded):
                for control in members.tolist():
                    self._handles[control] = self._add(server, control)

    def show(self, pose: FloatArray, pins: Mapping[int, float]) -> None:
        """Move the sliders to a pose (P,), and mark those that are pinned."""
        for control, handle in self._handles.items():
            low, high = self._bounds[control]
            value = float(np.clip(np.round(pose[control] / handle.step) * handle.step, low, high))
            label = PIN * (control in pins) + escaped(self._names[control])
            if abs(handle.value - value) > handle.step / 2:
                handle.value = value  # type: ignore[misc]
            if handle.label != label:
                handle.label = label

    def _add(self, server: ViserServer, control: int) -> GuiSliderHandle[float]:
        low, high = map(float, self._bounds[control])
        high = max(high, low + 1e-6)
        step = float(10.0 ** np.floor(np.log10(high - low)) / FINE)
        handle = server.gui.add_slider(
            escaped(self._names[control]), low, high, step, float(np.clip(0.0, low, high))
        )

        @handle.on_update
        def _(event: GuiEvent[GuiSliderHandle[float]]) -> None:
            if event.client is not None:  # a person, and not the page itself
                self._moved(control, float(handle.value))

        return handle


Key = TypeVar("Key")


class ButtonList(Generic[Key]):
    """A folder of buttons, hidden while it is empty.

    Buttons stay once they are made, and are hidden and named anew: viser stumbles over one that is
    made, named and removed within a moment.

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
        clicked: Callable[[Key], None],
        icon: IconName | None = None,
    ) -> None:
        self._server, self._clicked, self._icon = server, clicked, icon
        self._folder = server.gui.add_folder(title, visible=False)
        self._buttons: list[GuiButtonHandle] = []
        self._keys: list[Key] = []

    def show(self, labels: Mapping[Key, str]) -> None:
        """List buttons with these labels by their keys, in this order."""
        while len(self._buttons) < len(labels):
            self._buttons.append(self._add(len(self._buttons)))
        self._keys = list(labels)
        texts = [*map(escaped, labels.values()), *[""] * (len(self._buttons) - len(labels))]
        for button, text in zip(self._buttons, texts, strict=True):
            if button.label != text:
                button.label = text
            if button.visible != bool(text):
                button.visible = bool(text)
        self._folder.visible = len(labels) > 0

    def _add(self, place: int) -> GuiButtonHandle:
        with self._folder:
            button = self._server.gui.add_button("", color="gray", icon=self._icon, visible=False)
        button.on_click(lambda _: self._click(place))
        return button

    def _click(self, place: int) -> None:
        if place < len(self._keys):
            self._clicked(self._keys[place])


class Text:
    """A line or two of text, which is never taken for HTML.

    Parameters
    ----------
    server : ViserServer
    """

    def __init__(self, server: ViserServer) -> None:
        self._html = server.gui.add_html("")

    def write(self, text: str) -> None:
        """Show a text; each of its lines is one."""
        lines = "<br>".join(map(for_html, text.splitlines()))
        self._html.content = f'<div style="padding:4px 12px;font-size:13px">{lines}</div>'


class PlayControls(Protocol):
    """What a person can ask for, as `facert.pages.worker.PlayedPage` does it."""

    playback: Playback

    def seek(self, frame: int) -> None:
        """Go to a frame."""

    def step(self, frames: int) -> None:
        """Go so many frames on, or back."""

    def toggle(self) -> None:
        """Play, or pause."""


class Timeline:
    """A slider over the frames, buttons beside it, and what moment it is.

    Parameters
    ----------
    server : ViserServer
    take : Take
    page : PlayControls
        Shows the take's frames.
    """

    def __init__(self, server: ViserServer, take: Take, page: PlayControls) -> None:
        self._server, self._take, self._page = server, take, page
        self._key_poses: list[int] = []
        self._moment = server.gui.add_html("")
        last = max(len(take) - 1, 1)
        self._slider = server.gui.add_slider("frame", 0, last, 1, page.playback.frame)
        self._slider.on_update(self._slid)
        self._marks = server.gui.add_html("")
        self._play = server.gui.add_button("Play", icon=Icon.PLAYER_PLAY)
        steps = server.gui.add_button_group("", ("◂ key", "◂", "▸", "key ▸"))
        self._play.on_click(lambda _: page.toggle())
        steps.on_click(lambda event: self._step(str(event.target.value)))

    def turn_to(self, take: Take) -> None:
        """Show another take from its first frame on."""
        self._take = take
        self._slider.value = 0  # type: ignore[misc]
        self._slider.max = max(len(take) - 1, 1)

    def mark(self, key_poses: IntArray) -> None:
        """Show where the key poses are."""
        self._key_poses = key_poses.tolist()
        ticks = "".join(f"M{frame} 0v1" for frame in self._key_poses)
        self._marks.content = (
            f'<div style="margin:{TRACK}"><svg viewBox="0 0 {max(len(self._take) - 1, 1)} 1"'
            ' preserveAspectRatio="none" style="width:100%;height:7px;overflow:visible">'
            f'<path d="{ticks}" stroke="{KEY}" stroke-width="2"'
            ' vector-effect="non-scaling-stroke"/></svg></div>'
        )

    def show(self, frame: int) -> None:
        """Show which frame the performance stands at, and whether it plays."""
        label = "Pause" if self._page.playback.playing else "Play"
        if self._play.label != label:
            self._play.label = label
            self._play.icon = Icon.PLAYER_PAUSE if label == "Pause" else Icon.PLAYER_PLAY
        self._slider.value = frame  # type: ignore[misc]
        seconds = float(self._take.time[frame])
        code = timecode(self._take.start_timecode, seconds, self._take.fps)
        posed = " · <b>key pose</b>" if frame in self._key_poses else ""
        text = f"frame {frame} of {len(self._take)} · {seconds:.2f} s {for_html(code)}{posed}"
        self._moment.content = f'<div style="padding:6px 12px 0;font-size:13px">{text}</div>'

    def _slid(self, event: GuiEvent[GuiSliderHandle[int]]) -> None:
        if event.client is not None:  # a person, and not the page itself
            self._page.seek(int(event.target.value))

    def _step(self, button: str) -> None:
        """Step to the next frame or key pose, or back."""
        forward = button.endswith("▸")
        frame = self._page.playback.frame
        if "key" not in button:
            self._page.step(1 if forward else -1)
            return
        keys = np.array(self._key_poses, dtype=np.int64)
        beyond = keys[keys > frame] if forward else keys[keys < frame][::-1]
        if len(beyond):
            self._page.seek(int(beyond[0]))

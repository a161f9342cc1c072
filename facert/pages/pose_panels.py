"""The panels of the page to pose on: sliders, the bar with Save, and what is pinned."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from viser import Icon

from facert.data.corrections import WIDTH
from facert.errors import escaped
from facert.pages.pose_editor import PoseEditor, slider_bounds
from facert.pages.pose_stage import SAMPLES
from facert.pages.posed_take import Label
from facert.pages.widgets import ButtonList, Sliders, Text

if TYPE_CHECKING:
    from viser import GuiEvent, GuiSliderHandle, ViserServer

LEFT, BAR, EDGE = 330, 590, 15  # pixels: width of the sliders and of the bar, and air around it
WIDEST = 3.0  # seconds
BLENDING = "Half of it before the frame, half after it"
BEFORE, NEAREST, AFTER = "◂ key", "nearest", "key ▸"


class PoseActions(Protocol):
    """What a person can ask for, as `facert.pages.pose_editing.PoseEditing` does it."""

    editor: PoseEditor

    def pin(self, control: int, value: float) -> None:
        """Hold a control."""

    def let_go(self, control: int) -> None:
        """Let a control follow."""

    def let_all_go(self) -> None:
        """Let all controls follow."""

    def start_from_neutral(self) -> None:
        """Begin the pose anew."""

    def mirror(self) -> None:
        """Exchange left and right."""

    def pin_counterpart(self) -> None:
        """Pose the other side like the control that was pinned last."""

    def copy(self, which: str) -> None:
        """Begin with the pose of a key."""

    def save(self) -> None:
        """Save the pose."""

    def undo(self) -> None:
        """Take back the last change."""

    def redo(self) -> None:
        """Make it anew."""

    def take_back(self) -> None:
        """Leave the frame without its label."""

    def widen(self, seconds: float) -> None:
        """Blend the pose of the frame over so many seconds."""

    def sample(self) -> None:
        """Show other plausible poses."""

    def adopt(self, number: int) -> None:
        """Go on from one of them."""


def add_sliders(server: ViserServer, editor: PoseEditor, page: PoseActions) -> Sliders:
    """The sliders of all controls, in a panel at the left."""
    panel = server.gui.add_panel()
    with panel.add_tab("Controls"):
        sliders = Sliders(server, editor.controls.names, slider_bounds(editor), page.pin)
    panel.dock_left()
    panel.set_width(LEFT)
    return sliders


class SaveBar:
    """Save and what is done to whole poses: a small window that no panel scrolls away.

    Parameters
    ----------
    server : ViserServer
    page : PoseActions
    there : bool
        Whether there is a take to save in, and to copy from.
    """

    def __init__(self, server: ViserServer, page: PoseActions, there: bool) -> None:
        panel, gui = server.gui.add_panel(), server.gui
        with panel.add_tab("Pose"):
            save = gui.add_button(
                "Save as this frame's pose", icon=Icon.CHECK, color="green", visible=there
            )
            actions = {"Undo": page.undo, "Redo": page.redo, "Mirror": page.mirror}
            act = gui.add_button_group("", tuple(actions))
            copy = gui.add_button_group("copy pose of", (BEFORE, NEAREST, AFTER), visible=there)
            self.news = Text(server)
        panel.float(x=EDGE, y=-EDGE, width=BAR)
        save.on_click(lambda _: page.save())
        act.on_click(lambda event: actions[event.target.value]())
        copy.on_click(lambda event: page.copy(event.target.value))


class PosePanel:
    """The state of the pose: what is pinned, where it may begin, and other plausible ones.

    Parameters
    ----------
    server : ViserServer
    page : PoseActions
    """

    def __init__(self, server: ViserServer, page: PoseActions) -> None:
        gui, self._editor = server.gui, page.editor
        self.status = Text(server)
        self._pins = ButtonList(server, "Pinned (click to let go)", page.let_go, Icon.PINNED_OFF)
        self._other_side = gui.add_button("", icon=Icon.FLIP_VERTICAL, color="gray")
        self._free = gui.add_button("Let all go", icon=Icon.PINNED_OFF, color="gray")
        neutral = gui.add_button("Start from neutral", icon=Icon.MOOD_NEUTRAL, color="gray")
        other = gui.add_button("Other plausible poses", icon=Icon.ARROWS_SHUFFLE, color="gray")
        self.adopt = gui.add_button_group(
            "take over", tuple(f"other {number}" for number in range(1, SAMPLES + 1)), visible=False
        )
        self._width = gui.add_slider(
            "blend over (s)", 0.0, WIDEST, 0.05, WIDTH, visible=False, hint=BLENDING
        )
        self._back = gui.add_button("Take this frame's pose back", icon=Icon.ERASER, color="gray")
        self._other_side.on_click(lambda _: page.pin_counterpart())
        self._free.on_click(lambda _: page.let_all_go())
        self._back.on_click(lambda _: page.take_back())
        neutral.on_click(lambda _: page.start_from_neutral())
        other.on_click(lambda _: page.sample())
        self.adopt.on_click(lambda event: page.adopt(int(event.target.value.split()[-1]) - 1))

        @self._width.on_update
        def _(event: GuiEvent[GuiSliderHandle[float]]) -> None:
            if event.client is not None:  # a person, and not the page itself
                page.widen(float(self._width.value))

    def show(self) -> None:
        """Show what is pinned."""
        editor, names = self._editor, self._editor.controls.names
        self._pins.show({pin: f"{names[pin]}  {value:.2f}" for pin, value in editor.pins.items()})
        self._free.visible = len(editor.pins) > 1
        self.adopt.visible = False
        one_sided = editor.one_sided_pin
        self._other_side.visible = one_sided is not None
        if one_sided is not None:
            other = names[editor.counterparts[one_sided]]
            self._other_side.label = escaped(f"{other} as {names[one_sided]}")

    def show_label(self, blends: bool, width: float, label: Label | None) -> None:
        """Show the frame's label, if it has one, and whether and how long it is blended."""
        self._width.visible, self._back.visible = blends, label is not None
        if blends and abs(self._width.value - width) > self._width.step / 2:
            self._width.value = min(width, WIDEST)  # type: ignore[misc]

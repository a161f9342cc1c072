"""A slider for every control of a character, grouped by the parts of the face."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np
from viser import Icon

from facert.data.arrays import FloatArray, IntArray
from facert.data.names import control_groups

if TYPE_CHECKING:
    from viser import GuiButtonHandle, GuiEvent, GuiSliderHandle, ViserServer

PIN = "● "
UNFOLDED = 30  # controls; of more, only the shorter groups are open, such as the jaw's
FINE = 100  # steps of a slider, at least


def unfolded_groups(groups: Mapping[str, IntArray]) -> set[str]:
    """The groups that are open at first: the shortest, up to the one that makes it too many."""
    left, found = UNFOLDED, set()
    for group in sorted(groups, key=lambda group: len(groups[group])):
        if left > 0:
            found.add(group)
        left -= len(groups[group])
    return found


class Sliders:
    """One slider a control.

    Parameters
    ----------
    server : ViserServer
    names : sequence of str, length P
    bounds : array, shape (P, 2)
        Lowest and highest value of each.
    moved : callable
        Told the control and its value when a person moves a slider.
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


class Pins:
    """A button for every pinned control, which lets it go.

    Parameters
    ----------
    server : ViserServer
    names : sequence of str, length P
    let_go : callable
        Told the control.
    """

    def __init__(
        self, server: ViserServer, names: tuple[str, ...], let_go: Callable[[int], None]
    ) -> None:
        self._server, self._names, self._let_go = server, names, let_go
        self._buttons: dict[int, GuiButtonHandle] = {}
        self._folder = server.gui.add_folder("Pinned (click to let go)", visible=False)

    def show(self, pins: Mapping[int, float]) -> None:
        """List these pins, in the order in which they were set."""
        for control in set(self._buttons) - set(pins):
            self._buttons.pop(control).remove()
        for control, value in pins.items():
            if control not in self._buttons:
                self._buttons[control] = self._add(control)
            self._buttons[control].label = f"{self._names[control]}  {value:.2f}"
        self._folder.visible = len(pins) > 0

    def _add(self, control: int) -> GuiButtonHandle:
        with self._folder:
            button = self._server.gui.add_button("", color="gray", icon=Icon.PINNED_OFF)
        button.on_click(lambda _: self._let_go(control))
        return button

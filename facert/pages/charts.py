"""Curves of a control over time, on a page."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from facert.data.arrays import FloatArray
from facert.data.take import Take
from facert.errors import escaped
from facert.render.faces import INK, require_deviations, require_poses
from facert.render.plots import CURVE, TRUTH

if TYPE_CHECKING:
    from viser import GuiUplotHandle, ViserServer

MOST = 700  # points of a curve: a chart has no more pixels across
HEIGHT = 130
NOW = "#b3261e"


class Chart:
    """A control over time: the pose, twice its standard deviation, the truth, and now.

    Parameters
    ----------
    server : ViserServer
    take : Take
        With poses.
    truth : array, shape (T, P), or None
        In the order of the take's controls.
    control : int
        Which.
    """

    def __init__(
        self, server: ViserServer, take: Take, truth: FloatArray | None, control: int
    ) -> None:
        assert take.controls is not None  # the caller has seen poses
        self._values, self._time = require_poses(take)[:, control], take.time
        posed = take.labels
        self._frames = posed[np.unique(np.linspace(0, len(posed) - 1, MOST).astype(int))]
        curves = {"pose": self._values}
        if truth is not None:
            curves = {"truth": truth[:, control]} | curves
        std = require_deviations(take)
        if std is not None:
            curves["+ 2 std"] = self._values + 2 * std[:, control]
            curves["- 2 std"] = self._values - 2 * std[:, control]
        self._curves = tuple(values[self._frames] for values in curves.values())
        self._chart = self._plot(server, take.controls.names[control], list(curves))
        self.move(0)

    def move(self, frame: int) -> None:
        """Mark where the performance stands."""
        place = int(np.searchsorted(self._frames, frame).clip(0, len(self._frames) - 1))
        now = np.full(len(self._frames), np.nan)
        now[place] = self._values[frame]
        self._chart.data = (self._time[self._frames], *self._curves, now)

    def _range(self) -> tuple[float, float]:
        """Lowest and highest value shown; uPlot itself stumbles over the gaps around "now"."""
        values = np.concatenate(self._curves)
        low, high = float(np.nanmin(values)), float(np.nanmax(values))
        room = 0.05 * max(high - low, 1e-3)
        return low - room, high + room

    def remove(self) -> None:
        """Remove the chart from the page."""
        self._chart.remove()

    def _plot(self, server: ViserServer, name: str, curves: list[str]) -> GuiUplotHandle:
        import viser.uplot as u

        styles = {
            "pose": u.Series(label="pose", stroke=CURVE, width=1.6),
            "truth": u.Series(label="truth", stroke=TRUTH, width=3.0),
        }
        faint = u.Series(label="", stroke=CURVE + "55", width=0.6)
        marked = u.Series(
            label="now", stroke=NOW, points=u.Series_Points(show=True, size=9, fill=NOW)
        )
        axis = {"stroke": INK, "font": "11px sans-serif", "size": 26}
        return server.gui.add_uplot(
            (self._time[self._frames], *self._curves, np.full(len(self._frames), np.nan)),
            (u.Series(label="s"), *(styles.get(curve, faint) for curve in curves), marked),
            title=escaped(name),
            scales={"x": u.Scale(time=False, auto=True), "y": u.Scale(range=self._range())},
            axes=(u.Axis(**axis), u.Axis(**(axis | {"size": 38}))),  # type: ignore[typeddict-item]
            legend=u.Legend(show=False),
            height=HEIGHT,
        )

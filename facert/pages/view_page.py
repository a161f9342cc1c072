"""The page of `facert view`: a performance, how sure it is, how far off, and where to look."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import numpy as np

from facert.data.arrays import FloatArray, IntArray
from facert.pages.charts import Chart
from facert.pages.paint import Paint, Scale, skin
from facert.pages.playback import Playback
from facert.pages.server import complainer
from facert.pages.stage import FacePart, MarkerPart, Stage
from facert.pages.timeline import FrameList, Timeline
from facert.pages.view_data import Performance, highest
from facert.pages.worker import Worker
from facert.render.faces import Face
from facert.render.plots import most_varying

if TYPE_CHECKING:
    from viser import ViserServer

LISTED = 5  # frames worth a look
CHARTS = 3  # to begin with
OWN, ERROR, DOUBT = "its own", "error", "uncertainty"
SPEEDS = {"¼": 0.25, "½": 0.5, "1": 1.0, "2": 2.0}


class ViewPage:
    """A performance on a page.

    Parameters
    ----------
    server : ViserServer
    performance : Performance
    actor : Face, optional
        The actor's face, for a source of weights; markers are drawn as they are.
    """

    def __init__(
        self, server: ViserServer, performance: Performance, actor: Face | None = None
    ) -> None:
        self._server, self.performance = server, performance
        self.playback = Playback(performance.take.time)
        self._clock = time.perf_counter()
        self._faces = _Faces(server, performance, actor)
        server.gui.main_panel.dock_right()
        server.gui.main_panel.set_width(340)
        self._timeline = Timeline(server, performance.take, self.playback, self.seek)
        self._timeline.mark(performance.key_poses)
        self._add_colours()
        self._add_places()
        self._charts: dict[int, Chart] = {}
        self._add_curves()
        self._show()
        self.worker = Worker(complainer(server), self._tick)

    def seek(self, frame: int) -> None:
        """Go to a frame."""
        self.worker.do("seek", lambda: self._go(frame))

    def _go(self, frame: int) -> None:
        self.playback.seek(frame)
        self._show()

    def _show(self) -> None:
        frame = self.playback.frame
        self._faces.draw(frame, self._colours.value)
        self._timeline.show(frame)
        for chart in self._charts.values():
            chart.move(frame)

    def _tick(self) -> None:
        now = time.perf_counter()
        passed, self._clock = now - self._clock, now
        if self.playback.advance(passed):
            self._show()

    def _add_colours(self) -> None:
        server, kinds = self._server, self._faces.colours
        speed = server.gui.add_button_group("speed", tuple(SPEEDS))
        speed.on_click(lambda event: setattr(self.playback, "speed", SPEEDS[event.target.value]))
        self._colours = server.gui.add_dropdown("colours", kinds, visible=len(kinds) > 1)
        legend = server.gui.add_html(self._faces.scale.legend, visible=False)

        def choose(_: object) -> None:
            legend.visible = self._colours.value != OWN
            self.worker.do("colours", self._show)

        self._colours.on_update(choose)

    def _add_places(self) -> None:
        """Lists of frames: the least certain, and those that are most off."""
        performance, controls = self.performance, "of a control"
        units = performance.rig.units if performance.rig is not None else controls
        lists = (
            ("Most uncertain", performance.doubt, "±", controls),
            ("Largest errors", performance.errors, "off by", units),
        )
        for title, values, word, unit in lists:
            frames = [] if values is None else highest(values, performance.take.time, LISTED)
            FrameList(self._server, title, self.seek).show(
                [
                    (f, f"frame {f}   {word} {values[f]:.2g} {unit}")
                    for f in frames
                    if values is not None
                ]
            )

    def _add_curves(self) -> None:
        take = self.performance.take
        if take.controls is None or not len(take.labels):
            return
        names = take.controls.names
        with self._server.gui.add_folder("Curves"):
            chosen = self._server.gui.add_dropdown("show or hide", ("", *names))
            self._curves = self._server.gui.add_folder(None)

        @chosen.on_update
        def _(_: object) -> None:
            if chosen.value:
                control = names.index(chosen.value)
                chosen.value = ""  # type: ignore[misc]
                self.worker.do(("curve", control), lambda: self._toggle_curve(control))

        for control in most_varying(take, CHARTS):
            self._toggle_curve(control)

    def _toggle_curve(self, control: int) -> None:
        if control in self._charts:
            self._charts.pop(control).remove()
            return
        performance = self.performance
        with self._curves:
            chart = Chart(self._server, performance.take, performance.true_params, control)
        chart.move(self.playback.frame)
        self._charts[control] = chart


class _Faces:
    """Everything on the stage."""

    def __init__(self, server: ViserServer, performance: Performance, actor: Face | None) -> None:
        self._server, self._performance = server, performance
        self.scale: Scale = performance.scale()
        self._stage, source = Stage(server), performance.take.source
        self._markers: MarkerPart | None = None
        if source.kind == "markers":
            self._markers = MarkerPart(server, "markers", source.values)
            self._stage.add(self._markers)
        self._faces: list[tuple[Face, FacePart]] = []
        if actor is not None:
            self._add(actor, skin(actor.motion.neutral))
        if performance.face is not None:
            own = skin(performance.face.motion.neutral)
            for face in filter(None, (performance.face, performance.true_face)):
                self._add(face, own)

    def _add(self, face: Face, own: Paint) -> None:
        part = FacePart(self._server, face.label, face.motion.neutral, own)
        self._faces.append((face, part))
        self._stage.add(part)

    @property
    def colours(self) -> tuple[str, ...]:
        """What the character's colours can tell."""
        performance = self._performance
        error = (ERROR,) if performance.true_face is not None else ()
        doubtful = performance.face is not None and performance.doubt is not None
        return (OWN, *error, *((DOUBT,) if doubtful else ()))

    def draw(self, frame: int, colours: str) -> None:
        """A frame, with the character in some of `colours`."""
        rows: IntArray = np.array([frame])
        if self._markers is not None:
            self._markers.draw(self._performance.take.source.values[frame])
        for face, part in self._faces:
            vertices = face.motion.fetch(rows)[0]
            paint = self._paint(frame, colours) if face is self._performance.face else None
            part.draw(vertices, paint)

    def _paint(self, frame: int, colours: str) -> Paint | None:
        values: FloatArray | None = None
        if colours == ERROR:
            values = self._performance.vertex_errors(frame)
        elif colours == DOUBT:
            values = self._performance.vertex_doubt(frame)
        face = self._performance.face
        if values is None or face is None or not np.isfinite(values).all():
            return None
        return self.scale.paint(values, face.motion.neutral.faces)

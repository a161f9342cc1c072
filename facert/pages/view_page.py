"""The page of `facert view`: a performance, how sure it is, how far off, and where to look."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from facert.data.arrays import FloatArray, IntArray
from facert.errors import escaped
from facert.io.video_frames import VideoFrames
from facert.pages.charts import Chart
from facert.pages.keys import add_play_keys
from facert.pages.paint import Paint, Scale, skin
from facert.pages.stage import ActorParts, FacePart, Stage, face_part
from facert.pages.video_part import VideoPart
from facert.pages.view_data import Performance, highest
from facert.pages.widgets import ButtonList, Timeline
from facert.pages.worker import PlayedPage
from facert.render.faces import Face
from facert.render.plots import most_varying

if TYPE_CHECKING:
    from viser import ViserServer

LISTED = 5  # frames worth a look
CHARTS = 3  # to begin with
WIDTH = 340  # pixels of the panel
OWN, ERROR, UNCERTAIN = "its own", "error", "uncertainty"
SPEEDS = {"¼": 0.25, "½": 0.5, "1": 1.0, "2": 2.0}


class ViewPage(PlayedPage):
    """A performance on a page.

    Parameters
    ----------
    server : ViserServer
    performance : Performance
    actor : Face, optional
        The actor's face, for a source of weights; markers are drawn as they are.
    video : VideoFrames, optional
        The performer's.
    """

    def __init__(
        self,
        server: ViserServer,
        performance: Performance,
        actor: Face | None = None,
        video: VideoFrames | None = None,
    ) -> None:
        super().__init__(server, performance.take.time, WIDTH)
        self.performance = performance
        self._faces = _Faces(server, performance, actor, video)
        self._timeline = Timeline(server, performance.take, self)
        self._timeline.mark(performance.key_poses)
        self._add_colours()
        self._add_places()
        self._charts: dict[int, Chart] = {}
        self._add_curves()
        add_play_keys(server, self)
        self._show_frame()
        self.start()

    def _show_frame(self) -> None:
        frame = self.playback.frame
        self._faces.draw(frame, self._colours.value)
        self._timeline.show(frame)
        for chart in self._charts.values():
            chart.move(frame)

    def _add_colours(self) -> None:
        server, kinds = self._server, self._faces.colours
        speed = server.gui.add_button_group("speed", tuple(SPEEDS))
        speed.on_click(lambda event: setattr(self.playback, "speed", SPEEDS[event.target.value]))
        self._colours = server.gui.add_dropdown("colours", kinds, visible=len(kinds) > 1)
        legend = server.gui.add_html(self._faces.scale.legend, visible=False)

        def choose(_: object) -> None:
            legend.visible = self._colours.value != OWN
            self.worker.do("colours", self._show_frame)

        self._colours.on_update(choose)

    def _add_places(self) -> None:
        """Lists of frames: the least certain, and those that are most off."""
        performance, controls = self.performance, "of a control"
        units = performance.rig.units if performance.rig is not None else controls
        lists = (
            ("Most uncertain", performance.std, "±", controls),
            ("Largest errors", performance.errors, "off by", units),
        )
        for title, values, word, unit in lists:
            if values is not None:
                frames = highest(values, performance.take.time, LISTED)
                labels = {f: f"frame {f}   {word} {values[f]:.2g} {unit}" for f in frames}
                ButtonList(self._server, title, self.seek).show(labels)

    def _add_curves(self) -> None:
        take = self.performance.take
        if take.controls is None or not len(take.labels):
            return
        names = take.controls.names
        with self._server.gui.add_folder("Curves"):
            choices = ("", *map(escaped, names))
            chosen = self._server.gui.add_dropdown("show or hide", choices)
            self._curves = self._server.gui.add_folder(None)

        @chosen.on_update
        def _(_: object) -> None:
            if chosen.value:
                control = choices.index(chosen.value) - 1
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
    """The stage of the page: the actor, the character, and the truth."""

    def __init__(
        self,
        server: ViserServer,
        performance: Performance,
        actor: Face | None,
        video: VideoFrames | None,
    ) -> None:
        self._performance = performance
        self.scale: Scale = performance.scale()
        stage = Stage(server)
        self._video = None
        if video is not None:
            self._video = stage.add(VideoPart(server, video, performance.take.time))
        self._actor = ActorParts(server, stage, performance.take.source, actor)
        self._faces: list[tuple[Face, FacePart]] = []
        if performance.face is not None:
            own = skin(performance.face.motion.neutral)
            for face in filter(None, (performance.face, performance.true_face)):
                self._faces.append((face, stage.add(face_part(server, face, own))))

    @property
    def colours(self) -> tuple[str, ...]:
        """Choices of what the character's colours show."""
        performance = self._performance
        error = (ERROR,) if performance.true_face is not None else ()
        with_std = performance.face is not None and performance.std is not None
        return (OWN, *error, *((UNCERTAIN,) if with_std else ()))

    def draw(self, frame: int, colours: str) -> None:
        """A frame, with the character in some of `colours`."""
        rows: IntArray = np.array([frame])
        self._actor.draw(frame)
        if self._video is not None:
            self._video.draw(frame)
        for face, part in self._faces:
            vertices = face.motion.fetch(rows)[0]
            paint = self._paint(frame, colours) if face is self._performance.face else None
            part.draw(vertices, paint)

    def _paint(self, frame: int, colours: str) -> Paint | None:
        values: FloatArray | None = None
        if colours == ERROR:
            values = self._performance.vertex_errors(frame)
        elif colours == UNCERTAIN:
            values = self._performance.vertex_std(frame)
        face = self._performance.face
        if values is None or face is None or not np.isfinite(values).all():
            return None
        return self.scale.paint(values, face.motion.neutral.faces)

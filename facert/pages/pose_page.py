"""The page of `facert pose --view`: pose a frame, save it, train, look, pose the next."""

from __future__ import annotations

import logging
from collections.abc import Callable
from functools import partial
from html import escape
from typing import TYPE_CHECKING

import numpy as np
from viser import Icon

from facert.data.arrays import FloatArray
from facert.data.names import shape_drivers
from facert.data.rig import Rig
from facert.errors import InputError
from facert.pages.paint import skin
from facert.pages.pose_editor import PoseEditor, slider_bounds
from facert.pages.server import show_errors
from facert.pages.session import PosingSession, Trained
from facert.pages.stage import ActorParts, FacePart, Stage
from facert.pages.widgets import ButtonList, Sliders, Timeline
from facert.pages.worker import PlayedPage, Worker
from facert.render.faces import Face

if TYPE_CHECKING:
    from viser import GuiHtmlHandle, ViserServer

log = logging.getLogger(__name__)

SUGGESTED = 5
SAMPLES = 3  # other plausible poses
LEFT, RIGHT = 330, 320  # pixels of the panels
TRAIN, TRAINING = "Train on the labels", "Training ..."


class PosePage(PlayedPage):
    """A character to pose, and the take that it is posed for.

    All that changes the pose runs in one worker. Training and suggestions, which take a second,
    run in another, so that the sliders stay quick.

    Parameters
    ----------
    server : ViserServer
    rig : Rig
        The character.
    session : PosingSession
    actor : Face, optional
        The actor's face, for a source of weights.
    """

    def __init__(
        self, server: ViserServer, rig: Rig, session: PosingSession, actor: Face | None = None
    ) -> None:
        super().__init__(server, np.zeros(1) if session.take is None else session.take.time, RIGHT)
        self.session, self.editor = session, PoseEditor(session.controls, session.known)
        self._seed = 0
        self._drafts: dict[int, dict[int, float]] = {}  # what is pinned in frames that were left
        self._stage = _PoseStage(server, rig, session, actor)
        self._add_sliders()
        self._add_take()
        self._add_pose()
        self._add_learning()
        self.start()
        self.slow = Worker(show_errors(server))
        self.seek(0)
        self.suggest()

    def stop(self) -> None:
        """Stop the workers."""
        self.slow.stop()
        super().stop()

    def pin(self, control: int, value: float) -> None:
        """Hold a control; the others follow."""
        self._change(("pin", control), lambda: self.editor.pin(control, value))

    def let_go(self, control: int) -> None:
        """Let a control follow."""
        self._change(("let go", control), lambda: self.editor.let_go(control))

    def save(self) -> None:
        """Make the pose the label of the frame."""
        self.worker.do("save", self._save)

    def train(self) -> None:
        """Train on all labels, and show the result."""
        self._train_button.disabled, self._train_button.label = True, TRAINING
        self.slow.do("train", self._train)

    def suggest(self) -> None:
        """List the frames that are most worth posing now."""
        if self.session.take is not None:
            self.slow.do("suggest", self._suggest)

    def _change(self, key: object, change: Callable[[], None]) -> None:
        """Change the pose in the worker, and show it."""

        def task() -> None:
            change()
            self._show()

        self.worker.do(key, task)

    def _go(self, frame: int) -> None:
        if self.editor.pins:
            self._drafts[self.playback.frame] = dict(self.editor.pins)
        super()._go(frame)

    def _show_frame(self) -> None:
        """Begin with the frame's label or prediction, and with what was pinned there before."""
        frame = self.playback.frame
        if self.session.take is not None:
            self.editor.begin(*self.session.pose(frame))
            self.editor.pin_all(self._drafts.pop(frame, {}))
        self._show()

    def _show(self) -> None:
        frame, editor = self.playback.frame, self.editor
        self._stage.draw(frame, editor.pose)
        self._sliders.show(editor.pose, editor.pins)
        names = editor.controls.names
        self._pins.show({pin: f"{names[pin]}  {value:.2f}" for pin, value in editor.pins.items()})
        self._adopt.visible, self._free.visible = False, len(editor.pins) > 1
        if self._timeline is not None:
            self._timeline.show(frame)
        self._write(self._status, self._state(frame))

    def _state(self, frame: int) -> str:
        """The state of the pose, in a line."""
        editor, session = self.editor, self.session
        if editor.far:
            return "No known pose comes near what is pinned: the rest is a guess."
        if editor.pins and editor.known is None:
            return "Nothing is known of this character yet: pose three frames, and it follows."
        if editor.pins:
            spread = float(np.sqrt(np.mean(editor.std**2)))
            return f"The other controls follow, ± {spread:.2f}."
        if editor.from_neutral:
            return "Neutral. Move a slider: it is pinned, and the others follow."
        if session.labelled(frame):
            return "The frame's label."
        return "The model's prediction. Move what is wrong."

    def _save(self) -> None:
        frame = self.playback.frame
        path = self.session.save(frame, self.editor.pose)
        self.editor.learn(self.session.known)
        self._mark()
        self._show_frame()
        self._write(self._news, f"Frame {frame} saved to {escape(path.name)}.")
        self.suggest()

    def _train(self) -> None:
        """Train in the slow worker, and show the outcome from the other."""
        try:
            trained = self.session.train()
        finally:
            self._train_button.disabled, self._train_button.label = False, TRAIN
        self.worker.do("trained", partial(self._trained, trained))
        self._suggest()

    def _trained(self, trained: Trained) -> None:
        moved = "" if trained.change is None else f" Poses moved by {trained.change:.3f} (RMS)."
        path = self.session.model_path
        where = "" if path is None else f" {escape(path.name)} is written."
        self.editor.learn(self.session.known)
        if not self.editor.pins:
            self._show_frame()
        learned = f"Learned from {trained.labels} labels in {trained.seconds:.1f} s."
        self._write(self._news, learned + moved + where)

    def _suggest(self) -> None:
        """Find the frames to pose next, in the slow worker."""
        try:
            found = self.session.suggestion(SUGGESTED)
        except InputError as error:  # nearly all frames are posed
            log.debug("nothing to suggest: %s", error)
            self.worker.do("suggested", lambda: self._suggested.show({}))
            return
        labels = {
            frame: f"frame {frame}   stands for {share:.0%}"
            for frame, share in zip(found.frames.tolist(), found.shares.tolist(), strict=True)
        }
        self.worker.do("suggested", lambda: self._suggested.show(labels))

    def _sample(self) -> None:
        self._seed += 1
        poses = self.editor.samples(SAMPLES, self._seed)
        self._samples = poses
        self._stage.show_samples(poses)
        self._adopt.visible = len(poses) > 0

    def _mark(self) -> None:
        take = self.session.take
        if take is None or self._timeline is None:
            return
        self._timeline.mark(take.labels)
        self._train_button.hint = f"{len(take.labels)} labels"

    def _add_sliders(self) -> None:
        panel = self._server.gui.add_panel()
        with panel.add_tab("Controls"):
            self._sliders = Sliders(
                self._server, self.editor.controls.names, slider_bounds(self.editor), self.pin
            )
        panel.dock_left()
        panel.set_width(LEFT)

    def _add_take(self) -> None:
        self._timeline: Timeline | None = None
        if self.session.take is not None:
            self._timeline = Timeline(self._server, self.session.take, self.playback, self.seek)
            self._suggested = ButtonList(self._server, "Pose next", self.seek)

    def _add_pose(self) -> None:
        gui = self._server.gui
        self._status = gui.add_html("")
        self._pins = ButtonList(
            self._server, "Pinned (click to let go)", self.let_go, Icon.PINNED_OFF
        )
        self._free = gui.add_button("Let all go", icon=Icon.PINNED_OFF, color="gray")
        neutral = gui.add_button("Start from neutral", icon=Icon.MOOD_NEUTRAL, color="gray")
        other = gui.add_button("Other plausible poses", icon=Icon.ARROWS_SHUFFLE, color="gray")
        self._adopt = gui.add_button_group(
            "take over", tuple(f"other {number}" for number in range(1, SAMPLES + 1)), visible=False
        )
        self._free.on_click(lambda _: self._change("let all go", self.editor.let_all_go))
        neutral.on_click(lambda _: self._change("neutral", lambda: self.editor.begin(None)))
        other.on_click(lambda _: self.worker.do("sample", self._sample))

        @self._adopt.on_click
        def _(_: object) -> None:
            chosen = int(self._adopt.value.split()[-1]) - 1
            self._change("adopt", lambda: self.editor.adopt(self._samples[chosen]))

    def _add_learning(self) -> None:
        gui = self._server.gui
        there = self.session.take is not None
        save = gui.add_button(
            "Save as this frame's pose", icon=Icon.CHECK, color="green", visible=there
        )
        self._train_button = gui.add_button(TRAIN, icon=Icon.SCHOOL, visible=there)
        self._news = gui.add_html("")
        save.on_click(lambda _: self.save())
        self._train_button.on_click(lambda _: self.train())
        self._mark()

    def _write(self, where: GuiHtmlHandle, text: str) -> None:
        where.content = f'<div style="padding:4px 12px;font-size:13px">{text}</div>'


class _PoseStage:
    """The stage of the page: the actor in a frame, the posed character, and other poses.

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
        source = None if session.take is None else session.take.source
        self._actor = ActorParts(server, self._stage, source, actor)
        own = skin(rig.mesh)
        self._character = self._stage.add(FacePart(server, "character", rig.mesh, own))
        self._samples = [
            FacePart(server, f"other {number}", rig.mesh, own) for number in range(1, SAMPLES + 1)
        ]
        for part in self._samples:
            part.root.visible = False
            self._stage.add(part, row=1)

    def draw(self, frame: int, pose: FloatArray) -> None:
        """A frame of the actor, and the character's pose (P,); the samples leave."""
        self._actor.draw(frame)
        self._character.draw(self._vertices(pose[None])[0])
        self.show_samples(np.empty((0, len(pose))))

    def show_samples(self, poses: FloatArray) -> None:
        """Other poses (n, P) beside the character, at most `SAMPLES`."""
        changed = sum(part.root.visible for part in self._samples) != len(poses)
        for part, vertices in zip(self._samples, self._vertices(poses), strict=False):
            part.draw(vertices)
        for number, part in enumerate(self._samples):
            part.root.visible = number < len(poses)
        if changed:
            self._stage.arrange()

    def _vertices(self, poses: FloatArray) -> FloatArray:
        return self._rig.deform(poses @ self._drivers)

"""The page of `facert pose --view`: pose a frame, save it, train, look, pose the next."""

from __future__ import annotations

import logging
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from facert.data.rig import Rig
from facert.errors import InputError
from facert.pages.history import Change, FrameState, History
from facert.pages.keys import add_key, add_play_keys
from facert.pages.pose_editor import Edit, PoseEditor
from facert.pages.pose_panels import (
    AFTER,
    BEFORE,
    LearningPanel,
    PosePanel,
    SaveBar,
    add_sliders,
)
from facert.pages.pose_stage import SAMPLES, PoseStage
from facert.pages.server import show_errors
from facert.pages.session import PosingSession, Trained
from facert.pages.widgets import ButtonList, Timeline
from facert.pages.worker import PlayedPage, Worker
from facert.render.faces import Face

if TYPE_CHECKING:
    from viser import ViserServer

log = logging.getLogger(__name__)

SUGGESTED = 5
RIGHT = 320  # pixels of the panel


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
        self.history = History()
        self._seed = 0
        self._drafts: dict[int, Edit] = {}  # of frames that were left before they were saved
        self._stage = PoseStage(server, rig, session, actor)
        self._add_panels()
        self._add_keys()
        self._mark()
        self.start()
        self.slow = Worker(show_errors(server))
        self.seek(0)
        self.suggest()

    def stop(self) -> None:
        """Stop the workers."""
        self.slow.stop()
        super().stop()

    @property
    def unsaved(self) -> list[int]:
        """The frames, rising, whose pose was changed and not saved."""
        here = {self.playback.frame} if self.editor.edit.is_change else set()
        return sorted(here | self._drafts.keys())

    def pin(self, control: int, value: float) -> None:
        """Hold a control; the others follow."""
        name = self.editor.controls.names[control]
        self._change(("pin", control), name, lambda: self.editor.pin(control, value))

    def let_go(self, control: int) -> None:
        """Let a control follow."""
        self._change(object(), "letting go", lambda: self.editor.let_go(control))

    def let_all_go(self) -> None:
        """Let all controls follow."""
        self._change(object(), "letting go", self.editor.let_all_go)

    def start_from_neutral(self) -> None:
        """Begin the pose anew."""
        self._change(object(), "start from neutral", lambda: self.editor.begin_anew(None))

    def mirror(self) -> None:
        """Exchange left and right of the pose."""
        self._change(object(), "mirror", self.editor.mirror)

    def pin_counterpart(self) -> None:
        """Pose the other side like the control that was pinned last."""

        def pin() -> None:
            if (control := self.editor.one_sided_pin) is not None:
                self.editor.pin_counterpart(control)

        self._change(object(), "the other side", pin)

    def copy(self, which: str) -> None:
        """Begin with the pose of a key: `BEFORE` this frame, `AFTER` it, or the nearest in time."""

        def copy() -> None:
            key = self._key(which)
            self.editor.begin_anew(self.session.pose(key)[0])
            self._bar.news.write(f"Begun with the pose of frame {key}.")

        self._change(object(), "copy", copy)

    def save(self) -> None:
        """Make the pose the label of the frame."""
        self._change(object(), "save", self._save)

    def undo(self) -> None:
        """Take back the last change, also one that was saved."""
        self.worker.do(object(), lambda: self._restore(self.history.undo(), back=True))

    def redo(self) -> None:
        """Make the change anew that was taken back last."""
        self.worker.do(object(), lambda: self._restore(self.history.redo(), back=False))

    def train(self) -> None:
        """Train on all labels, and show the result."""
        self._learning.show_training(True)
        self.slow.do("train", self._train)

    def suggest(self) -> None:
        """List the frames that are most worth posing now."""
        if self.session.take is not None:
            self.slow.do("suggest", self._suggest)

    def sample(self) -> None:
        """Show other plausible poses."""
        self.worker.do("sample", self._sample)

    def adopt(self, number: int) -> None:
        """Go on from one of the other plausible poses."""
        self._change(object(), "another pose", lambda: self.editor.adopt(self._samples[number]))

    def _change(self, kind: object, what: str, change: Callable[[], None]) -> None:
        """Change the pose in the worker, so that it can be undone, and show it."""

        def task() -> None:
            before = self._state
            change()
            self.history.add(Change(what, before, self._state), kind)
            self._show()

        self.worker.do(kind, task)

    @property
    def _state(self) -> FrameState:
        frame = self.playback.frame
        return FrameState(frame, self.editor.edit, self.session.saved_pose(frame))

    def _restore(self, change: Change | None, back: bool) -> None:
        """Take a change back, or make it anew, in the frame where it was made."""
        word = "Undone" if back else "Done again"
        if change is None:
            self._bar.news.write(f"Nothing to {'undo' if back else 'do again'}.")
            return
        was, now = (change.after, change.before) if back else (change.before, change.after)
        if now.saved is not was.saved:
            self.session.put(now.frame, now.saved)
            self._learned_labels()
        if self.playback.frame != now.frame:
            self._go(now.frame)
        self.editor.restore(now.edit)
        self._show()
        self._bar.news.write(f"{word}: {change.what}, frame {now.frame}.")

    def _leave(self) -> None:
        if self.editor.edit.is_change:
            self._drafts[self.playback.frame] = self.editor.edit

    def _show_frame(self) -> None:
        """Begin with the frame's label or prediction, and with what was changed there before."""
        frame = self.playback.frame
        if self.session.take is not None:
            self.editor.begin(*self.session.pose(frame))
            draft = self._drafts.pop(frame, None)
            if draft is not None and draft.chosen:
                self.editor.restore(draft)
            elif draft is not None:
                self.editor.pin_all(draft.pins)
        self._show()

    def _show(self) -> None:
        frame, editor = self.playback.frame, self.editor
        self._stage.draw(frame, editor.pose)
        self._sliders.show(editor.pose, editor.pins)
        self._pose.show()
        if self._timeline is not None:
            self._timeline.show(frame)
            self._unsaved.show({other: f"frame {other}" for other in self._drafts})
        self._pose.status.write(self._status(frame))

    def _status(self, frame: int) -> str:
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
        if editor.edit.chosen:
            return "Not saved yet. Move what is wrong."
        if session.labelled(frame):
            return "The frame's label."
        return "The model's prediction. Move what is wrong."

    def _key(self, which: str) -> int:
        """The labelled frame before or after this one, or the nearest in time."""
        frame, take = self.playback.frame, self.session.take
        assert take is not None  # the buttons are not shown without one
        keys = take.labels[take.labels != frame]
        sides = {BEFORE: keys[keys < frame][-1:], AFTER: keys[keys > frame][:1]}
        found = sides.get(which, keys)
        if not len(found):
            raise InputError("copy", "another key pose there", "none", "Pose and save one.")
        return int(found[np.abs(take.time[found] - take.time[frame]).argmin()])

    def _save(self) -> None:
        frame = self.playback.frame
        path = self.session.save(frame, self.editor.pose)
        self._learned_labels()
        self.editor.begin(*self.session.pose(frame))
        self._bar.news.write(f"Frame {frame} saved to {path.name}.")

    def _learned_labels(self) -> None:
        """Learn what goes together from the labels as they are now."""
        self.editor.learn(self.session.known)
        self._mark()
        self.suggest()

    def _train(self) -> None:
        """Train in the slow worker, and show the outcome from the other."""
        try:
            trained = self.session.train()
        finally:
            self._learning.show_training(False)
        self.worker.do("trained", partial(self._trained, trained))
        self._suggest()

    def _trained(self, trained: Trained) -> None:
        moved = "" if trained.change is None else f" Poses moved by {trained.change:.3f} (RMS)."
        path = self.session.model_path
        where = "" if path is None else f" {path.name} is written."
        self.editor.learn(self.session.known)
        if not self.editor.edit.is_change:
            self._show_frame()
        learned = f"Learned from {trained.labels} labels in {trained.seconds:.1f} s."
        self._learning.outcome.write(learned + moved + where)

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
        self._samples = self.editor.samples(SAMPLES, self._seed)
        self._stage.show_samples(self._samples)
        self._pose.adopt.visible = len(self._samples) > 0

    def _mark(self) -> None:
        take = self.session.take
        if take is None or self._timeline is None:
            return
        self._timeline.mark(take.labels)
        self._learning.show_labels(len(take.labels))

    def _add_panels(self) -> None:
        server, there = self._server, self.session.take is not None
        self._sliders = add_sliders(server, self.editor, self)
        self._timeline: Timeline | None = None
        if self.session.take is not None:
            self._timeline = Timeline(server, self.session.take, self)
            self._suggested = ButtonList(server, "Pose next", self.seek)
            self._unsaved = ButtonList(server, "Changed and not saved", self.seek)
        self._pose = PosePanel(server, self)
        self._learning = LearningPanel(server, self, there)
        self._bar = SaveBar(server, self, there)

    def _add_keys(self) -> None:
        add_play_keys(self._server, self)
        add_key(self._server, "Undo", "Z", self.undo, "cmd/ctrl")
        add_key(self._server, "Redo", "Z", self.redo, "cmd/ctrl+shift")
        add_key(self._server, "Mirror the pose", "M", self.mirror)
        if self.session.take is not None:
            add_key(self._server, "Save as this frame's pose", "S", self.save, "cmd/ctrl")

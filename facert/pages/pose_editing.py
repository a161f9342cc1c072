"""Posing a frame on a page: what is changed, taken back, saved, and left for later."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from facert.data.arrays import FloatArray
from facert.data.corrections import WIDTH
from facert.data.rig import Rig
from facert.errors import InputError
from facert.io.video_frames import VideoFrames
from facert.pages.history import Change, FrameState, History
from facert.pages.keys import add_key, add_play_keys
from facert.pages.pose_editor import Edit, PoseEditor
from facert.pages.pose_panels import AFTER, BEFORE, PosePanel, SaveBar, add_sliders
from facert.pages.pose_stage import SAMPLES, PoseStage
from facert.pages.session import PosingSession
from facert.pages.take_panel import Place, TakePanel
from facert.pages.worker import Playback, PlayedPage
from facert.render.faces import Face

if TYPE_CHECKING:
    from viser import ViserServer

RIGHT = 320  # pixels of the panel


class PoseEditing(PlayedPage):
    """A character to pose, and the takes that it is posed for; one of them is looked at.

    All that changes the pose runs in one worker.

    Parameters
    ----------
    server : ViserServer
    rig : Rig
        The character.
    session : PosingSession
    actors : sequence of Face or None
        The actor's face in each take, for sources of weights.
    video : VideoFrames, optional
        The performer's, of the only take.
    """

    def __init__(
        self,
        server: ViserServer,
        rig: Rig,
        session: PosingSession,
        actors: Sequence[Face | None] = (),
        video: VideoFrames | None = None,
    ) -> None:
        super().__init__(server, _time(session), RIGHT)
        self.session, self.editor = session, PoseEditor(session.controls, session.known)
        self.history = History()
        self._seed, self._width = 0, WIDTH
        self._drafts: dict[Place, Edit] = {}  # of frames that were left before they were saved
        self._stage = PoseStage(server, rig, session, actors, video)
        self._sliders = add_sliders(server, self.editor, self)
        self._takes = TakePanel(server, self, session) if session.parts else None
        self._pose = PosePanel(server, self)
        self._bar = SaveBar(server, self, bool(session.parts))
        self._add_keys()

    @property
    def unsaved(self) -> list[Place]:
        """Takes and frames, rising, whose pose was changed and not saved."""
        here = {self._place} if self.editor.edit.is_change else set()
        return sorted(here | self._drafts.keys())

    @property
    def unsaved_names(self) -> list[str]:
        """The same for people."""
        return [self.frame_name(place) for place in self.unsaved]

    @property
    def _place(self) -> Place:
        return self.session.here, self.playback.frame

    def frame_name(self, place: Place) -> str:
        """A frame for people; where there are several takes, FILE:FRAME."""
        take, frame = place
        parts = self.session.parts
        return f"frame {frame}" if len(parts) < 2 else f"{parts[take].name}:{frame}"

    def go_to(self, place: Place) -> None:
        """Go to a frame of a take."""
        self.worker.do("seek", lambda: self._go_to(place))

    def turn_to(self, take: int) -> None:
        """Look at another take, from its first frame on."""
        self.go_to((take, 0))

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
            name = self.frame_name((self.session.here, key))
            self._bar.news.write(f"Begun with the pose of {name}.")

        self._change(object(), "copy", copy)

    def save(self) -> None:
        """Make the pose the label of the frame."""
        self._change(object(), "save", self._save)

    def take_back(self) -> None:
        """Leave the frame without the pose that was saved for it."""
        self._change(object(), "taking back", self._take_back)

    def widen(self, seconds: float) -> None:
        """Blend the pose of the frame, or the next that is saved, over so many seconds."""

        def widen() -> None:
            self._width = seconds
            label = self.session.label(self.playback.frame)
            if label is not None:
                self.session.put(self.playback.frame, replace(label, width=seconds))

        self._change("widen", "the time of blending", widen)

    def undo(self) -> None:
        """Take back the last change, also one that was saved."""
        self.worker.do(object(), lambda: self._restore(self.history.undo(), back=True))

    def redo(self) -> None:
        """Make the change anew that was taken back last."""
        self.worker.do(object(), lambda: self._restore(self.history.redo(), back=False))

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
        take, frame = self._place
        return FrameState(take, frame, self.editor.edit, self.session.label(frame))

    def _restore(self, change: Change | None, back: bool) -> None:
        """Take a change back, or make it anew, in the frame where it was made."""
        word = "Undone" if back else "Done again"
        if change is None:
            self._bar.news.write(f"Nothing to {'undo' if back else 'do again'}.")
            return
        was, now = (change.after, change.before) if back else (change.before, change.after)
        if self._place != now.place:
            self._go_to(now.place)
        if now.saved is not was.saved:
            self.session.put(now.frame, now.saved)
            self._learned_labels()
        self.editor.restore(now.edit)
        self._show()
        self._bar.news.write(f"{word}: {change.what}, {self.frame_name(now.place)}.")

    def _go_to(self, place: Place) -> None:
        take, frame = place
        if take != self.session.here:
            self._leave()
            self.editor.begin(None)  # what was changed is kept
            self.session.here = take
            self.playback = Playback(_time(self.session))
            assert self._takes is not None  # there are several
            self._takes.turn_to(take)
            self._stage.turn_to(take)
        self._go(frame)

    def _leave(self) -> None:
        if self.editor.edit.is_change:
            self._drafts[self._place] = self.editor.edit

    def _show_frame(self) -> None:
        """Begin with the frame's label or prediction, and with what was changed there before."""
        frame = self.playback.frame
        if self.session.take is not None:
            self.editor.begin(*self.session.pose(frame))
            draft = self._drafts.pop(self._place, None)
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
        if self._takes is not None:
            self._takes.show(frame, {place: self.frame_name(place) for place in self._drafts})
            label = self.session.label(frame)
            blends = self.session.result is not None
            self._pose.show_label(blends, self._width if label is None else label.width, label)
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
            of_result = session.part is not None and session.part.is_result
            return "A corrected frame." if of_result else "The frame's label."
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
        old = self.session.label(frame)
        width = self._width if old is None else old.width
        path = self.session.save(frame, self.editor.pose, width)
        self._saved(f"Frame {frame} saved to {path.name}.")

    def _take_back(self) -> None:
        frame = self.playback.frame
        if self.session.labelled(frame):
            path = self.session.put(frame, None)
            self._saved(f"Frame {frame} has no pose in {path.name} any more.")

    def _saved(self, news: str) -> None:
        self._learned_labels()
        self.editor.begin(*self.session.pose(self.playback.frame))
        self._bar.news.write(news)

    def _learned_labels(self) -> None:
        """Learn what goes together from the labels as they are now."""
        self.editor.learn(self.session.known)
        self._mark()

    def _mark(self) -> None:
        if self._takes is not None:
            self._takes.mark()

    def _sample(self) -> None:
        self._seed += 1
        self._samples = self.editor.samples(SAMPLES, self._seed)
        self._stage.show_samples(self._samples)
        self._pose.adopt.visible = len(self._samples) > 0

    def _add_keys(self) -> None:
        add_play_keys(self._server, self)
        add_key(self._server, "Undo", "Z", self.undo, "cmd/ctrl")
        add_key(self._server, "Redo", "Z", self.redo, "cmd/ctrl+shift")
        add_key(self._server, "Mirror the pose", "M", self.mirror)
        if self.session.take is not None:
            add_key(self._server, "Save as this frame's pose", "S", self.save, "cmd/ctrl")


def _time(session: PosingSession) -> FloatArray:
    return np.zeros(1) if session.take is None else session.take.time

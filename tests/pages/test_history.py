import pytest

from facert.pages.history import PAUSE, Change, FrameState, History
from facert.pages.pose_editor import Edit


class Clock:
    now = 0.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def history(clock) -> History:
    return History(clock)


def state(frame: int, value: float) -> FrameState:
    return FrameState(0, frame, Edit({0: value}, None, None, False), None)


def move(history: History, frame: int, old: float, new: float, kind: object = "pin") -> Change:
    change = Change("jaw", state(frame, old), state(frame, new))
    history.add(change, kind)
    return change


def test_changes_are_undone_and_done_again_in_their_order(history) -> None:
    first = move(history, 0, 0.0, 0.1, "jaw")
    second = move(history, 0, 0.1, 0.2, "brow")
    assert history.redo() is None
    assert [history.undo(), history.undo(), history.undo()] == [second, first, None]
    assert [history.redo(), history.redo(), history.redo()] == [first, second, None]


def test_a_new_change_ends_what_could_be_done_again(history) -> None:
    move(history, 0, 0.0, 0.1)
    history.undo()
    move(history, 0, 0.0, 0.3)
    assert history.redo() is None


def test_a_dragged_slider_is_one_change_and_a_pause_ends_it(history, clock) -> None:
    move(history, 0, 0.0, 0.1)
    move(history, 0, 0.1, 0.2)
    clock.now = 2 * PAUSE
    move(history, 0, 0.2, 0.3)
    assert history.undo().before.edit.pins == {0: 0.2}
    whole = history.undo()
    assert (whole.before.edit.pins, whole.after.edit.pins) == ({0: 0.0}, {0: 0.2})
    assert history.undo() is None


def test_changes_of_two_frames_and_those_after_an_undo_stay_apart(history) -> None:
    move(history, 0, 0.0, 0.1)
    move(history, 1, 0.0, 0.2)
    assert history.undo().after.frame == 1
    move(history, 0, 0.1, 0.3)
    assert history.undo().before.edit.pins == {0: 0.1}
    assert history.undo().before.edit.pins == {0: 0.0}

from threading import Event

import numpy as np
import pytest

from facert.errors import InputError
from facert.pages.worker import Playback, Worker

TIME = np.array([0.0, 0.1, 0.2, 0.5])


def test_what_waits_under_one_key_is_done_once_with_the_newest() -> None:
    done: list[object] = []
    gate = Event()
    worker = Worker(done.append)
    worker.do("gate", lambda: gate.wait(5.0) and None)
    for value in range(5):
        worker.do("slider", lambda value=value: done.append(value))
    worker.do("other", lambda: done.append("other"))
    gate.set()
    assert worker.finish()
    assert done == [4, "other"]
    worker.stop()


def test_order_is_kept_where_two_tasks_of_a_key_are_apart() -> None:
    done: list[object] = []
    gate = Event()
    worker = Worker(done.append)
    worker.do("gate", lambda: gate.wait(5.0) and None)
    for key, value in (("save", 1), ("seek", 2), ("save", 3)):
        worker.do(key, lambda value=value: done.append(value))
    gate.set()
    assert worker.finish()
    assert done == [1, 2, 3]
    worker.stop()


def test_a_mistake_is_shown_and_the_next_task_is_done(caplog) -> None:
    shown: list[str] = []
    worker = Worker(shown.append)

    def wrong() -> None:
        raise InputError("jawOpen", "0 to 1", "2", "Keep to its limits.")

    worker.do(1, wrong)
    worker.do(2, lambda: 1 // 0)
    worker.do(3, lambda: shown.append("done"))
    assert worker.finish()
    assert shown[0].startswith("jawOpen: expected 0 to 1, found 2")
    assert shown[1].startswith("ZeroDivisionError")
    assert shown[2] == "done"
    worker.stop()


def test_it_ticks_while_nothing_waits_and_not_after_its_end() -> None:
    ticks: list[int] = []
    third = Event()

    def tick() -> None:
        ticks.append(1)
        if len(ticks) == 3:
            third.set()

    worker = Worker(print, tick, pause=0.001)
    assert third.wait(5.0)
    worker.stop()
    count = len(ticks)
    assert not Event().wait(0.02)
    assert len(ticks) == count


def test_time_stands_until_it_plays() -> None:
    playback = Playback(TIME)
    assert not playback.advance(1.0)
    assert playback.frame == 0


@pytest.mark.parametrize(
    ("passed", "speed", "frame"),
    [(0.05, 1, 0), (0.15, 1, 1), (0.4, 1, 2), (0.4, 0.25, 1), (9, 1, 0)],
)
def test_the_frame_is_the_last_that_has_begun_and_the_end_leads_to_the_start(
    passed: float, speed: float, frame: int
) -> None:
    playback = Playback(TIME, playing=True, speed=speed)
    playback.advance(passed)
    assert playback.frame == frame


def test_small_steps_come_to_the_same_as_a_large_one() -> None:
    playback = Playback(TIME, playing=True)
    changes = [playback.advance(0.01) for _ in range(30)]
    assert playback.frame == 2
    assert sum(changes) == 2


def test_seeking_stops_at_the_ends() -> None:
    playback = Playback(TIME)
    for wanted, there in ((2, 2), (-5, 0), (99, 3)):
        playback.seek(wanted)
        assert playback.frame == there

from threading import Event

from facert.errors import InputError
from facert.pages.worker import Worker


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


def test_a_mistake_is_said_and_the_next_task_is_done(caplog) -> None:
    said: list[str] = []
    worker = Worker(said.append)

    def wrong() -> None:
        raise InputError("jawOpen", "0 to 1", "2", "Keep to its limits.")

    worker.do(1, wrong)
    worker.do(2, lambda: 1 // 0)
    worker.do(3, lambda: said.append("done"))
    assert worker.finish()
    assert said[0].startswith("jawOpen: expected 0 to 1, found 2")
    assert said[1].startswith("ZeroDivisionError")
    assert said[2] == "done"
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

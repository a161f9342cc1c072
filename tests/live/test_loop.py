import time
from dataclasses import replace

import numpy as np
import pytest

from facert.errors import NumericalError
from facert.live.frames import Counters, Frame, frame_pattern
from facert.live.loop import CATCH_UP, PATIENCE, Limits, LiveSession
from facert.retarget.stream import Streamed


class Script:
    """A receiver that brings what it was given, one list a turn."""

    fps, start_timecode = 60.0, ""

    def __init__(self, *turns):
        self.counters, self.pattern = Counters(), frame_pattern(["a"])
        self._turns = [
            [Frame(number / 60, np.array([float(number)]), time.perf_counter()) for number in turn]
            for turn in turns
        ]
        self.counters.received = sum(map(len, turns))

    @property
    def finished(self):
        return not self._turns

    def wait(self, _):
        return self._turns.pop(0)

    def rehearse(self):
        pass

    def close(self):
        pass


class Kept:
    """An output that remembers."""

    def __init__(self):
        self.sent = []

    def send(self, frame, pose):
        self.sent.append((frame.time, float(pose.params[0])))

    def rehearse(self, frame, pose):
        pass

    def close(self):
        pass


def doubled(frame):
    return Streamed(2.0 * frame.values, lambda: (None, frame.values))


@pytest.fixture
def run(plain):
    """Runs a session; the session, and what it sent."""

    def running(script, mapping=doubled, limits=Limits(), **watched):  # noqa: B008
        kept = Kept()
        session = LiveSession(script, plain(mapping), [kept])
        session.run(limits, **watched)
        return session, [pose for _, pose in kept.sent]

    return running


def test_every_frame_is_mapped_and_sent_with_its_time(plain):
    kept, script = Kept(), Script([0], [1], [2])
    LiveSession(script, plain(doubled), [kept], [kept]).run(Limits())
    assert kept.sent == [(n / 60, 2.0 * n) for n in (0, 0, 1, 1, 2, 2)]
    assert script.counters.mapped == 3


def test_frames_that_waited_a_moment_are_all_mapped(monkeypatch, run):
    monkeypatch.setattr("facert.live.loop.CATCH_UP", 10.0)
    session, sent = run(Script([0], [1, 2, 3, 4]))
    assert sent == [0.0, 2.0, 4.0, 6.0, 8.0]
    assert session.counters.dropped == 0


def test_when_mapping_is_too_slow_the_newest_frame_wins(run):
    def slow(frame):
        time.sleep(2 * CATCH_UP)
        return doubled(frame)

    session, sent = run(Script([0], [1, 2, 3, 4], [5, 6]), slow)
    assert sent == [0.0, 8.0, 12.0]
    assert session.counters.dropped == 4
    assert session.counters.mapped + session.counters.dropped == session.counters.received


def test_a_frame_without_a_pose_is_counted_and_the_show_goes_on(caplog, run):
    def odd(frame):
        if frame.values[0] % 2:
            raise NumericalError("no finite pose")
        return doubled(frame)

    session, sent = run(Script([0], [1], [2], [3]), odd)
    assert sent == [0.0, 4.0]
    assert session.counters.failed == 2
    assert caplog.text.count("no finite pose") == 1


def test_it_ends_after_so_many_frames(run):
    session, sent = run(Script([0], [1, 2, 3], [4]), limits=Limits(frames=2))
    assert len(sent) == session.counters.mapped == 2


def test_it_ends_after_so_many_seconds(run):
    class Silent(Script):
        finished = False

        def wait(self, seconds):
            time.sleep(min(seconds, 0.01))
            return []

    began = time.monotonic()
    run(Silent(), limits=Limits(seconds=0.05))
    assert time.monotonic() - began >= 0.05


def test_it_ends_when_somebody_wants_it_to(run):
    calls = []
    _, sent = run(
        Script([0], [1], [2]), stopped=lambda: len(calls) == 2, between=lambda: calls.append(1)
    )
    assert sent == [0.0, 2.0]


def test_latency_is_measured_from_arrival_until_all_is_sent(run):
    def slow(frame):
        time.sleep(0.02)
        return doubled(frame)

    session, _ = run(Script([0], [1], [2]), slow)
    pace = session.meter.pace()
    assert 20.0 <= pace.median <= pace.p99 <= pace.worst


def test_without_frames_there_is_no_pace(run):
    session, _ = run(Script([]))
    assert np.isnan(session.meter.pace().median)


@pytest.mark.parametrize(("frames", "seconds"), [(None, None), (3, 1.5)])
def test_limits_that_are_not_given_never_come(frames, seconds):
    limits = Limits.of(frames, seconds)
    assert limits.frames == (frames or np.inf)
    assert limits.seconds == (seconds or np.inf)


class Waiting(Script):
    """Brings what it was given, with nothing in between as often as there is patience for."""

    def __init__(self, *turns):
        super().__init__(*turns)
        self.waits = []

    def wait(self, seconds):
        self.waits.append(seconds)
        time.sleep(min(seconds, 0.001))
        found = self._turns.pop(0)
        return [replace(frame, arrived=time.perf_counter()) for frame in found]


def test_between_frames_it_prepares_and_rehearses_the_last_one(plain):
    kept, mapper, script = Kept(), plain(doubled), Waiting([0], [], [1], [], [], [2, 3])
    LiveSession(script, mapper, [kept]).run(Limits())
    assert mapper.prepared == 3
    assert mapper.rehearsed == [0.0, 1 / 60, 1 / 60]
    assert kept.sent == [(n / 60, 2.0 * n) for n in range(4)]
    assert script.counters.mapped == 4


def test_nothing_is_rehearsed_before_there_was_a_pose(plain):
    def none(_):
        raise NumericalError("no finite pose")

    mapper = plain(none)
    LiveSession(Waiting([], [0], []), mapper, [Kept()]).run(Limits())
    assert not mapper.rehearsed


def test_a_rehearsal_that_fails_changes_nothing(plain):
    class Shy(plain):
        def rehearse(self, _):
            raise NumericalError("not now")

    script = Waiting([0], [], [1])
    LiveSession(script, Shy(doubled), [Kept()]).run(Limits())
    assert (script.counters.mapped, script.counters.failed) == (2, 0)


def test_it_waits_for_long_only_while_no_frames_come(plain):
    script = Waiting([], [0], [], [1])
    LiveSession(script, plain(doubled), [Kept()]).run(Limits())
    assert script.waits[:2] == [PATIENCE] * 2
    assert max(script.waits[2:]) < PATIENCE


def test_packets_that_complete_no_frame_do_not_make_it_rehearse(plain):
    """However many come, it gets ready when a frame is due, and not for each of them."""

    class Junk(Script):
        rehearsed = 0

        def rehearse(self):
            self.rehearsed += 1

    script = Junk([0], [1], *[[] for _ in range(500)])
    LiveSession(script, plain(doubled), [Kept()]).run(Limits())
    assert script.counters.mapped == 2
    assert script.rehearsed < 20

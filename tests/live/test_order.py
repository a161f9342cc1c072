import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from facert.live.frames import Observed
from facert.live.order import SILENCE, Order

STEP = 1 / 60
NOTHING = np.zeros(1)


def seen(stamp, sender="phone", content=b""):
    return Observed(
        NOTHING, sender, stamp, None if stamp is None else repr(stamp).encode() + content
    )


def play(frames, order=None, begin=100.0, every=STEP):
    """Times in the session of frames that come one after the other."""
    order = order or Order()
    return [order.place(frame, "host", begin + index * every) for index, frame in enumerate(frames)]


def test_time_begins_at_0_and_follows_the_senders_clock():
    times = play([seen(5000 + index * STEP) for index in range(20)], every=STEP * 0.9)
    np.testing.assert_allclose(times, np.arange(20) * STEP, atol=1e-9)


def test_without_a_clock_time_is_that_of_arrival():
    times = play([seen(None)] * 20, every=0.01)
    np.testing.assert_allclose(times, np.arange(20) * 0.01, atol=1e-9)


@settings(deadline=None, max_examples=50)
@given(st.lists(st.none() | st.floats(0, 1e6), max_size=40), st.data())
def test_time_always_rises(stamps, data):
    order, arrived, last = Order(), 0.0, -1.0
    for stamp in stamps:
        arrived += data.draw(st.floats(0, 2))
        placed = order.place(seen(stamp), "host", arrived)
        if placed is not None:
            assert placed > last
            last = placed


def test_copies_are_refused_however_many():
    frames = [seen(index * STEP) for index in range(50)]
    order = Order()
    first = play(frames, order)
    again = play(frames * 20, order, begin=100.0 + 50 * STEP, every=1e-5)
    assert None not in first
    assert set(again) == {None}


def test_a_replay_between_the_true_frames_changes_nothing():
    frames = [seen(index * STEP) for index in range(200)]
    mixed = [one for pair in itertools.zip_longest(frames, frames[:150]) for one in pair if one]
    times = play(mixed, every=STEP / 2)
    placed = [time for time in times if time is not None]
    np.testing.assert_allclose(placed, np.arange(200) * STEP, atol=1e-9)


def test_a_frame_out_of_turn_is_refused():
    frames = [seen(stamp * STEP) for stamp in (0, 1, 2, 5, 3, 4, 6, 7)]
    assert [time is None for time in play(frames)] == [False] * 4 + [True, True, False, False]


def test_a_clock_that_steps_back_all_the_time_is_not_believed():
    rng = np.random.default_rng(0)
    frames = [seen(float(stamp)) for stamp in rng.uniform(0, 100, 600)]
    times = play(frames)
    assert None not in times[100:]


def test_a_clock_that_stands_still_is_not_believed():
    times = play([seen(7.0, content=bytes([index])) for index in range(200)])
    assert None not in times
    np.testing.assert_allclose(np.diff(times)[40:], STEP, atol=1e-9)


def test_a_coarse_clock_neither_hurries_nor_lags():
    stamps = np.float32(5e5 + np.arange(600) * STEP)  # to a 32nd of a second
    times = play([seen(float(stamp), content=str(n).encode()) for n, stamp in enumerate(stamps)])
    np.testing.assert_allclose(times, np.arange(600) * STEP, atol=1 / 16)


def test_another_sender_waits_until_the_first_is_silent():
    order = Order()
    assert order.place(seen(1.0), "host", 10.0) == 0.0
    assert order.place(seen(2.0, "another phone"), "host", 10.1) is None
    assert not order.admits("another host", 10.1)
    assert order.place(seen(2.0), "another host", 10.1) is None
    later = 10.1 + SILENCE
    assert order.admits("another host", later)
    assert order.place(seen(2.0), "another host", later) == pytest.approx(0.1 + SILENCE)
    assert not order.admits("host", later + 0.1)


def test_a_recording_that_begins_again_is_heard_after_a_short_silence():
    frames = [seen(index * STEP) for index in range(100)]
    order = Order()
    play(frames, order, begin=0.0)
    again = play(frames, order, begin=100 * STEP)
    refused = sum(time is None for time in again)
    assert 0 < refused < 2 * SILENCE / STEP
    placed = [time for time in again if time is not None]
    np.testing.assert_allclose(np.diff(placed), STEP, atol=1e-9)


def test_after_a_pause_of_the_network_time_goes_on_as_the_senders_did():
    order = Order()
    frames = [seen(index * STEP) for index in range(100)]
    times = play(frames[:40], order, begin=0.0)
    delayed = play(frames[40:], order, begin=40 * STEP + 2 * SILENCE, every=1e-5)
    np.testing.assert_allclose(times + delayed, np.arange(100) * STEP, atol=1e-9)
    assert set(play(frames, order, begin=41 * STEP + 2 * SILENCE, every=1e-5)) == {None}


def test_a_clock_that_is_set_does_not_tear_time_apart():
    frames = [seen(stamp) for stamp in (0.0, STEP, 3600.0, 3600.0 + STEP)]
    np.testing.assert_allclose(play(frames), np.arange(4) * STEP, atol=1e-9)

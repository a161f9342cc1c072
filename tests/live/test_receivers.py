import logging
import socket
import time
from dataclasses import replace

import numpy as np
import pytest

from facert.data.names import ARKIT_NAMES
from facert.errors import InputError
from facert.live.endpoints import Address, open_receiver
from facert.live.frames import frame_pattern
from facert.live.livelink_packets import PACKET_NAMES
from facert.live.osc import message
from facert.live.receivers import LOGGED, TakeReceiver


def test_frames_come_in_order_with_their_values_and_times(receiver, phone, collect):
    for number in range(5):
        phone.send(phone.packet(number, value=number / 10))
    frames = collect(5)
    np.testing.assert_allclose([frame.time for frame in frames], np.arange(5) / 60, atol=1e-4)
    for number, frame in enumerate(frames):
        np.testing.assert_allclose(frame.values, number / 10, atol=1e-7)
    assert receiver.pattern.source.names == PACKET_NAMES
    assert receiver.counters.received == 5


def test_understanding_a_packet_once_more_changes_nothing(receiver, phone, collect):
    receiver.rehearse()  # there was none
    for number in range(4):
        phone.send(phone.packet(number, value=number / 10))
        (frame,) = collect(1)
        receiver.rehearse(), receiver.rehearse()
        np.testing.assert_allclose(frame.values, number / 10, atol=1e-7)
    assert (receiver.counters.received, receiver.counters.late) == (4, 0)


def test_malformed_truncated_and_repeated_packets_change_nothing_but_a_counter(
    receiver, phone, collect
):
    rng = np.random.default_rng(0)
    true = [phone.packet(number, value=number / 100) for number in range(40)]
    for raw in true:
        phone.send(raw)
        phone.send(raw)
        phone.send(true[0])
        phone.send(raw[: rng.integers(1, len(raw) - 250)])
        phone.send(rng.bytes(rng.integers(0, 400)))
    frames = collect(40)
    np.testing.assert_allclose(
        [frame.values[0] for frame in frames], np.arange(40) / 100, atol=1e-7
    )
    while receiver.counters.bad < 80 or receiver.counters.late < 80:
        assert not receiver.wait(5.0)
    assert (receiver.counters.bad, receiver.counters.late) == (80, 80)
    assert receiver.counters.received == 40


def test_the_first_bad_packets_are_told_about_with_reason_and_sender(receiver, phone, caplog):
    caplog.set_level(logging.DEBUG, "facert")
    for _ in range(100):
        phone.send(b"no face")
    while receiver.counters.bad < 100:
        receiver.wait(5.0)
    line = "bad packet of 7 bytes from 127.0.0.1: not Live Link Face"
    assert caplog.text.count(line) == LOGGED
    assert caplog.text.count("only counted") == 1


def test_a_flood_does_not_keep_the_receiver_from_answering(receiver, phone):
    for _ in range(5000):
        phone.send(b"flood")
    began = time.monotonic()
    assert not receiver.wait(0.1)
    assert time.monotonic() - began < 5.0
    assert 0 < receiver.counters.bad <= 256


def test_a_frame_without_a_face_is_counted_and_passed_over(receiver, phone, collect):
    block = len(phone.packet(0)) - 1 - 4 * len(PACKET_NAMES)
    phone.send(phone.packet(0)[:block])
    phone.send(phone.packet(1))
    (frame,) = collect(1)
    assert np.isfinite(frame.values).all()
    assert (receiver.counters.hidden, receiver.counters.received) == (1, 1)


def test_the_timecode_is_that_of_the_first_frame(receiver, phone, collect):
    phone.send(phone.packet(0))
    collect(1)
    hours, minutes, seconds, _ = receiver.start_timecode.split(":")
    of_day = int(hours) * 3600 + int(minutes) * 60 + int(seconds)
    now = time.localtime()
    later = now.tm_hour * 3600 + now.tm_min * 60 + now.tm_sec - of_day
    assert later % 86400 < 60


def test_nothing_from_other_machines_is_listened_to_unless_asked_for(receiver):
    assert receiver._socket.getsockname()[0] == "127.0.0.1"
    everywhere = open_receiver(Address("osc", "", 0), "0.0.0.0", frame_pattern(ARKIT_NAMES))
    assert everywhere._socket.getsockname()[0] == "0.0.0.0"
    everywhere.close()


def test_a_port_that_is_taken_is_an_error_with_advice(receiver):
    with pytest.raises(InputError, match=f"port {receiver.port}.*choose another port"):
        open_receiver(Address("osc", "", receiver.port), "127.0.0.1", frame_pattern(ARKIT_NAMES))


def test_a_model_of_markers_cannot_be_driven_by_a_phone():
    for kind in ("livelink", "ifacialmocap"):
        with pytest.raises(InputError, match="markers"):
            open_receiver(
                Address(kind, "", 0), "127.0.0.1", frame_pattern(["chin", "nose"], "markers")
            )


def test_markers_come_over_osc():
    opened = open_receiver(
        Address("osc", "", 0), "127.0.0.1", frame_pattern(["chin", "nose"], "markers", "cm")
    )
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for raw in (message("/m/nose", 1.0, 2.0, 3.0), message("/m/frame", 0.0)):
            sender.sendto(raw, ("127.0.0.1", opened.port))
    found = opened.wait(20.0) or opened.wait(20.0)
    np.testing.assert_array_equal(found[0].values, [[np.nan] * 3, [1.0, 2.0, 3.0]])
    assert opened.pattern.units == "cm"
    opened.close()


def test_a_take_is_played_at_the_times_of_its_frames(make_take):
    take = make_take(frames=20)
    player = TakeReceiver(take, speed=5.0)
    frames, began = [], time.perf_counter()
    while not player.finished:
        frames += player.wait(1.0)
    np.testing.assert_allclose([frame.time for frame in frames], take.time)
    np.testing.assert_array_equal([frame.values for frame in frames], take.source.values)
    assert (np.array([frame.arrived for frame in frames]) >= began + take.time / 5.0).all()
    assert player.fps == take.fps


def test_frames_of_a_take_that_saw_nothing_are_passed_over(make_take):
    take = make_take(frames=10)
    values = take.source.values.copy()
    values[3:6] = np.nan
    player = TakeReceiver(replace(take, source=replace(take.source, values=values)), speed=100.0)
    frames = []
    while not player.finished:
        frames += player.wait(1.0)
    assert len(frames) == 7
    assert (player.counters.received, player.counters.hidden) == (7, 3)


NAMES = ("jawOpen", "browUp", "mouthSmile")


@pytest.fixture
def osc(monkeypatch):
    """A receiver of OSC, and a socket that sends to it."""
    monkeypatch.setattr("facert.live.order.SILENCE", 0.0)
    opened = open_receiver(Address("osc", "", 0), "127.0.0.1", frame_pattern(NAMES))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.connect(("127.0.0.1", opened.port))
        yield opened, sender
    opened.close()


def next_frame(opened, sender, *messages):
    """The frame that these messages complete, if any."""
    for raw in (*messages, message("/x/frame")):
        sender.send(raw)
    before, frames = sum(vars(opened.counters).values()), []
    while sum(vars(opened.counters).values()) == before:
        frames += opened.wait(5.0)
    return frames[0] if frames else None


def test_values_are_held_while_packets_arrive_and_not_over_a_silence(osc, monkeypatch):
    opened, sender = osc
    first = next_frame(opened, sender, message("/x/jawOpen", 0.5), message("/x/browUp", 0.25))
    time.sleep(0.6)  # a pause of this process is no silence
    second = next_frame(opened, sender, message("/x/browUp", 0.75))
    np.testing.assert_array_equal(first.values, [0.5, 0.25, np.nan])
    np.testing.assert_array_equal(second.values, [0.5, 0.75, np.nan])
    monkeypatch.setattr("facert.live.receivers.FORGOTTEN", 0.1)
    assert not opened.wait(0.15)
    assert next_frame(opened, sender) is None
    assert opened.counters.hidden == 1
    third = next_frame(opened, sender, message("/x/mouthSmile", 1.0))
    np.testing.assert_array_equal(third.values, [np.nan, np.nan, 1.0])


def test_lost_packets_leave_the_values_that_came_last(osc):
    opened, sender = osc
    rng = np.random.default_rng(0)
    last, held = np.full(3, np.nan), np.full(3, np.nan)
    for _ in range(50):
        row = rng.integers(0, 3, 3) / 2
        sent = []
        for k in np.flatnonzero(row != last):
            if rng.random() < 0.7:
                sent.append(message(f"/x/{NAMES[k]}", float(row[k])))
                held[k] = row[k]
        last = row
        frame = next_frame(opened, sender, *sent)
        if frame is not None:
            np.testing.assert_array_equal(frame.values, held)
    assert np.isfinite(held).all()


def test_frames_under_unknown_names_are_counted_apart(osc, caplog):
    opened, sender = osc
    assert next_frame(opened, sender, message("/x/other", 0.5), message("/x/more", 0.5)) is None
    assert (opened.counters.unknown, opened.counters.hidden) == (1, 0)
    assert "names unknown: other, more; the model knows jawOpen, browUp, mouthSmile" in caplog.text

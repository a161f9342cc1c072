import socket

import numpy as np
import pytest

from facert.live.endpoints import Address, open_sender
from facert.live.frames import Counters, Frame
from facert.live.osc import parse
from facert.retarget.stream import Streamed


@pytest.fixture
def listener():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as bound:
        bound.bind(("127.0.0.1", 0))
        bound.settimeout(20.0)
        yield bound


def send(port, *poses, names=("jaw", "brow")):
    counters = Counters()
    sender = open_sender(Address("osc", "127.0.0.1", port), names, counters)
    for number, params in enumerate(poses):
        values = np.asarray(params, dtype=float)
        pose = Streamed(values, lambda: (None, np.zeros(0)))
        sender.rehearse(Frame(number / 60, -values, 0.0), pose)
        sender.send(Frame(number / 60, values, 0.0), pose)
    sender.close()
    return counters


def test_each_pose_arrives_with_its_time(listener):
    send(listener.getsockname()[1], [0.5, 0.25], [1.0, 0.0])
    for time, pose in ((0.0, (0.5, 0.25)), (1 / 60, (1.0, 0.0))):
        found = {one.address: one.numbers[0] for one in parse(listener.recv(4096))}
        expected = {"/facert/jaw": pose[0], "/facert/brow": pose[1], "/facert/frame": time}
        assert found == pytest.approx(expected)


def test_that_nobody_listens_is_counted_and_reported_once(listener, caplog):
    port = listener.getsockname()[1]
    listener.close()
    counters = send(port, *[[0.5, 0.5]] * 20)
    assert counters.unsent == 0
    assert 0 < counters.refused < 20
    assert caplog.text.count(f"nobody listens on 127.0.0.1:{port}") == 1


def test_who_listens_later_misses_nothing_from_then_on(listener):
    address = listener.getsockname()
    listener.close()
    sender = open_sender(Address("osc", *address), ("jaw",), Counters())
    pose = Streamed(np.zeros(1), lambda: (None, np.zeros(0)))
    sender.send(Frame(0.0, np.zeros(1), 0.0), pose)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as late:
        late.bind(address)
        late.settimeout(20.0)
        for time in (1.0, 2.0):
            sender.send(Frame(time, np.zeros(1), 0.0), pose)
        for time in (1.0, 2.0):
            assert parse(late.recv(4096))[-1].numbers == (time,)
    sender.close()


def test_what_the_system_will_not_send_is_counted_and_reported_once(caplog):
    names = [f"{index}{'x' * 70_000}" for index in range(2)]
    assert send(9, [0.0, 0.0], [1.0, 1.0], names=names).unsent == 4
    assert caplog.text.count("are lost") == 1

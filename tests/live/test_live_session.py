import socket

import numpy as np
import pytest
from pylivelinkface import FaceBlendShape, PyLiveLinkFace
from pythonosc.udp_client import SimpleUDPClient

from facert.data.names import ARKIT_SHAPES
from facert.live.endpoints import Address, open_receiver, open_sender
from facert.live.frames import frame_pattern
from facert.live.loop import Limits, LiveSession
from facert.retarget.stream import Streamed


@pytest.fixture
def engine():
    """A socket that poses are sent to."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as bound:
        bound.bind(("127.0.0.1", 0))
        bound.settimeout(20.0)
        yield bound


def copied(frame):
    """The pose of a character that has the actor's own controls."""
    return Streamed(np.nan_to_num(frame.values), lambda: (None, frame.values))


def test_from_a_performer_of_one_library_to_an_engine_of_another(engine, plain):
    receiver = open_receiver(Address("vmc", "", 0), "127.0.0.1", frame_pattern(ARKIT_SHAPES))
    to = Address("livelink", "127.0.0.1", engine.getsockname()[1])
    sender = open_sender(to, ARKIT_SHAPES, receiver.counters)
    session = LiveSession(receiver, plain(copied), [sender])
    with SimpleUDPClient("127.0.0.1", receiver.port) as client:
        for number in range(1, 6):
            client.send_message("/VMC/Ext/Blend/Val", ["JawOpen", number / 10])
            client.send_message("/VMC/Ext/Blend/Val", ["mouth_left", -number / 20])
            client.send_message("/VMC/Ext/Blend/Apply", [])
            session.run(Limits(frames=number, seconds=20.0))
            seen, face = PyLiveLinkFace.decode(engine.recv(2000))
            assert seen
            assert face.get_blendshape(FaceBlendShape.JawOpen) == pytest.approx(number / 10)
            assert face.get_blendshape(FaceBlendShape.MouthLeft) == pytest.approx(-number / 20)
            assert face.get_blendshape(FaceBlendShape.MouthRight) == 0.0
    assert session.counters.mapped == 5
    receiver.close(), sender.close()


def test_sessions_can_be_chained(receiver, phone, engine, plain):
    """Live Link to OSC, OSC to VMC: nothing is lost and time goes on as the phone's did."""
    names = receiver.pattern.source.names
    second = open_receiver(Address("osc", "", 0), "127.0.0.1", frame_pattern(names))
    middle = open_sender(Address("osc", "127.0.0.1", second.port), names, receiver.counters)
    to = Address("livelink", "127.0.0.1", engine.getsockname()[1])
    last = open_sender(to, names, second.counters)
    for number in range(10):
        phone.send(phone.packet(number, value=number / 10))
    LiveSession(receiver, plain(copied), [middle]).run(Limits(frames=10, seconds=20.0))
    LiveSession(second, plain(copied), [last]).run(Limits(frames=10, seconds=20.0))
    stamps = []
    for number in range(10):
        _, face = PyLiveLinkFace.decode(engine.recv(2000))
        assert face.get_blendshape(FaceBlendShape.BrowInnerUp) == pytest.approx(number / 10)
        stamps.append(face._frames)
    np.testing.assert_allclose(np.diff(stamps), 1.0, atol=1.0)
    for opened in (second, middle, last):
        opened.close()

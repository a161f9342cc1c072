"""Streams that hold anything: counters add up, poses are finite, recordings open."""

from __future__ import annotations

import socket
from contextlib import closing

import numpy as np
import pytest
from pythonosc.osc_bundle_builder import IMMEDIATELY, OscBundleBuilder
from pythonosc.osc_message_builder import OscMessageBuilder

from facert import Controls, Settings, Source, Take, train
from facert.io.formats import read_take_file
from facert.live.endpoints import Address, open_receiver
from facert.live.frames import frame_pattern
from facert.live.live_model import LiveModel, ModelFile
from facert.live.loop import Limits, LiveSession
from facert.live.recording import Recordings
from facert.retarget.options import RetargetOptions

RNG = np.random.default_rng(0)
NAMES = ("jawOpen", "mouthClose", "cheekPuff")
VALUES = (0.5, 1e38, -1e38, np.inf, -np.inf, np.nan, 1e-45, 0.0)
FRAMES = 240


def bundle(values) -> bytes:
    """A datagram that sets all weights and applies them."""
    made = OscBundleBuilder(IMMEDIATELY)
    for name, value in zip(NAMES, values, strict=True):
        message = OscMessageBuilder("/VMC/Ext/Blend/Val")
        message.add_arg(name)
        message.add_arg(float(value), "f")
        made.add_content(message.build())
    made.add_content(OscMessageBuilder("/VMC/Ext/Blend/Apply").build())
    return made.build().dgram


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    weights = RNG.random((40, len(NAMES)))
    params = RNG.random((40, 2))
    take = Take(np.arange(40) / 30, Source(weights, NAMES), Controls(("a", "b")), params, fps=30)
    path = tmp_path_factory.mktemp("model") / "model.safetensors"
    trained = train(take, Settings(method="ridge"))
    trained.save(path)
    return path, trained


def test_a_stream_of_absurd_values_and_garbage_is_counted_and_recorded(model, tmp_path):
    path, retargeter = model
    pattern = frame_pattern(NAMES)
    with (
        closing(open_receiver(Address("vmc", "127.0.0.1", 0), "127.0.0.1", pattern)) as receiver,
        closing(Recordings(pattern, NAMES, retargeter.controls, overwrite=False)) as recordings,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as phone,
        LiveModel(
            ModelFile(path), retargeter, pattern, None, lambda _: RetargetOptions()
        ) as mapper,
    ):
        poses, source = recordings.poses(tmp_path / "out.h5"), recordings.source(tmp_path / "in.h5")
        session = LiveSession(receiver, mapper, [], [poses], source)
        phone.connect(("127.0.0.1", receiver.port))
        for _ in range(FRAMES):
            whole = bundle(RNG.choice(VALUES, len(NAMES)))
            phone.send(whole)
            phone.send(whole[: int(RNG.integers(1, len(whole)))])
            phone.send(RNG.bytes(60))
            session.run(Limits(seconds=0.002))
        session.run(Limits(seconds=0.2))
        recordings.write("")
        counters = session.counters
    assert counters.received == counters.mapped + counters.dropped + counters.failed
    assert counters.mapped > 10
    assert counters.bad >= FRAMES
    assert counters.received <= FRAMES
    taken = read_take_file(tmp_path / "out.h5")
    assert np.isfinite(taken.params).all()
    assert len(taken) == counters.mapped
    assert len(read_take_file(tmp_path / "in.h5")) == counters.received

"""Sessions in this process, and between processes with other libraries at both ends."""

from __future__ import annotations

import json
import os
import re
import signal
import socket
import subprocess
import sys
import threading
import time
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pylivelinkface import FaceBlendShape, PyLiveLinkFace
from pythonosc.dispatcher import Dispatcher
from pythonosc.osc_bundle_builder import IMMEDIATELY, OscBundleBuilder
from pythonosc.osc_message_builder import OscMessageBuilder
from pythonosc.osc_server import BlockingOSCUDPServer

import facert as api
from facert import Settings
from facert.data.names import ARKIT_SHAPES
from facert.data.take import Controls, Source, Take

PATIENCE = 60.0
SHAPES = ARKIT_SHAPES[:15]


@pytest.fixture(scope="module")
def take(make_take):
    """Tracked weights of a phone, and a character."""
    made = make_take()
    weights = 0.5 + 0.1 * made.source.matrix[:, :15]
    return replace(
        made,
        source=Source(weights, SHAPES),
        units="",
        controls=Controls(["jawOpen", "mouthSmileLeft", "browInnerUp", "cheekPuff"]),
    )


@pytest.fixture(scope="module")
def files(take, tmp_path_factory):
    """The take and a model of it."""
    folder = tmp_path_factory.mktemp("live")
    api.write_take(take, folder / "take.h5")
    api.train(take, Settings(method="ridge")).save(folder / "model.safetensors")
    return folder / "take.h5", folder / "model.safetensors"


def test_a_take_is_played_recorded_and_retargeted_as_in_a_stream(facert, files, take, tmp_path):
    path, model = files
    done = facert(
        "live", "--in", f"take:{path}", "-m", model, "--speed", 4,
        "--out", f"h5:{tmp_path / 'out.h5'}", "--out", f"csv:{tmp_path / 'out.livelink.csv'}",
        "--record", tmp_path / "in.h5",
    )  # fmt: skip
    assert done.code == 0, done.err
    result, stream = api.read_take(tmp_path / "out.h5"), api.load(model).stream(SHAPES, take.fps)
    mapped = np.rint(result.time * take.fps).astype(int)  # all, if the machine is not too busy
    expected = [stream.step(values).params for values in take.source.values[mapped]]
    np.testing.assert_allclose(result.params, expected, atol=1e-12)
    assert result.controls.names == take.controls.names
    received = api.read_take(tmp_path / "in.h5")
    np.testing.assert_array_equal(received.source.values, take.source.values)
    phone = api.read_take(tmp_path / "out.livelink.csv")
    np.testing.assert_allclose(
        phone.source.values[:, phone.source.names.index("jawOpen")], result.params[:, 0], atol=1e-9
    )
    assert f"{len(take)} received" in done.out
    assert "frames/s, latency" in done.out
    assert f"wrote {tmp_path / 'in.h5'}" in done.out


def test_the_first_seconds_may_show_the_actor_at_rest(facert, files, take, tmp_path):
    """A tracker that is off by a tenth, played from a long rest in the model's neutral pose."""
    _, model = files
    neutral = api.load(model).neutral
    values = np.vstack([np.tile(neutral, (30, 1)), take.source.values]) + 0.1
    time = np.arange(len(values)) / take.fps
    shifted = Take(time, Source(values, SHAPES), fps=take.fps)
    api.write_take(shifted, tmp_path / "shifted.h5")
    done = facert(
        "live", "--in", f"take:{tmp_path / 'shifted.h5'}", "-m", model, "--speed", 8,
        "--out", f"h5:{tmp_path / 'out.h5'}", "--neutral", 0.5,
    )  # fmt: skip
    assert done.code == 0, done.err
    assert "rests" in done.err
    assert "calibrated" in done.err
    result = api.read_take(tmp_path / "out.h5")
    mapped = np.rint(result.time * take.fps).astype(int) - 30
    later = mapped >= 10
    plain = api.load(model).retarget(take, "online").params[mapped[later]]
    assert np.abs(result.params[later] - plain).mean() < 0.5 * np.abs(plain).mean()


def test_a_session_that_ends_before_the_actor_at_rest_is_known_warns(facert, files, tmp_path):
    path, model = files
    done = facert(
        "live", "--in", f"take:{path}", "-m", model, "--speed", 20, "--neutral", 20,
        "--out", f"h5:{tmp_path / 'out.h5'}", "--frames", 3,
    )  # fmt: skip
    assert done.code == 0, done.err
    assert "no pose is calibrated" in done.err
    assert (tmp_path / "out.h5").exists()


def test_its_own_input_is_refused_as_an_output(facert, files, tmp_path):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    done = facert("live", "-m", files[1], "--in", f"vmc:{port}", "--out", f"osc:127.0.0.1:{port}")
    assert done.code == 3
    assert "where facert itself listens" in done.err


def test_it_logs_where_poses_go(facert, files):
    done = facert("live", "--in", "livelink:0", "-m", files[1], "--seconds", 0.1,
                  "--out", "osc", "--out", "vmc:localhost")  # fmt: skip
    assert "sends osc to 127.0.0.1:9000" in done.err
    assert "sends vmc to localhost:39539" in done.err


def test_a_session_leaves_the_priority_of_its_process_as_it_was(facert, files):
    before = os.getpriority(os.PRIO_PROCESS, 0)
    done = facert("live", "--in", f"take:{files[0]}", "-m", files[1], "--frames", 2, "--out", "vmc")
    assert done.code == 0, done.err
    assert os.getpriority(os.PRIO_PROCESS, 0) == before


def test_the_summary_is_there_for_programs(facert, files):
    path, model = files
    done = facert("live", "--in", f"take:{path}", "-m", model, "--frames", 5, "--speed", 20,
                  "--out", "vmc", "--json")  # fmt: skip
    summary = json.loads(done.out)
    assert (summary["mapped"], summary["bad"], summary["files"]) == (5, 0, [])
    assert 0 < summary["latency_ms"]["median"] <= summary["latency_ms"]["p99"]


def test_without_a_sender_it_waits_and_logs_that(facert, files):
    done = facert("live", "--in", "livelink:0", "-m", files[1], "--out", "vmc", "--seconds", 0.1)
    assert done.code == 0
    assert re.search(r"listens for livelink on 127\.0\.0\.1:\d+ \(this machine alone", done.err)
    assert "0 received" in done.out


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["--in", "phone", "--out", "vmc"], 2, "one of livelink"),
        (["--in", "livelink:0", "--out", "vmc:99999"], 2, "no port 99999"),
        (["--in", "livelink:0", "--out", "csv:out.h5"], 2, "expected csv:FILE.csv"),
        (["--in", "take:none.h5", "--out", "vmc"], 3, "none.h5"),
        (["--in", "livelink:0", "--out", "vmc:nowhere.invalid"], 3, "nowhere.invalid"),
        (["--in", "livelink:0", "--out", "vmc", "--record", "x.txt"], 3, "x.txt"),
        (["--in", "livelink:0", "--listen", "nowhere.invalid", "--out", "vmc"], 3, "nowhere"),
    ],
)
def test_what_cannot_work_is_refused_before_the_show(facert, files, arguments, code, message):
    done = facert("live", "-m", files[1], *arguments)
    assert done.code == code
    assert message in " ".join(done.err.replace("│", " ").split())


def test_an_output_that_exists_is_refused(facert, files, tmp_path):
    before = files[0].read_bytes()
    (tmp_path / "out.h5").write_bytes(before)
    done = facert(
        "live", "-m", files[1], "--in", "livelink:0", "--out", f"h5:{tmp_path / 'out.h5'}"
    )
    assert done.code == 2
    assert (tmp_path / "out.h5").read_bytes() == before


@contextmanager
def session(*arguments):
    """A session in another process that listens, and the port where."""
    command = [Path(sys.executable).with_name("facert"), "live", *map(str, arguments)]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        try:
            port = None
            while port is None:
                line = process.stderr.readline()
                assert line, "the session ended before it listened"
                port = re.search(r"listens for .* on .*:(\d+)", line)
            yield process, int(port[1])
        finally:
            process.kill()


def summary(process):
    """Stop a session as Ctrl-C does, and read its summary."""
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=PATIENCE)
    assert process.returncode == 0, err
    return json.loads(out)


@contextmanager
def marionette():
    """A VMC receiver made of another library: its port, and the poses that it applied."""
    poses, pose = [], {}
    dispatcher = Dispatcher()
    dispatcher.map("/VMC/Ext/Blend/Val", lambda _, name, value: pose.update({name: value}))
    dispatcher.map("/VMC/Ext/Blend/Apply", lambda _: poses.append(dict(pose)))
    with BlockingOSCUDPServer(("127.0.0.1", 0), dispatcher) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield server.server_address[1], poses
        server.shutdown()
        thread.join()


@pytest.mark.slow
def test_from_a_phone_made_of_another_library_to_a_character_in_a_third(files, take, tmp_path):
    phone, rng = PyLiveLinkFace(), np.random.default_rng(0)
    recorded = tmp_path / "in.h5"
    with marionette() as (to, poses), session(
        "--in", "livelink:0", "--out", f"vmc:127.0.0.1:{to}", "-m", files[1],
        "--record", recorded, "--json",
    ) as (process, port), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:  # fmt: skip
        sent, end = [], time.monotonic() + PATIENCE
        while len(poses) < 40:
            assert time.monotonic() < end
            weights = take.source.values[len(sent) % len(take)] + 1e-4 * rng.random()
            for name, value in zip(SHAPES, weights, strict=True):
                shape = FaceBlendShape[name[0].upper() + name[1:]]
                phone.set_blendshape(shape, float(value), no_filter=True)
            for raw in (phone.encode(), rng.bytes(200), phone.encode()[:100]):
                sender.sendto(raw, ("127.0.0.1", port))
            sent.append(weights)
            time.sleep(0.005)
        facts = summary(process)
    assert facts["bad"] >= 40
    assert facts["mapped"] == len(poses) <= facts["received"] <= len(sent)
    assert set(poses[-1]) == set(take.controls.names)
    assert np.isfinite([list(pose.values()) for pose in poses]).all()
    found = api.read_take(recorded)
    columns = [found.source.names.index(name) for name in SHAPES]
    distance = np.abs(found.source.values[:, None, columns] - np.array(sent)).max(axis=2)
    assert distance.min(axis=1).max() < 1e-6


def vmc_frames(weights, names, every=False):
    """Datagrams of a performer made of another library that sends what changed, or everything."""
    last = [None] * len(names)
    for row in weights:
        bundle = OscBundleBuilder(IMMEDIATELY)
        for name, value, before in zip(names, row, last, strict=True):
            if every or value != before:
                one = OscMessageBuilder("/VMC/Ext/Blend/Val")
                one.add_arg(name)
                one.add_arg(float(value))
                bundle.add_content(one.build())
        bundle.add_content(OscMessageBuilder("/VMC/Ext/Blend/Apply").build())
        last = row
        yield bundle.build().dgram


@pytest.mark.slow
@pytest.mark.parametrize("prefix", ["", "Face1:blendShape1."])
def test_what_a_performer_does_not_send_again_stays_as_it_was(files, take, tmp_path, prefix):
    weights = np.round(take.source.values[:40], 1)
    weights[20:] = weights[20]  # the face holds still: nothing but the end of each frame is sent
    recorded = tmp_path / "in.h5"
    with session(
        "--in", "vmc:0", "--out", f"csv:{tmp_path / 'out.csv'}", "-m", files[1],
        "--record", recorded, "--json",
    ) as (process, port), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:  # fmt: skip
        for raw in vmc_frames(weights, [f"{prefix}{name}" for name in SHAPES]):
            sender.sendto(raw, ("127.0.0.1", port))
            time.sleep(0.005)
        time.sleep(0.2)
        facts = summary(process)
    assert (facts["received"], facts["hidden"], facts["unknown"], facts["bad"]) == (40, 0, 0, 0)
    found = api.read_take(recorded).source
    assert found.names == SHAPES
    np.testing.assert_allclose(found.values, weights, atol=1e-6)


@pytest.mark.slow
def test_names_that_the_model_does_not_know_are_reported(files):
    names = [f"wobble{letter}" for letter in "ABCDEFGH"]
    with session(
        "--in", "vmc:0", "--out", "vmc", "-m", files[1], "--frames", 5
    ) as (process, port), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:  # fmt: skip
        for raw in vmc_frames(np.eye(8), names):
            sender.sendto(raw, ("127.0.0.1", port))
        time.sleep(0.3)
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=PATIENCE)
    expected = "names unknown: wobbleA, wobbleB, wobbleC, wobbleD, wobbleE and 3 more"
    assert err.count(expected) == 1
    assert "8 with unknown names" in out
    assert "without a face" not in out


@pytest.mark.slow
def test_what_a_session_recorded_survives_its_kill_and_others_do_not_write_there(
    facert, files, tmp_path
):
    path, model = files
    record, out = tmp_path / "in.h5", tmp_path / "out.csv"
    arguments = ("--out", f"csv:{out}", "--record", record, "-m", model)
    with session("--in", "livelink:0", *arguments) as (process, port), socket.socket(
        socket.AF_INET, socket.SOCK_DGRAM
    ) as sender:  # fmt: skip
        second = facert("live", "--in", f"take:{path}", *arguments, "--overwrite")
        phone, going_on = PyLiveLinkFace(), tmp_path / "in.h5.recording"
        sizes, end = [], time.monotonic() + PATIENCE
        while len(set(sizes)) < 20:  # so many frames are recorded
            assert time.monotonic() < end
            phone.set_blendshape(FaceBlendShape.JawOpen, time.monotonic() % 1, no_filter=True)
            sender.sendto(phone.encode(), ("127.0.0.1", port))
            time.sleep(0.02)
            sizes.append(going_on.stat().st_size)
        process.kill()
    assert (second.code, len(second.err.splitlines())) == (3, 1)
    assert f"process {process.pid} is writing" in second.err
    assert {one.suffix for one in tmp_path.iterdir()} == {".recording", ".lock"}
    assert facert("convert", going_on, record).code == 0
    assert len(api.read_take(record)) >= 19  # an empty file was seen as well

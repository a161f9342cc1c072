"""Clocks, counters, confidences and flags among weights are found by name and by shape."""

from __future__ import annotations

import logging

import numpy as np
import pytest

from facert.data.column_names import Role, names_face, role_of_name, unit_of_name
from facert.data.columns import learnable, require_there, warn_of_clocks, weight_columns
from facert.data.names import ARKIT_NAMES
from facert.data.take import Source, Take
from facert.errors import InputError

FRAMES = 60
TIME = np.arange(FRAMES) / 30
rng = np.random.default_rng(0)
WEIGHTS = rng.uniform(size=(FRAMES, 3))
JITTER = rng.uniform(-0.002, 0.002, FRAMES)


@pytest.mark.parametrize(
    ("role", "names"),
    [
        (Role.CLOCK, "timestamp timestamp_ms time_s timeCode TimestampUS unix-time epoch_ms ticks"),
        (Role.CLOCK, "deviceTimestamp systemTime time[ms] Time(µs) elapsed_sec datetime ts_ms ms"),
        (Role.FRAME, "frame frame_id frameNumber Frame# FrameIndex video_frame frameno"),
        (Role.COUNTER, "index idx row Unnamed:_0 seq sequence_number id rowid packet_id"),
        (Role.SUBJECT, "face_id faceId person_id"),
        (Role.FLAG, "success tracked isTracked valid face_detected has_face BlendShapeCount"),
        (Role.FLAG, "trackingState num_faces"),
        (Role.ABSENCE, "face_lost no_face missing"),
        (Role.CONFIDENCE, "confidence score quality tracking_confidence leftEyeConfidence"),
        (Role.RATE, "fps dt deltaTime latency_ms frame_rate"),
        (None, "jawOpen mouthTime timer ctrl_7 Key_1 shape1 M00 m blendShape1 a A01 tx frameless"),
        (
            None,
            "eyeFrame clockwise rowdy scorn idol mouthFrameOpen mouth_quality _neutral Zähne 口",
        ),
    ],
)
def test_what_a_name_means(role, names):
    found = {name: role_of_name(name.replace("_0", " 0")) for name in names.split()}
    assert found == dict.fromkeys(names.split(), role)


def test_a_name_of_nothing_is_an_index_and_none_of_a_face_is_more():
    assert role_of_name("") is role_of_name("#") is Role.COUNTER
    assert not [name for name in ARKIT_NAMES if role_of_name(name) or not names_face(name)]
    assert role_of_name("time" * 1000 + "x") is None


@pytest.mark.parametrize(
    ("name", "unit"),
    [("time_s", 1), ("t_ms", 1e-3), ("Time (µs)", 1e-6), ("timestampNs", 1e-9), ("ticks", 1e-7),
     ("timestampms", 1e-3), ("time", None), ("minutes", 60)],
)  # fmt: skip
def test_a_name_may_state_the_unit(name, unit):
    assert unit_of_name(name) == unit


CLOCKS = {
    "milliseconds": np.rint(1000 * TIME),
    "seconds": TIME,
    "late seconds with jitter": 7777 + TIME + JITTER,
    "unix": 1.7e9 + TIME,
    "ticks": 1e7 * TIME,
    "samples of sound": 48000 * TIME,
    "rows": np.arange(FRAMES),
    "rows from 1001": 1001.0 + np.arange(FRAMES),
    "every second row": 2.0 * np.arange(FRAMES),
    "a buffer's number": np.arange(FRAMES) % 10.0,
    "frames of a second": 1 + (7 + np.arange(FRAMES)) % 30.0,
}


def test_clocks_confidences_and_flags_have_names_in_other_languages() -> None:
    words = "Konfidenz confiance_visage 信頼度", "Zeitstempel_ms horodatage 时间", "Gesicht_erkannt"
    for names, role in zip(words, (Role.CONFIDENCE, Role.CLOCK, Role.FLAG), strict=True):
        assert {role_of_name(name) for name in names.split()} == {role}
    assert role_of_name("clip_progress") is Role.COUNTER
    assert not any(map(role_of_name, ("Zeitlupe", "caraFeliz", "cara", "mouthClip")))


@pytest.mark.parametrize("kind", CLOCKS)
def test_a_column_that_rises_like_a_clock_is_none_of_the_weights(kind, caplog):
    caplog.set_level(logging.INFO, "facert")
    values = np.column_stack([WEIGHTS, CLOCKS[kind]])
    found = weight_columns(["a1", "b1", "c1", "extra"], values, TIME)
    np.testing.assert_array_equal(found.columns, [0, 1, 2])
    assert "'extra'" in caplog.text
    assert "--keep" in caplog.text
    kept = weight_columns(["a1", "b1", "c1", "extra"], values, TIME, keep=["ext*"])
    np.testing.assert_array_equal(kept.columns, [0, 1, 2, 3])


HONEST = {
    "jawOpen": np.linspace(0, 1, FRAMES),
    "AU12": np.linspace(0, 5, FRAMES),
    "head_yaw": np.linspace(0, 90, FRAMES),
    "mouth_open_percent": np.rint(np.linspace(0, 100, FRAMES)),
    "eyeBlinkLeft": (rng.uniform(size=FRAMES) > 0.9).astype(float),
    "ramp": np.linspace(0, 1, FRAMES),
    "smirk": (rng.uniform(size=FRAMES) > 0.8).astype(float),
    "steps": np.arange(FRAMES) % 3.0,
    "sawtooth": np.arange(FRAMES) % 10 / 10,
    "slow": 10 * np.sin(TIME),
    "I": np.linspace(0, 1, FRAMES),
    "T": rng.uniform(size=FRAMES),
    "t": np.round(rng.uniform(size=FRAMES)),
    "still": np.zeros(FRAMES),
    "rises": np.cumsum(rng.uniform(size=FRAMES) ** 4),
}


@pytest.mark.parametrize("name", HONEST)
def test_a_weight_that_looks_a_little_like_one_stays(name):
    values = np.column_stack([WEIGHTS, HONEST[name]])
    assert len(weight_columns(["a1", "b1", "c1", name], values, TIME).columns) == 4


def test_one_column_of_two_values_is_a_flag_and_many_are_visemes():
    flags = (rng.uniform(size=(FRAMES, 5)) > 0.7).astype(float)
    found = weight_columns(["a1", "b1", "c1", "on"], np.column_stack([WEIGHTS, flags[:, 0]]), TIME)
    assert found.columns.tolist() == [0, 1, 2]
    assert not found.absent.any()
    visemes = ["MBP", "FV", "TH", "WQ", "rest"]
    assert len(weight_columns(visemes, flags, TIME).columns) == 5
    assert len(weight_columns(["on", "off"], flags[:6, :2], TIME[:6]).columns) == 2


@pytest.mark.parametrize(
    ("name", "here", "gone"),
    [("success", 1, 0), ("BlendShapeCount", 52, 0), ("face_lost", 0, 1), ("confidence", 0.9, 0)],
)
def test_a_flag_hides_the_rows_without_a_face(name, here, gone, caplog):
    caplog.set_level(logging.INFO, "facert")
    flag = np.where(np.arange(FRAMES) < 10, gone, here)
    take = Take(TIME, Source(np.column_stack([flag, WEIGHTS]), [name, "a1", "b1", "c1"]))
    read = learnable(take)
    assert read.source.names == ("a1", "b1", "c1")
    np.testing.assert_array_equal(read.source.valid.all(axis=1), np.arange(FRAMES) >= 10)
    assert f"10 rows without a face by {name!r}" in caplog.text


def test_a_flag_that_denies_every_row_hides_none(caplog):
    values = np.column_stack([np.zeros(FRAMES), WEIGHTS])
    assert not weight_columns(["success", "a1", "b1", "c1"], values, TIME).absent.any()
    assert "no face in any row, by 'success'" in caplog.text


def test_a_tracker_s_number_of_a_face_hides_no_row():
    values = np.column_stack([np.arange(FRAMES) // 30, WEIGHTS])
    assert not weight_columns(["tracking_id", "a1", "b1", "c1"], values, TIME).absent.any()


def test_a_table_without_weights_is_refused():
    with pytest.raises(InputError, match="--keep"):
        weight_columns(["frame", "confidence"], WEIGHTS[:, :2], TIME)
    assert len(weight_columns(["frame", "confidence"], WEIGHTS[:, :2], TIME, ["*"]).columns) == 2


def test_few_poses_have_many_shapes_and_copies_of_their_clock_are_found():
    frames = np.array([3.0, 20, 41, 90, 200])
    values = np.column_stack([[0, 1, 0, 1, 1], np.linspace(0, 1, 5), frames / 30, 1 + frames])
    found = weight_columns(["on", "ramp", "copy", "number"], values, frames, sparse=True)
    assert found.columns.tolist() == [0, 1]


def test_markers_are_no_columns():
    take = Take(TIME, Source(np.tile(np.arange(FRAMES)[:, None, None], (1, 1, 3)), ["time"]))
    assert learnable(take) is take


def test_training_on_such_a_column_is_warned_of_once(caplog):
    names = ["a1", "timestamp_ms", "copy", "jawOpen"]
    values = np.column_stack([WEIGHTS[:, 0], 1000 * TIME, TIME / 60, TIME])
    warn_of_clocks(Take(TIME, Source(values, names)))
    (record,) = caplog.records
    assert "'timestamp_ms' (a clock), 'copy' (a clock)" in record.getMessage()
    assert "jawOpen" not in record.getMessage()


def test_what_is_to_be_kept_must_be_there():
    with pytest.raises(InputError, match="--keep"):
        require_there(["confidence"], ["jawOpen"])


def test_rows_that_two_flags_deny_are_counted_once(caplog):
    caplog.set_level(logging.INFO)
    values = np.random.default_rng(0).random((len(TIME), 3))
    values[:, :2] = 1.0
    values[5:9, :2] = 0.0
    found = weight_columns(["success", "tracked", "jawOpen"], values, TIME)
    assert found.absent.sum() == 4
    assert "4 rows without a face by 'success'" in caplog.text
    assert "by 'tracked'" not in caplog.text

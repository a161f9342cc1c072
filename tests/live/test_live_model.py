import logging
import shutil
import time
from dataclasses import replace

import numpy as np
import pytest

import facert
from facert import Settings
from facert.errors import InputError
from facert.live.frames import Frame, frame_pattern
from facert.live.live_model import LiveModel, ModelFile


@pytest.fixture(scope="module")
def take(make_take):
    return make_take(frames=90)


@pytest.fixture(scope="module")
def models(take, tmp_path_factory):
    """Two models of one character, and one of another."""
    folder = tmp_path_factory.mktemp("models")
    other = replace(take, controls=replace(take.controls, names=("a", "b", "c", "d")))
    for name, data, method in (
        ("first", take, "ridge"),
        ("second", take, "nearest"),
        ("other", other, "ridge"),
    ):
        facert.train(data, Settings(method=method)).save(folder / f"{name}.safetensors")
    return folder


@pytest.fixture
def path(models, tmp_path):
    return shutil.copy(models / "first.safetensors", tmp_path / "model.safetensors")


def opened(path, take, pattern=None, fps=None, rest_seconds=None):
    file = ModelFile(path)
    retargeter = file.load()
    like = frame_pattern(take.source.names, "markers", take.units)
    return LiveModel(file, retargeter, pattern or like, fps or take.fps, None, rest_seconds)


def frames(take):
    return [
        Frame(float(moment), values, 0.0)
        for moment, values in zip(take.time, take.source.values, strict=True)
    ]


def replaced(path, by):
    """Put another file in the place of the model, as a program does that saves."""
    temporary = path.with_suffix(".new")
    shutil.copy(by, temporary)
    temporary.replace(path)


def until(condition):
    """Wait for something that another thread does."""
    end = time.monotonic() + 30.0
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)


def test_poses_are_those_of_a_stream_of_the_retargeter(path, take):
    stream = facert.load(path).stream(take.source.names, take.fps)
    model = opened(path, take)
    for frame in frames(take):
        np.testing.assert_array_equal(model.step(frame).params, stream.step(frame.values).params)


def test_an_unknown_rate_is_measured(path, take):
    known, unknown = opened(path, take), opened(path, take)
    unknown._fps = None
    for frame in frames(take):
        known.step(frame), unknown.step(frame)
    assert unknown._fps == take.fps


def test_a_new_file_is_taken_over_between_two_frames(path, take, models, caplog):
    caplog.set_level(logging.INFO)
    frame = frames(take)[0]
    with opened(path, take) as model:
        before = model.step(frame).params
        replaced(path, models / "second.safetensors")
        until(lambda: "new model is in use" in caplog.text or model.step(frame) is None)
        assert model.retargeter.settings.method == "nearest"
        assert not np.array_equal(model.step(frame).params, before)


@pytest.mark.parametrize(
    ("name", "warning"), [("broken", "the model in use stays"), ("other", "begin again")]
)
def test_a_file_that_is_broken_or_of_other_controls_leaves_the_model_in_use(
    path, take, models, tmp_path, caplog, name, warning
):
    (tmp_path / "broken.safetensors").write_bytes(b"half a model")
    with opened(path, take) as model:
        before = model.retargeter
        folder = models if name == "other" else tmp_path
        replaced(path, folder / f"{name}.safetensors")
        until(lambda: warning in caplog.text)
        model.step(frames(take)[0])
        assert model.retargeter is before


def test_a_file_that_is_gone_leaves_the_model_in_use(path, take):
    with opened(path, take) as model:
        path.unlink()
        assert not ModelFile(path).changed()
        assert np.isfinite(model.step(frames(take)[0]).params).all()


@pytest.mark.parametrize(
    "pattern",
    [
        frame_pattern(["m0", "m1"], "weights"),
        frame_pattern(["chin", "nose"], "markers"),
        frame_pattern(["m0", "m1", "m2", "m3", "m4"], "markers", "inch"),
    ],
)
def test_frames_of_another_kind_set_or_unit_are_refused(path, take, pattern):
    with pytest.raises(InputError):
        opened(path, take, pattern)


def test_a_frame_that_cannot_be_mapped_is_an_error_and_not_a_pose(path, take):
    model = opened(path, take)
    with pytest.raises(InputError):
        model.step(Frame(0.0, np.full(take.source.values.shape[1:], np.inf), 0.0))
    assert np.isfinite(model.step(frames(take)[0]).params).all()


def test_rehearsals_leave_no_trace(path, take):
    rehearsed, plain = opened(path, take), opened(path, take)
    for frame in frames(take):
        pose = rehearsed.rehearse(frame)
        assert np.isfinite(pose.params).all()
        rehearsed.prepare()
        expected = plain.step(frame).params
        np.testing.assert_array_equal(rehearsed.step(frame).params, expected)


def moved(frame, by):
    return replace(frame, values=frame.values + by)


def test_from_the_seconds_of_rest_on_frames_are_calibrated(path, take, caplog):
    """Markers stuck on anew, and the actor rests for half a second in the pose of the model."""
    caplog.set_level(logging.INFO)
    neutral = facert.load(path).neutral.reshape(-1, 3)
    by = np.random.default_rng(0).normal(size=neutral.shape)
    rest = [Frame(number / 30, neutral, 0.0) for number in range(16)]
    show = [replace(frame, time=frame.time + 16 / 30) for frame in frames(take)]
    model, plain = opened(path, take, rest_seconds=0.5), opened(path, take)
    apart = []
    for frame in [*rest, *show]:
        pose = model.step(moved(frame, by)).params
        apart.append(np.abs(pose - plain.step(frame).params).max())
        model.prepare()
        np.testing.assert_allclose(model.rehearse(moved(frame, by)).params.shape, pose.shape)
    assert min(apart[:15]) > 0.05
    assert max(apart[30:]) < 0.01
    assert caplog.text.count("calibrated") == 1


def test_a_new_model_knows_the_actor_at_rest_as_well(path, take, models, caplog):
    caplog.set_level(logging.INFO)
    neutral = facert.load(path).neutral.reshape(-1, 3)
    first, second = Frame(0.0, neutral + 1.0, 0.0), Frame(0.1, neutral + 1.0, 0.0)
    with opened(path, take, rest_seconds=0.05) as model:
        model.step(first), model.step(second), model.prepare()
        replaced(path, models / "second.safetensors")
        until(lambda: model.step(second) and "new model is in use" in caplog.text)
        pose = model.step(second).params
    stream = facert.load(models / "second.safetensors").stream(take.source.names, take.fps)
    np.testing.assert_allclose(pose, stream.step(neutral).params, atol=1e-9)
    assert np.abs(pose - stream.step(neutral + 1.0).params).max() > 0.05


def test_a_new_model_goes_on_at_the_rate_that_was_measured(models, path, take):
    """Also one that was read before the rate was known."""
    like = frame_pattern(take.source.names, "markers", take.units)
    file = ModelFile(path)
    model = LiveModel(file, file.load(), like)
    early = model._prepare(facert.load(models / "second.safetensors"))
    for number, frame in enumerate(frames(take)[:70]):
        model.step(replace(frame, time=number / 120.0))
    model._next = early
    model.step(frames(take)[70])
    assert model.retargeter.settings.method == "nearest"
    assert model._loaded.fps == pytest.approx(120.0)


def test_a_prefix_is_seen_through_and_logged_once(path, take, caplog):
    caplog.set_level(logging.INFO)
    names = [f"Actor1:{name}" for name in take.source.names]
    model = opened(path, take, frame_pattern(names, "markers", take.units))
    expected = facert.load(path).stream(take.source.names, take.fps)
    for frame in frames(take)[:5]:
        np.testing.assert_array_equal(model.step(frame).params, expected.step(frame.values).params)
    assert caplog.text.count("without the prefix 'Actor1:'") == 1

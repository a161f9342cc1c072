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
from facert.live.model import LiveModel, ModelFile


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


def opened(path, take, pattern=None, fps=None):
    file = ModelFile(path)
    retargeter = file.load()
    like = frame_pattern(take.source.names, "markers", take.units)
    return LiveModel(file, retargeter, pattern or like, fps or take.fps)


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
    ("name", "said"), [("broken", "the model in use stays"), ("other", "begin again")]
)
def test_a_file_that_is_broken_or_of_other_controls_leaves_the_model_in_use(
    path, take, models, tmp_path, caplog, name, said
):
    (tmp_path / "broken.safetensors").write_bytes(b"half a model")
    with opened(path, take) as model:
        before = model.retargeter
        folder = models if name == "other" else tmp_path
        replaced(path, folder / f"{name}.safetensors")
        until(lambda: said in caplog.text)
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

"""Weights that are not what the face did, and honest ones that look like these."""

from __future__ import annotations

import numpy as np
import pytest

import facert
from facert.data.take import Controls, Source, Take
from facert.errors import InputError
from facert.preprocess.faults import find_faults, without_faults
from facert.retarget.options import RetargetOptions


def source(weights):
    return Source(weights, [f"w{i}" for i in range(weights.shape[1])])


@pytest.fixture(scope="module")
def weights():
    """Weights (300, 8) between 0.05 and 0.95, with noise."""
    rng, time = np.random.default_rng(0), np.arange(300) / 30.0
    waves = np.sin(2 * np.pi * time[:, None] * rng.uniform(0.2, 0.8, 8) + rng.uniform(0, 6, 8))
    return 0.5 + 0.4 * waves + 0.005 * rng.normal(size=(300, 8))


@pytest.fixture(scope="module")
def as_take(weights):
    """A take of weights, posed in every tenth frame."""

    def make(values):
        params = np.full((300, 2), np.nan)
        params[::10] = weights[::10, :2]
        controls = Controls(("jaw", "smile"))
        return Take(np.arange(300) / 30.0, source(values), controls=controls, params=params)

    return make


@pytest.mark.parametrize("value", [1e9, 1e30, 1e300, -1e15, 37.2, -5.0, 9999.0])
@pytest.mark.parametrize("scale", [1.0, 100.0])
def test_one_absurd_weight_hides_itself(weights, value, scale):
    for frame in (0, 137, 299):
        values = scale * weights
        values[frame, 5] = scale * value
        found = find_faults(source(values)).absurd
        assert found[frame, 5]
        assert found.sum() == 1


@pytest.mark.parametrize("value", [-1.0, -100.0, 9999.0, -9999.0, 999.9])
@pytest.mark.parametrize("share", [0.1, 0.5, 0.9])
def test_what_is_written_for_none_is_hidden_however_often(weights, value, share):
    hit = np.random.default_rng(1).random(300) < share
    values = weights.copy()
    values[hit, 3] = value
    expected = np.zeros(values.shape, dtype=bool)
    expected[hit, 3] = True
    np.testing.assert_array_equal(find_faults(source(values)).any, expected)


def test_percent_angles_and_overshoots_are_honest(weights):
    turn = weights.copy()
    turn[:, 2] = 40.0 * np.sin(np.linspace(0.0, 2.0, 300)) ** 8  # degrees, mostly straight on
    blink = weights.copy()
    blink[:, 4] = 0.0
    blink[100:104, 4] = [0.7, 1.0, 0.9, 0.3]
    single = weights.copy()
    single[:, 0] *= 100.0
    overshoot = weights.copy()
    overshoot[200, 0] = 1.8
    for values in (100.0 * weights, turn, blink, 100.0 * blink, single, overshoot, 255 * weights):
        assert str(find_faults(source(values))) == "none"


@pytest.mark.parametrize("value", [0.0, -1.0, 0.5])
@pytest.mark.parametrize("frames", [slice(120, 150), slice(0, 20), slice(280, 300), slice(90, 91)])
def test_frames_that_are_all_the_same_between_jumps_show_no_face(weights, value, frames):
    values = weights.copy()
    values[frames] = value
    expected = np.zeros(300, dtype=bool)
    expected[frames] = True
    found = find_faults(source(values))
    np.testing.assert_array_equal(found.any.all(axis=1), expected)
    np.testing.assert_array_equal(found.any.any(axis=1), expected)


def test_a_rest_at_zero_is_a_face():
    time = np.arange(300)
    bumps = np.clip(np.sin(2 * np.pi * time / 100.0), 0.0, None)[:, None]
    eased = bumps**2 * [1.0, 0.7, 0.4, 0.9]  # rests at zero half of the time
    linear = np.clip(1.0 - np.abs(time - 60) / 50.0, 0.0, 1.0)[:, None] * [1.0, 0.7, 0.4]
    stepped = np.repeat(np.random.default_rng(0).random((10, 4)), 30, axis=0)
    stepped[90:120] = 0.0
    begins = eased.copy()
    begins[:20] = 0.0
    poses = np.random.default_rng(1).random((40, 6))
    poses[[0, 20]] = 0.0
    mostly = np.zeros((300, 4))
    mostly[100:140] = 0.7
    for values in (eased, linear, stepped, begins, poses, mostly, np.zeros((20, 4))):
        assert str(find_faults(source(values))) == "none"


@pytest.fixture(scope="module")
def tracked():
    """Weights (300, 30) as a tracker gives them: a third often exactly 0, the others never."""
    rng, time = np.random.default_rng(2), np.arange(300) / 30.0
    waves = np.sin(2 * np.pi * time[:, None] * rng.uniform(0.2, 1.0, 30) + rng.uniform(0, 6, 30))
    moving = np.clip(0.05 + 0.2 * waves[:, :10], 0.0, None)
    rest = 0.02 + 0.01 * waves[:, 10:] + 0.001 * rng.random((300, 20))
    rest[150:, 3] += 0.5 * np.sin(np.arange(150) / 24.0) ** 2
    return np.hstack([moving, rest])


@pytest.mark.parametrize("value", [0.0, -1.0, 0.5])
@pytest.mark.parametrize("length", [1, 4, 15])
def test_a_placeholder_is_found_wherever_a_tracker_writes_it(tracked, value, length):
    for first in [*range(0, 301 - length, 23), 300 - length]:
        values = tracked.copy()
        values[first : first + length] = value
        expected = np.zeros(300, dtype=bool)
        expected[first : first + length] = True
        np.testing.assert_array_equal(find_faults(source(values)).blank.all(axis=1), expected)
        values[max(first - 2, 0) : first] = values[first + length : first + length + 2] = np.nan
        np.testing.assert_array_equal(find_faults(source(values)).blank.any(axis=1), expected)


def test_a_rest_of_many_weights_at_zero_is_a_face():
    rng, time = np.random.default_rng(3), np.arange(300)[:, None]
    speed, height = rng.uniform(0.02, 0.06, 24), rng.uniform(0.3, 1.0, 24)
    waves = height * np.abs(np.sin(speed * time))  # all at 0 in the first frame alone
    eased = height * np.sin(speed * time) ** 2
    late = np.vstack([np.zeros((20, 24)), eased[:-20]])
    linear = np.vstack([np.zeros((15, 24)), np.clip(height * time / 40.0, 0.0, 1.0)])
    poses = rng.random((40, 24)) ** 2
    poses[[0, 20]] = 0.0
    stepped = np.repeat(poses, 10, axis=0)
    for values in (waves, eased, late, late[::-1], linear, poses, stepped):
        assert str(find_faults(source(values))) == "none"


def test_frames_without_a_face_are_told_by_their_runs(as_take, weights, caplog):
    values = weights.copy()
    for first in (41, 61, 81, 101, 122, 141, 161):
        values[first : first + 3] = 0.0
    values[122] = weights[122]
    without_faults(as_take(values))
    runs = "(41 to 43, 61 to 63, 81 to 83, 101 to 103, 123 to 124, ...)"
    assert f"all weights in 20 frames {runs} are 0" in caplog.text


def test_a_frame_between_frames_without_a_face_is_not_held(as_take, weights, caplog):
    values = weights.copy()
    values[111:120] = values[121:130] = 0.0
    without_faults(as_take(values))
    assert "all weights in 18 frames (111 to 119, 121 to 129) are 0" in caplog.text
    assert "stay the same" not in caplog.text


def test_a_frame_that_somebody_posed_shows_a_face(weights):
    values = weights.copy()
    values[120:150] = 0.0
    assert find_faults(source(values), np.array([100, 130])).blank.sum() == 0
    assert find_faults(source(values), np.array([100, 160])).blank.sum() == 30 * 8


def test_faults_are_named_with_frame_and_value(as_take, weights, caplog):
    values = weights.copy()
    values[137, 5], values[41:49] = 1e9, 0.0
    left = without_faults(as_take(values)).source
    assert (~left.valid).sum() == 1 + 8 * 8
    assert "w5 at frame 137 is 1e+09: taken as not observed" in caplog.text
    assert "all weights in 8 frames from 41 are 0, coming and going with a jump" in caplog.text


def test_frames_that_repeat_before_a_jump_are_kept_and_named(as_take, weights, caplog):
    values = weights.copy()
    values[100:130] = values[100]
    take = as_take(values)
    assert without_faults(take) is take
    assert "frames 100 to 129" in caplog.text


@pytest.mark.parametrize("frame", [137, 140])  # the latter is posed
def test_training_and_mapping_pass_over_absurd_weights(as_take, weights, frame):
    settings, values = facert.Settings(method="ridge"), weights.copy()
    values[frame, 5], values[frame + 60, 2] = 1e9, -40.0
    plain, spoiled = (
        facert.train(as_take(weights), settings),
        facert.train(as_take(values), settings),
    )
    expected = plain.retarget(as_take(weights)).params
    for model, take in ((spoiled, as_take(weights)), (plain, as_take(values))):
        np.testing.assert_allclose(model.retarget(take).params, expected, atol=0.02)


def test_a_weight_alone_that_comes_and_goes_at_once_stays():
    values = np.zeros((30, 12))
    values[15:, 0] = 0.8
    assert not find_faults(Source(values, [f"w{i}" for i in range(12)])).any.any()


def test_detection_can_be_left_out(as_take, weights):
    values = weights.copy()
    values[137, 5] = 1e9
    model = facert.train(as_take(weights), facert.Settings(method="ridge"))
    with pytest.raises(InputError, match="positions near"):
        model.retarget(as_take(values), options=RetargetOptions(detect=False))

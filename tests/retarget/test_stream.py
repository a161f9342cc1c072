from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import facert
from facert import InputError, Settings, Source
from facert.preprocess.motion.filtering import NOISE_FRAMES
from facert.retarget.options import AS_IT_IS, Adjustments, PoseScale, RetargetOptions


@pytest.fixture(scope="module")
def truth(make_take):
    return make_take(frames=150, posed=150, markers=8)


@pytest.fixture(scope="module")
def noisy(truth, pose_few):
    """Noise of a twentieth of the largest standard deviation, and 20 poses."""
    take = pose_few(truth, 20)
    scale = 0.05 * take.source.matrix.std(axis=0).max()
    noise = scale * np.random.default_rng(0).normal(size=take.source.matrix.shape)
    return replace(take, source=take.source.with_matrix(take.source.matrix + noise))


@pytest.fixture(scope="module")
def retargeter(noisy):
    return facert.train(noisy, Settings(method="gpr-linear"))


def jitter(params):
    return np.abs(np.diff(params, 2, axis=0)).mean()


def rms(values):
    return np.sqrt(np.mean(values**2))


def test_a_stream_gives_what_retargeting_online_gives(retargeter, noisy):
    whole = retargeter.retarget(noisy, "online")
    stream = retargeter.stream(noisy.source.names, noisy.fps)
    for t, frame in enumerate(noisy.source.values[:50]):
        one = stream.step(frame)
        np.testing.assert_allclose(one.params, whole.params[t], atol=1e-10)
        np.testing.assert_allclose(one.std, whole.std[t], atol=1e-10)
        np.testing.assert_allclose(one.source, whole.source.values[t], atol=1e-10)


def test_markers_may_come_in_any_order_and_some_not_at_all(retargeter, noisy):
    names, order = noisy.source.names, np.array([6, 0, 3, 2, 7, 1, 5])
    one = retargeter.stream([names[i] for i in order])
    other = retargeter.stream(names)
    for frame in noisy.source.values[:20]:
        hidden = frame.copy()
        hidden[4] = np.nan
        expected = other.step(hidden).params
        np.testing.assert_allclose(one.step(frame[order]).params, expected, atol=1e-10)


def test_neighbouring_frames_take_out_noise_offline_most(retargeter, noisy, truth):
    results = {
        "as it is": retargeter.retarget(noisy, options=AS_IT_IS),
        "online": retargeter.retarget(noisy, "online"),
        "offline": retargeter.retarget(noisy),
    }
    jitters = {name: jitter(result.params) for name, result in results.items()}
    errors = {name: rms(result.params - truth.params) for name, result in results.items()}
    assert jitters["offline"] < 0.7 * jitters["online"] < 0.7 * jitters["as it is"]
    assert errors["offline"] < 1.02 * errors["online"] < 1.02 * errors["as it is"]


def test_bad_markers_are_hidden_before_anything_is_mapped(retargeter, noisy, caplog):
    caplog.set_level("INFO", "facert")
    values = noisy.source.values.copy()
    values[40:60, 2] = 0.0
    bad = replace(noisy, source=Source(values, noisy.source.names))
    values = values.copy()
    values[40:60, 2] = np.nan
    hidden = replace(noisy, source=Source(values, noisy.source.names))
    for mode in ("offline", "online"):
        one, other = retargeter.retarget(bad, mode), retargeter.retarget(hidden, mode)
        np.testing.assert_allclose(one.params, other.params, atol=1e-10)
        assert "20 zero" in caplog.text or mode == "online"
        believed = retargeter.retarget(bad, mode, RetargetOptions(detect=False))
        assert np.abs(believed.params - other.params)[40:60].max() > 0.05


@pytest.mark.parametrize("mode", ["offline", "online"])
def test_gain_limits_and_smoothing_are_those_of_each_control(retargeter, noisy, mode):
    tables = {"jaw": {"gain": 2.0, "limits": [-0.1, 0.1]}, "smile": {"smoothing": 0.0}}
    adjustments = Adjustments.of(tables, noisy.controls.names)
    plain = retargeter.retarget(noisy, mode)
    result = retargeter.retarget(noisy, mode, RetargetOptions(adjustments=adjustments))
    np.testing.assert_allclose(result.params[:, 0], np.clip(2.0 * plain.params[:, 0], -0.1, 0.1))
    np.testing.assert_allclose(result.std[:, 0], 2.0 * plain.std[:, 0])
    np.testing.assert_allclose(result.params[:, 2:], plain.params[:, 2:])
    measured = retargeter.retarget(noisy, options=AS_IT_IS)
    np.testing.assert_allclose(result.params[:, 1], measured.params[:, 1], atol=1e-8)


@pytest.mark.parametrize("mode", ["offline", "online"])
def test_markers_stuck_on_anew_are_made_up_for_by_the_actor_at_rest(noisy, mode):
    retargeter = facert.train(noisy, Settings(method="ridge", neutral="0..10"))
    shift = np.random.default_rng(1).normal(size=noisy.source.values.shape[1:])
    moved = replace(noisy, source=Source(noisy.source.values + shift, noisy.source.names))
    expected = retargeter.retarget(noisy, mode)
    off = retargeter.retarget(moved, mode)
    calibrated = retargeter.retarget(moved, mode, RetargetOptions(neutral=range(11)))
    assert rms(off.params - expected.params) > 0.1
    assert rms(calibrated.params - expected.params) < 0.01


def test_a_filled_gap_widens_the_std(retargeter, noisy):
    values = noisy.source.values.copy()
    values[60:70, :5] = np.nan
    gap = replace(noisy, source=Source(values, noisy.source.names))
    for mode in ("offline", "online"):
        std, before = (retargeter.retarget(t, mode).std[60:70] for t in (gap, noisy))
        assert (std.mean(axis=1) > before.mean(axis=1)).all()


def test_a_given_noise_is_believed(retargeter, noisy):
    for mode in ("offline", "online"):
        exact = retargeter.retarget(noisy, mode, RetargetOptions(sigma=0.0)).params
        rough = retargeter.retarget(noisy, mode, RetargetOptions(sigma=1.0)).params
        assert jitter(rough) < jitter(exact)


def test_a_model_of_scattered_frames_streams_them_as_they_come(make_take):
    take = make_take(frames=60)
    order = np.random.default_rng(0).permutation(60)
    scattered = replace(
        take, source=Source(take.source.values[order], take.source.names), params=take.params[order]
    )
    retargeter = facert.train(scattered, Settings(method="gpr-linear"))
    assert retargeter.motion is None
    online = retargeter.retarget(take, "online")
    np.testing.assert_allclose(
        online.params, retargeter.retarget(take, options=AS_IT_IS).params, atol=1e-10
    )


@pytest.mark.parametrize("frame", [np.zeros((7, 3)), np.zeros(24), np.full((8, 3), np.inf)])
def test_a_frame_of_another_shape_or_of_infinite_numbers_is_refused(retargeter, noisy, frame):
    stream = retargeter.stream(noisy.source.names)
    with pytest.raises(InputError, match="the frame"):
        stream.step(frame)
    assert np.isfinite(stream.step(noisy.source.values[0]).params).all()


def test_names_of_another_set_are_refused(retargeter):
    with pytest.raises(InputError, match="names"):
        retargeter.stream(["a", "b", "c"])


def test_learning_from_smoothed_frames_is_learning_from_less_noise(noisy, truth):
    smooth = facert.train(noisy, Settings(method="gpr-linear")).retarget(noisy)
    rough = facert.train(noisy, Settings(method="gpr-linear", smooth=False)).retarget(noisy)
    assert rms(smooth.params - truth.params) < rms(rough.params - truth.params)


def test_what_was_told_of_noise_and_motion_is_reported(noisy):
    figures = facert.train(noisy, Settings(method="ridge")).figures
    scale = noisy.source.matrix.std(axis=0).max()
    assert figures["capture noise, cm"] == pytest.approx(0.05 * scale, rel=0.2)
    assert figures["motion a frame, cm"] > 0.05 * scale


def test_frames_at_rest_must_be_there(noisy, retargeter):
    with pytest.raises(InputError, match="neutral"):
        facert.train(noisy, Settings(method="ridge", neutral="500"))
    with pytest.raises(InputError, match="neutral"):
        retargeter.retarget(noisy, options=RetargetOptions(neutral=[500]))


def test_what_is_prepared_between_frames_changes_nothing_but_the_time_it_takes(retargeter, noisy):
    """The noise is measured there as well, once in so many frames."""
    one, other = (retargeter.stream(noisy.source.names, noisy.fps) for _ in range(2))
    for frame in noisy.source.values:
        prepared, plain = one.step(frame), other.step(frame)
        one.prepare(), one.prepare()
        np.testing.assert_array_equal(prepared.params, plain.params)
        np.testing.assert_array_equal(prepared.std, plain.std)


def test_std_and_source_are_those_of_their_own_frame_whenever_asked_for(retargeter, noisy):
    frames, names = noisy.source.values[:30], noisy.source.names
    late = retargeter.stream(names, noisy.fps)
    at_once = retargeter.stream(names, noisy.fps)
    kept = [late.step(frame) for frame in frames]
    expected = [(one.std, one.source) for one in map(at_once.step, frames)]
    for one, (std, source) in zip(kept, expected, strict=True):
        np.testing.assert_array_equal(one.std, std)
        np.testing.assert_array_equal(one.source, source)


@given(
    st.lists(st.floats(-3.0, 3.0), min_size=4, max_size=4),
    st.lists(st.tuples(st.floats(-2.0, 0.5), st.floats(0.5, 2.0)), min_size=4, max_size=4),
    st.booleans(),
)
def test_poses_are_clipped_to_their_bounds_before_the_gain_and_to_the_limits_after(
    retargeter, gain, limits, bounded
):
    adjustments = Adjustments(np.array(gain), np.array(limits), np.ones(4))
    units, bounds = retargeter.target_units, retargeter.bounds if bounded else None
    Y = 5.0 * np.random.default_rng(0).normal(size=(20, 4))
    scale = PoseScale(units, bounds, adjustments)
    params = np.clip(units.undo(Y), *bounds.T) if bounded else units.undo(Y)
    params = np.clip(params * gain, *adjustments.limits.T)
    std = np.abs(Y) * units.scale * np.abs(gain)
    np.testing.assert_allclose(scale.params(Y), params, atol=1e-12)
    np.testing.assert_allclose([scale.params(y) for y in Y], params, atol=1e-12)
    np.testing.assert_allclose(scale.std(np.abs(Y)), std, atol=1e-12)


def test_a_stream_may_learn_later_where_the_actor_rests(retargeter, noisy):
    shift = np.random.default_rng(1).normal(size=noisy.source.values.shape[1:])
    rest = retargeter.neutral.reshape(-1, 3) + shift
    rest[3] = np.nan  # not known: that marker is not moved
    shift[3] = 0.0
    late, known = retargeter.stream(noisy.source.names), retargeter.stream(noisy.source.names)
    late.calibrate(rest)
    for frame in noisy.source.values[:20]:
        expected = known.step(frame).params
        np.testing.assert_allclose(late.step(frame + shift).params, expected, atol=1e-9)


@pytest.mark.parametrize("louder", [3.0, 10.0])
def test_with_another_noise_the_source_goes_on_where_it_is(retargeter, truth, louder):
    scale = louder * 0.05 * truth.source.matrix.std(axis=0).max()
    noise = scale * np.random.default_rng(1).normal(size=truth.source.values.shape)
    values = truth.source.values + noise
    stream = retargeter.stream(truth.source.names, truth.fps)
    errors = np.array([stream.step(frame).source for frame in values]) - truth.source.values
    assert rms(errors[NOISE_FRAMES:]) < 1.1 * rms(errors[10:NOISE_FRAMES])


def test_a_frame_that_is_absurdly_far_is_refused_and_leaves_no_trace(retargeter, truth):
    stream, other = (retargeter.stream(truth.source.names, truth.fps) for _ in range(2))
    for number, frame in enumerate(truth.source.values):
        if number in (0, 5, 6):
            with pytest.raises(InputError, match="far away"):
                stream.step(np.full_like(frame, 1e160))
        np.testing.assert_array_equal(stream.step(frame).params, other.step(frame).params)


def test_calibrating_in_mid_stream_begins_the_filter_anew(retargeter, truth):
    """Else it would take what is calibrated for a leap of the face, and refuse it."""
    values = truth.source.values + 0.4
    rest = truth.source.values[0] + 0.4
    stream = retargeter.stream(truth.source.names, truth.fps)
    for frame in values[:20]:
        stream.step(frame)
    stream.calibrate(rest)
    fresh = retargeter.stream(truth.source.names, truth.fps, rest=rest)
    for frame in values[20 : NOISE_FRAMES - 1]:  # then the noise is measured, in other frames
        np.testing.assert_allclose(stream.step(frame).params, fresh.step(frame).params, atol=1e-9)

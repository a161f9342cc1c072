from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from facert.data.corrections import at_frames, merged, put_in, taken_out, without
from facert.data.labelling import of_character, predicted_poses
from facert.data.resampling import resampled
from facert.data.take import Controls, Corrections, Source, Take
from facert.errors import InputError


def result(frames=60, fps=30.0, time=None, limits=None):
    """A predicted shot with two controls."""
    time = np.arange(frames) / fps if time is None else np.asarray(time, dtype=float)
    params = np.stack([0.5 + 0.3 * np.sin(time), 0.2 * np.cos(3 * time) ** 2], axis=1)
    return Take(
        time=time,
        source=Source(params, ["a", "b"]),
        controls=Controls(["jaw", "smile"], limits),
        params=params,
        std=np.full_like(params, 0.1),
        fps=fps,
    )


def fix(*frames, value=(0.9, 0.05), width=0.5):
    return Corrections(np.array(frames), np.tile(value, (len(frames), 1)), width)


def test_a_corrected_frame_has_its_pose_and_no_deviation():
    shot = put_in(result(), fix(20))
    assert shot.params[20].tolist() == [0.9, 0.05]
    assert np.isnan(shot.std[20]).all()
    assert (np.delete(shot.std, 20, axis=0) == 0.1).all()


def test_the_correction_fades_smoothly_to_nothing_at_the_ends_of_its_window():
    time = np.arange(0.0, 2.0, 1e-3)
    base = result(time=time, limits=[[0, 1], [0, 1]])
    shot = put_in(base, fix(1000, width=0.5))
    moved = (shot.params - base.params)[:, 0]
    share = moved / moved[1000]
    assert (moved[np.abs(time - 1.0) >= 0.25] == 0.0).all()
    assert (np.diff(share[750:1001]) >= 0).all()
    slopes = np.diff(share) / 1e-3
    assert np.abs(slopes[[750, 1000, 1249]]).max() < 0.2 < slopes[875]
    assert np.abs(np.diff(slopes)).max() < 0.25  # no corner: slopes go as far as 6


def test_windows_go_by_seconds_not_by_frames():
    base = result(time=[0.0, 0.1, 0.2, 5.0, 5.1])
    shot = put_in(base, fix(2, width=1.0))
    changed = (shot.params != base.params).any(axis=1)
    assert changed.tolist() == [True, True, True, False, False]


def test_limits_are_kept_and_without_them_nobody_goes_further_than_a_pose():
    base = result()
    up = fix(20, value=(0.79, 0.2))
    limited = put_in(replace(base, controls=Controls(["jaw", "smile"], [[0, 1]] * 2)), up)
    assert limited.params[:, 1].max() > 0.2
    assert limited.params.max() <= 1.0
    free = put_in(base, up)
    assert free.params[:, 1].max() == 0.2


@pytest.mark.parametrize("frame", [0, 59])
def test_the_ends_of_a_take_are_corrected_as_any_frame(frame):
    shot = put_in(result(), fix(frame))
    assert shot.params[frame].tolist() == [0.9, 0.05]
    assert np.isfinite(shot.params).all()


def test_a_window_of_no_width_is_its_frame_alone():
    base = result()
    shot = put_in(base, fix(20, width=0.0))
    assert np.flatnonzero((shot.params != base.params).any(axis=1)).tolist() == [20]


@settings(deadline=None, max_examples=12)
@given(st.data())
def test_every_corrected_frame_is_met_and_nothing_goes_further_than_poses_do(data):
    frames = np.array(sorted(data.draw(st.sets(st.integers(0, 59), min_size=1, max_size=12))))
    values = data.draw(
        st.lists(st.floats(-1, 1), min_size=2 * len(frames), max_size=2 * len(frames))
    )
    width = data.draw(st.lists(st.floats(0, 3), min_size=len(frames), max_size=len(frames)))
    poses = np.reshape(values, (-1, 2))
    base = result()
    shot = put_in(base, Corrections(frames, poses, np.array(width)))
    assert (shot.params[frames] == poses).all()
    reached = np.vstack([base.params, poses])
    assert (shot.params >= reached.min(axis=0)).all()
    assert (shot.params <= reached.max(axis=0)).all()


def test_neighbouring_frames_with_opposite_corrections_do_not_swing_the_others():
    base = result()
    poses = np.array([[0.9, 0.0], [0.1, 0.2]])
    shot = put_in(base, Corrections(np.array([20, 21]), poses, 0.5))
    moved = np.abs(shot.params - base.params)[:, 0]
    assert moved[:20].max() < moved[20]
    assert moved[22:].max() < moved[21]


def test_corrections_are_put_in_anew_and_not_on_top_of_earlier_ones():
    base, first, second = result(), fix(20), fix(25, value=(0.0, 0.2))
    once = put_in(put_in(base, first), merged(first, second))
    together = put_in(base, merged(second, first))
    assert (once.params == together.params).all()


def test_taking_corrections_back_restores_every_bit():
    base, both = result(), merged(fix(20), fix(28))
    shot = put_in(base, both)
    assert (taken_out(shot).params == base.params).all()
    assert (taken_out(shot).std == base.std).all()
    one = put_in(shot, without(both, np.array([28])))
    assert (one.params == put_in(base, fix(20)).params).all()
    assert without(both, np.array([20, 28])) is None


def test_a_later_correction_of_a_frame_replaces_the_earlier():
    both = merged(fix(20, 30), fix(20, value=(0.1, 0.1), width=1.0))
    assert both.frames.tolist() == [20, 30]
    assert both.params[:, 0].tolist() == [0.1, 0.9]
    assert both.width.tolist() == [1.0, 0.5]


def test_what_is_not_corrected_cannot_be_taken_back():
    with pytest.raises(InputError, match="one of 20, 28, found 21"):
        without(fix(20, 28), np.array([21]))


def test_a_frame_without_a_prediction_can_be_posed():
    base = result()
    params = base.params.copy()
    params[18:23] = np.nan
    shot = put_in(replace(base, params=params, std=None), fix(20))
    assert shot.labels.tolist() == [*range(18), 20, *range(23, 60)]


@pytest.mark.parametrize(
    ("changes", "match"),
    [
        ({"frames": np.array([3, 2])}, "/corrections/frames: expected rising"),
        ({"frames": np.array([-1, 2])}, "/corrections/frames: expected rising"),
        ({"frames": np.array([0.5, 2.0])}, "/corrections/frames"),
        ({"frames": np.array([], dtype=int)}, "/corrections/frames"),
        ({"params": np.array([[0.1, np.nan], [0, 0]])}, "/corrections/params: expected finite"),
        ({"params": np.zeros((3, 2))}, "/corrections/params"),
        ({"width": -1.0}, "/corrections/width: expected seconds from 0"),
        ({"width": np.nan}, "/corrections/width"),
    ],
)
def test_corrections_that_make_no_sense_are_refused(changes, match):
    good = {"frames": np.array([1, 2]), "params": np.zeros((2, 2)), "width": 0.5}
    with pytest.raises(InputError, match=match):
        Corrections(**(good | changes))


def test_corrections_of_another_take_are_refused():
    with pytest.raises(InputError, match="frames up to 59, found 60"):
        put_in(result(), fix(60))
    with pytest.raises(InputError, match="/corrections/params"):
        put_in(result(), Corrections(np.array([3]), np.zeros((1, 3)), 0.5))
    with pytest.raises(InputError, match="the poses of a result"):
        put_in(replace(result(), params=None, std=None), fix(3))


def test_at_another_rate_corrections_stay_at_their_times():
    shot = put_in(result(fps=30.0), fix(20, 41))
    slow = resampled(shot, 24.0)
    assert slow.corrections.frames.tolist() == [16, 33]
    assert slow.params[16].tolist() == [0.9, 0.05]
    assert np.isnan(slow.std).any(axis=1).sum() == 2
    plain = resampled(result(fps=30.0), 24.0)
    assert (taken_out(slow).params == plain.params).all()


def test_of_corrections_that_meet_in_one_frame_the_first_counts(caplog):
    found = at_frames(fix(20, 21), np.array([10, 10]))
    assert found.frames.tolist() == [10]
    assert "1 correction left out" in caplog.text


def test_corrections_go_with_the_controls_of_a_character():
    """Without deviations they alone show which poses were predicted."""
    made = put_in(replace(result(), std=None), fix(20))
    names = made.controls.names
    found = of_character(made, Controls((*names[::-1], "ears")))
    assert found.corrections.frames.tolist() == [20]
    assert found.corrections.params.tolist() == [[0.05, 0.9, 0.0]]
    np.testing.assert_array_equal(taken_out(found).params[:, :2], taken_out(made).params[:, ::-1])
    assert predicted_poses(found) == predicted_poses(made) > 0

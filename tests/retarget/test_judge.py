from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import facert
from facert import Settings
from facert.data.take import Source
from facert.data.verdict import Reason, Verdict, where
from facert.errors import InputError
from facert.io.hdf5 import create
from facert.io.take import write_take
from facert.io.verdict import beside_result, read_verdict

MARKERS = 10


@pytest.fixture(scope="module")
def shot(make_take):
    """Markers on a face of some size, which expressions move a little."""
    take = make_take(frames=120, posed=120, animation=0, markers=MARKERS)
    places = 20.0 * np.random.default_rng(5).normal(size=(MARKERS, 3))
    return moved(take, places + take.source.values)


@pytest.fixture(scope="module")
def model(shot, pose_few):
    return facert.train(pose_few(shot, 15), Settings(method="ridge"))


def moved(take, values):
    return replace(take, source=replace(take.source, values=values))


def judged(model, take):
    take = replace(take, params=None)
    return facert.judge(take, model.retarget(take), model)


def the(kind, verdict):
    (reason,) = [reason for reason in verdict.reasons if reason.kind == kind]
    return reason


def test_a_take_like_the_posed_frames_is_good(model, shot):
    verdict = judged(model, shot)
    assert verdict.level == "good"
    assert not [r for r in verdict.reasons if r.level != "good"]


def test_a_head_that_turns_is_named_with_its_frames_and_is_no_new_expression(model, shot):
    turns = np.radians(8.0) * np.clip(shot.time - 1.0, 0.0, 1.0)
    rotations = Rotation.from_euler("y", turns[:, None]).as_matrix()
    turned = np.einsum("tij,tmj->tmi", rotations, shot.source.values)
    verdict = judged(model, moved(shot, turned))
    reason = the("head motion", verdict)
    assert verdict.level == reason.level == "bad"
    assert 30 < reason.frames[0] < 60
    assert reason.frames[-1] == 119
    assert "degrees against the training take" in reason.text
    assert "stabilise shot.h5" in reason.cure_for("shot.h5", "m")
    assert "stabilise 'a b$(c).h5'" in reason.cure_for("a b$(c).h5", "m")
    assert "new expressions" not in [r.kind for r in verdict.reasons]
    assert verdict.worst(3).min() > 40


def test_the_warning_of_retargeting_names_the_cause(model, shot, caplog):
    turned = shot.source.values @ Rotation.from_euler("y", 0.2).as_matrix().T
    model.retarget(moved(shot, turned))
    assert "stabilise" in caplog.text
    assert "suggest" not in caplog.text


def test_markers_that_are_placed_anew_are_another_day(model, shot):
    away = np.random.default_rng(1).normal(size=(MARKERS, 3))
    reason = the("far from training", judged(model, moved(shot, shot.source.values + 2.0 * away)))
    assert reason.level == "bad"
    assert "--neutral" in reason.cure


def test_what_no_posed_frame_showed_is_new(model, shot):
    values = shot.source.values.copy()
    values[60:90, 3] += 6.0 * np.sin(np.linspace(0.0, np.pi, 30))[:, None]
    reason = the("new expressions", judged(model, moved(shot, values)))
    assert reason.level == "look at it"
    assert set(reason.frames) <= set(range(60, 90))
    assert "mostly m3" in reason.text
    assert "--have MODEL" in reason.cure


def test_another_unit_is_named(model, shot):
    reason = the("other unit", judged(model, moved(shot, 10.0 * shot.source.values)))
    assert reason.level == "bad"
    assert "10 times" in reason.text


def test_a_control_that_is_cut_flat_is_named_with_its_frames(model, shot):
    rest = model.source_units.mean.reshape(-1, 3)
    larger = rest + 1.8 * (shot.source.values - rest)
    reason = the("clipped controls", judged(model, moved(shot, larger)))
    assert reason.level == "look at it"
    assert "--limits none" in reason.cure
    assert "no pose goes farther: pose frame " in reason.cure
    assert int(reason.cure.split("pose frame ")[1].split()[0]) in reason.frames
    result = model.retarget(moved(shot, larger))
    at_bound = (result.params[:, None] == model.bounds.T).any(axis=(1, 2))
    assert at_bound[reason.frames].all()


def test_a_control_cut_at_its_limit_is_told_from_one_whose_poses_end(shot, pose_few) -> None:
    few = pose_few(shot, 15)
    poses = few.params[few.labels]
    far = np.ptp(poses, axis=0)
    rest = shot.source.values.mean(axis=0)
    larger = moved(shot, rest + 2.5 * (shot.source.values - rest))
    cures = []
    for margin in (0.05, 5.0):
        limits = np.stack([poses.min(axis=0) - margin * far, poses.max(axis=0) + margin * far], 1)
        limited = replace(few, controls=replace(few.controls, limits=limits))
        model = facert.train(limited, Settings(method="ridge"))
        cures.append(the("clipped controls", judged(model, larger)).cure)
    assert "facert convert --limits" in cures[0]
    assert "no pose goes farther" in cures[1]


def test_a_bad_marker_is_named_with_its_share(model, shot):
    values = shot.source.values.copy()
    values[20:80, 7] = values[20, 7]
    reason = the("bad markers", judged(model, moved(shot, values)))
    assert "m7" in reason.text
    assert "% of the frames" in reason.text


def test_frames_that_show_little_are_gaps(model, shot):
    values = shot.source.values.copy()
    values[80:100, : MARKERS - 3] = np.nan
    reason = the("gaps", judged(model, moved(shot, values)))
    assert set(reason.frames) == set(range(80, 100))


def test_weights_in_percent_are_named(shot, pose_few):
    weights = np.abs(shot.source.matrix[:, :6] - shot.source.matrix[:, :6].mean(axis=0))
    weights /= weights.max()
    take = replace(shot, source=Source(weights, [f"w{i}" for i in range(6)]), units="")
    model = facert.train(pose_few(take, 15), Settings(method="ridge"))
    percent = replace(take, source=replace(take.source, values=100.0 * weights))
    assert "percent" in the("other unit", judged(model, percent)).text


def test_a_result_alone_can_be_judged_and_one_of_other_controls_not(model, shot):
    result = model.retarget(replace(shot, params=None))
    assert facert.judge(None, result, model).level == "good"
    with pytest.raises(InputError, match="poses"):
        facert.judge(None, replace(shot, params=None), model)


def test_a_verdict_is_kept_beside_the_result(model, shot, tmp_path):
    values = shot.source.values.copy()
    values[60:90, 3] += 6.0
    take = moved(shot, values)
    result = model.retarget(replace(take, params=None))
    verdict = facert.judge(take, result, model)
    write_take(result, tmp_path / "r.h5", beside=beside_result(verdict))
    kept = read_verdict(tmp_path / "r.h5")
    assert [replace_frames(r) for r in kept.reasons] == [replace_frames(r) for r in verdict.reasons]
    np.testing.assert_array_equal(kept.anomaly, verdict.anomaly)
    assert facert.read_take(tmp_path / "r.h5").model == "ridge, 15 poses"
    write_take(result, tmp_path / "none.h5")
    assert read_verdict(tmp_path / "none.h5") is None


def replace_frames(reason):
    return reason.kind, reason.level, reason.text, reason.cure, reason.frames.tolist()


def test_a_damaged_verdict_is_refused(tmp_path):
    with create(tmp_path / "r.h5", "facert-take", 1, overwrite=False) as file:
        file.array("/time", np.arange(4.0))
        file.array("/verdict/anomaly", np.zeros(4))
        file.array("/verdict/reasons", np.zeros((1, 4), dtype=bool))
        for word, text in (("kinds", "a"), ("levels", "awful"), ("texts", "b"), ("cures", "c")):
            file.names(f"/verdict/{word}", [text])
    with pytest.raises(InputError, match="awful"):
        read_verdict(tmp_path / "r.h5")


def test_frames_are_shown_in_runs_the_longest_ones():
    time = np.arange(1000) / 10.0
    assert where(np.array([7]), time) == "frame 7 (0.7 s)"
    frames = np.concatenate(
        [np.arange(a, a + n) for a, n in ((5, 3), (100, 9), (200, 8), (300, 7))]
    )
    assert (
        where(frames, time)
        == "frames 100-108 (10.0 s), 200-207 (20.0 s), 300-306 (30.0 s) and 1 more"
    )


def test_the_worst_frames_lie_apart():
    anomaly = np.zeros(100)
    anomaly[[40, 41, 42, 80]] = 3.0, 2.0, 2.5, 1.0
    reason = Reason("a", "bad", "", "", np.array([40]))
    verdict = Verdict((reason,), anomaly, np.arange(100) / 10.0)
    assert verdict.worst(3).tolist() == [40, 80]
    assert verdict.level == "bad"


@pytest.mark.parametrize("frames", [1, 2, 9])
def test_a_take_too_short_to_judge_is_never_called_good(model, shot, frames):
    short = replace(shot, time=shot.time[:frames], params=None, source=replace(
        shot.source, values=shot.source.values[:frames]
    ))  # fmt: skip
    verdict = judged(model, replace(short, std=None))
    assert verdict.level == "look at it"
    assert where(the("short", verdict).frames, verdict.time).startswith("frame")
    assert verdict.worst(1).tolist() == [0]

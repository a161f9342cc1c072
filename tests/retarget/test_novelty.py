import logging
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

import facert
from facert import Settings
from facert.io.formats import read_take_file
from facert.retarget.novelty import (
    NEW,
    RIDGE,
    novelty_warning,
    relative_residuals,
    relevance,
    unexplained,
    usual_variance,
)
from facert.retarget.source_reasons import unlike


@pytest.fixture(scope="module")
def talk(make_take):
    """A take in which the first three of five markers move, all frames posed."""
    take = make_take(frames=90, posed=90)
    return still(take, np.array([3, 4]))


@pytest.fixture(scope="module")
def model(talk, pose_few):
    return facert.train(pose_few(talk, 12), Settings(limits="declared"))


def still(take, markers):
    values = take.source.values.copy()
    values[:, markers] = values[:1, markers]
    return replace(take, source=replace(take.source, values=values))


def warnings(caplog, model, take):
    """Those of new motion when a take is retargeted."""
    caplog.clear()
    with caplog.at_level(logging.WARNING, "facert"):
        model.retarget(take)
    return [record.message for record in caplog.records if "no posed frame" in record.message]


def test_usual_motion_is_that_of_the_whole_take(model, talk):
    posed = model.source_units.apply(model.labelled)
    assert len(posed) == 12
    whole = model.source_units.apply(talk.source.matrix).std(axis=0)
    np.testing.assert_allclose(
        np.sqrt(usual_variance(posed, model.motion)), whole, rtol=0.15, atol=0.01
    )


def test_without_a_motion_posed_frames_stand_for_the_take():
    posed = np.random.default_rng(0).normal(size=(5, 6))
    np.testing.assert_array_equal(usual_variance(posed, None), posed.var(axis=0))


@pytest.mark.parametrize("settings", [Settings(smooth=False), Settings(method="ridge")])
def test_it_is_warned_of_whatever_the_method_and_with_noise_and_all(
    settings, talk, pose_few, make_take, caplog
):
    model = facert.train(pose_few(talk, 12), replace(settings, limits="declared"))
    assert warnings(caplog, model, make_take(frames=90, posed=0))
    assert not warnings(caplog, model, talk)


def test_a_model_of_an_earlier_version_warns_of_nothing(model, make_take, caplog):
    for labelled in (None, np.empty((0, 15))):
        assert not warnings(
            caplog, replace(model, labelled=labelled), make_take(frames=90, posed=0)
        )


def test_nothing_is_left_of_the_mean_and_less_the_further_posed_frames_reach():
    rng = np.random.default_rng(0)
    posed = rng.normal(size=(8, 4)) * [1.0, 0.5, 0.5, 0.0]
    posed[:, 3] = 0.2
    frames = posed.mean(axis=0) + np.vstack([np.zeros(4), np.eye(4)])
    left = relative_residuals(frames, posed, np.ones(4), "weights")
    np.testing.assert_allclose(left[0], 0.0, atol=1e-12)
    assert left[4, 3] == pytest.approx(1.0)  # nobody ever moved it
    assert left[1, 0] < left[2, 1] < 0.5


def test_what_is_left_is_what_ridge_regression_on_posed_frames_leaves():
    rng = np.random.default_rng(0)
    posed, frames = rng.normal(size=(5, 6)), rng.normal(size=(3, 6))
    A, D = posed - posed.mean(axis=0), frames - posed.mean(axis=0)
    gram = A @ A.T
    explained = D @ A.T @ np.linalg.solve(gram + 0.1 * np.trace(gram) / 5 * np.eye(5), A)
    left = relative_residuals(frames, posed, np.ones(6), "weights")
    np.testing.assert_allclose(left, np.abs(D - explained))
    lengths = np.linalg.norm((D - explained).reshape(3, 2, 3), axis=2)
    markers = relative_residuals(frames, posed, np.ones(6), "markers")
    np.testing.assert_allclose(markers, lengths / np.sqrt(3.0))


def test_markers_are_named_by_how_much_they_show():
    left = np.zeros((10, 5))
    left[:4, 1], left[:4, 3], left[:4, 4], left[6:, 0] = 3.0, 2.0, 0.1, 0.5
    assert 0.5 / np.sqrt(5.0) < NEW
    warning = str(novelty_warning(left, ["a", "b", "c", "d", "e"]))
    assert "in 40% of the frames" in warning
    assert "(mostly b, d)" in warning
    assert novelty_warning(left[4:], ["a", "b", "c", "d", "e"]) is None


def test_a_face_that_does_what_no_posed_frame_showed_is_warned_of(model, make_take, caplog):
    (warning,) = warnings(caplog, model, make_take(frames=90, posed=0))  # all markers move
    assert "m3" in warning
    assert "m4" in warning
    assert "m0" not in warning


def test_nothing_is_warned_of_in_the_take_that_was_learned_from(model, talk, caplog):
    assert not warnings(caplog, model, talk)


@pytest.mark.real
def test_brows_are_new_to_a_model_of_cheeks(real_data, caplog):
    cheeks, brows = (
        read_take_file(real_data / "tracks" / f"optical_{name}.npz", target="solved")
        for name in ("cheeks", "eyebrows")
    )
    rows = facert.suggest_frames(cheeks, 20).frames
    params = np.full_like(cheeks.params, np.nan)
    params[rows] = cheeks.params[rows]
    model = facert.train(replace(cheeks, params=params), Settings(method="gpr-linear"))
    assert not warnings(caplog, model, cheeks)
    (warning,) = warnings(caplog, model, brows)
    assert "eyebrow" in warning


@pytest.fixture(scope="module")
def posed_weights():
    """20 posed frames, normalised, and their poses of two controls, of what weights do.

    Jaw and brow go with the poses; gaze moves as much without; a tongue was never out.
    """
    rng = np.random.default_rng(0)
    jaw, brow, gaze, left = rng.normal(size=(4, 20))
    still = 0.01 * rng.normal(size=(2, 20))
    posed = np.stack([jaw, brow, gaze, 0.3 * left, still[0], still[1]], axis=1)
    poses = np.stack([jaw + 0.1 * brow, brow], axis=1)
    names = ("jawOpen", "browUp", "eyeLookLeft", "eyeLookRight", "tongueOut", "headYaw")
    return posed, poses, names


def test_a_weight_that_moves_without_the_poses_matters_little(posed_weights):
    posed, poses, names = posed_weights
    matter = relevance(posed, poses, np.array([1.0, 1.0, 1.0, 1.0, 1.0, 0.0]), names)
    assert matter[:2].min() > 0.9
    assert matter[2] < 0.4
    assert matter[2] == matter[3]  # its twin hardly moved in these frames
    assert matter[4] > 0.95  # may be an expression that nobody showed
    assert matter[5] == 1.0
    few = relevance(posed[:4], poses[:4], np.ones(6), names)
    np.testing.assert_array_equal(few, 1.0)


def test_a_gaze_of_which_no_control_knows_makes_no_frame_new(posed_weights):
    posed, poses, names = posed_weights
    names, time = names[:5], np.arange(60) / 30.0
    rows = np.tile(np.column_stack([posed, poses]), (3, 1))
    weights, params = 0.5 + 0.1 * rows[:, :5], 0.5 + 0.1 * rows[:, 6:]  # no headYaw
    controls = facert.Controls(("a", "b"))
    take = facert.Take(time, facert.Source(weights, names), controls, params)
    model = facert.train(take, Settings(method="ridge", smooth=False))
    frames = model.source_units.apply(weights)
    amounts = []
    for column in range(5):
        other = frames.copy()
        other[:, column] += 3.0
        amounts.append(unlike(other, model).amounts.mean())
    assert max(amounts[2:4]) < NEW < amounts[4]


def test_residuals_are_the_same_by_the_smaller_side():
    """Eq. of the module; of thousands of columns their square would fill the memory."""
    rng = np.random.default_rng(0)
    for labels, columns in ((8, 30), (40, 30)):
        posed, frames = rng.normal(size=(labels, columns)), rng.normal(size=(5, columns))
        A = posed - posed.mean(axis=0)
        square = A.T @ A
        ridge = RIDGE * np.trace(square) / labels
        shrunk = ridge * np.linalg.inv(square + ridge * np.eye(columns))
        expected = (frames - posed.mean(axis=0)) @ shrunk
        np.testing.assert_allclose(unexplained(frames, posed), expected, rtol=0, atol=1e-12)
    tracemalloc.start()
    unexplained(np.ones((3, 4000)), rng.normal(size=(4, 4000)))
    assert tracemalloc.get_traced_memory()[1] < 5 << 20
    tracemalloc.stop()


def test_what_matters_of_very_many_poses_takes_no_matrix_of_their_square():
    rng = np.random.default_rng(4)
    posed, poses, names = rng.normal(size=(6, 3)), rng.normal(size=(6, 8)), ("a", "b", "c")
    wide = relevance(posed, poses, np.ones(3), names)
    centred = poses - poses.mean(axis=0)
    narrow = centred @ np.linalg.svd(centred, full_matrices=False)[2][:5].T
    np.testing.assert_allclose(relevance(posed, narrow, np.ones(3), names), wide, atol=1e-9)
    many = rng.normal(size=(20_000, 3))
    tracemalloc.start()
    relevance(many, many[:, :2], np.ones(3), names)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 20 * many.nbytes

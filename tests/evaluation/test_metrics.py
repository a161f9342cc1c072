from dataclasses import replace

import numpy as np
import pytest

from facert.data.arrays import rms
from facert.data.rig import Rig
from facert.data.take import Controls, Source, Take
from facert.evaluation.metrics import compare, jitter, score, vertex_errors, vertex_gram

NAMES = ("jawOpen", "browDown_L", "browDown_R")


def take(params, names=NAMES):
    frames = len(params)
    source = Source(np.arange(frames, dtype=float)[:, None], ["w"])
    return Take(np.arange(frames), source, controls=Controls(names), params=params)


def test_rms_is_over_everything():
    assert rms(np.array([[3.0, 0.0], [0.0, -4.0]])) == 2.5


def test_errors_are_given_in_all_and_by_part_of_the_face():
    truth = take(np.zeros((2, 3)))
    result = take(np.array([[3.0, 0.0, 0.0], [3.0, 1.0, 1.0]]))
    comparison = compare(truth, result)
    assert (comparison.frames, comparison.controls) == (2, 3)
    assert comparison.rms == pytest.approx((20 / 6) ** 0.5)
    groups = {group.name: (group.controls, group.rms) for group in comparison.groups}
    assert groups["jaw"] == (1, 3.0)
    assert groups["brows"] == (2, pytest.approx(0.5**0.5))


def test_frames_without_a_true_pose_are_passed_over():
    truth = take(np.array([[0.0, 0.0, 0.0], [np.nan] * 3]))
    assert compare(truth, take(np.array([[1.0, 1.0, 1.0], [9.0, 9.0, 9.0]]))).rms == 1.0


def test_controls_are_compared_by_name():
    params = np.random.default_rng(0).random((4, 3))
    turned = take(params[:, ::-1], NAMES[::-1])
    assert compare(take(params), turned).rms == 0.0


def test_there_is_nothing_to_compare_without_truth_or_with_other_controls():
    result = take(np.zeros((2, 3)))
    assert compare(replace(result, params=None), result) is None
    assert compare(take(np.full((2, 3), np.nan)), result) is None
    assert compare(take(np.zeros((2, 3)), ("a", "b", "c")), result) is None
    assert compare(replace(result, controls=None, params=None), result) is None


def test_scores_are_in_all_by_control_and_by_range():
    errors = np.array([[3.0, 0.0, 0.0], [3.0, 0.0, 1.0]])
    found = score(errors, np.array([0, 1]), np.array([6.0, 2.0, 0.0]))
    assert found.rms == rms(errors)
    assert found.per_control == pytest.approx((3.0, 0.0, 0.5**0.5))
    assert found.rms_normalised == pytest.approx(8**-0.5)  # the control that never moves is out
    assert (found.jitter, found.vertex_rms, found.vertex_p95) == (None, None, None)


def test_jitter_is_of_consecutive_frames_alone():
    errors = np.array([[0.0], [1.0], [0.0], [50.0], [7.0], [8.0], [9.0]])
    frames = np.array([3, 4, 5, 9, 20, 21, 22])
    assert jitter(errors, frames) == pytest.approx(2**0.5)  # -2 at 3, 4, 5; 0 at 20, 21, 22
    assert jitter(errors, 2 * frames) is None
    assert jitter(errors[:2], frames[:2]) is None


def test_vertex_errors_are_those_of_the_deformed_mesh():
    rng = np.random.default_rng(0)
    rig = Rig(rng.normal(size=(5, 3)), rng.normal(size=(4, 5, 3)), "dcba", np.array([[0, 1, 2]]))
    truth, poses = rng.normal(size=(2, 6, 4))
    distances = np.linalg.norm(rig.deform(poses) - rig.deform(truth), axis=2)
    expected = np.sqrt(np.mean(distances**2, axis=1))
    errors = (poses - truth)[:, ::-1]  # in the order a, b, c, d
    gram = vertex_gram(rig, Controls(tuple("ABCD")))
    assert vertex_errors(errors, gram) == pytest.approx(expected)
    found = score(errors, np.arange(6), np.ones(4), gram)
    assert found.vertex_rms == pytest.approx(expected.mean())
    assert found.vertex_p95 == pytest.approx(np.percentile(expected, 95))


def test_a_control_without_a_side_moves_both_halves_of_its_shape():
    rng = np.random.default_rng(0)
    names = ("brow_R", "jaw", "brow_L", "other")
    rig = Rig(np.zeros((5, 3)), rng.normal(size=(4, 5, 3)), names, np.array([[0, 1, 2]]))
    error = np.array([[0.3, -0.2]])  # of jaw and brow
    moved = rig.deform(np.array([[-0.2, 0.3, -0.2, 0.0]]))[0]
    expected = np.sqrt(np.mean(np.sum(moved**2, axis=1)))
    gram = vertex_gram(rig, Controls(("jaw", "Brow")))
    assert vertex_errors(error, gram) == pytest.approx([expected])

from dataclasses import replace

import numpy as np
import pytest

from facert.data import Controls, Source, Take
from facert.metrics import compare, rms

NAMES = ("jawOpen", "browDown_L", "browDown_R")


def take(params, names=NAMES):
    frames = len(params)
    source = Source(np.arange(frames, dtype=float)[:, None], ["w"])
    return Take(np.arange(frames), source, controls=Controls(names), params=params)


def test_rms_is_over_everything():
    assert rms(np.array([[3.0, 0.0], [0.0, -4.0]])) == 2.5


def test_errors_are_told_in_all_and_by_part_of_the_face():
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


def test_there_is_nothing_to_tell_without_truth_or_with_other_controls():
    result = take(np.zeros((2, 3)))
    assert compare(replace(result, params=None), result) is None
    assert compare(take(np.full((2, 3), np.nan)), result) is None
    assert compare(take(np.zeros((2, 3)), ("a", "b", "c")), result) is None
    assert compare(replace(result, controls=None, params=None), result) is None

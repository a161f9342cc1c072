from dataclasses import replace

import numpy as np

from facert.data.shared_controls import shared_controls
from facert.data.take import Controls, Source, Take
from facert.evaluation.metrics import compare


def take(params, names):
    source = Source(np.zeros((len(params), 1)), ["w"])
    return Take(np.arange(len(params)), source, controls=Controls(names), params=params)


def test_what_both_have_is_compared_in_any_spelling_and_order():
    params = np.random.default_rng(0).random((4, 3))
    truth = take(params, ("tongueOut", "browDownLeft", "jawOpen"))
    result = take(params[:, [2, 1, 0]], ("JawOpen", "browDown_L", "sneer"))
    shared = shared_controls(truth, result)
    assert shared.truth.controls.names == shared.result.controls.names == ("JawOpen", "browDown_L")
    assert compare(shared.truth, shared.result).rms == 0.0
    assert (shared.of_truth, shared.of_result) == (("tongueOut",), ("sneer",))
    assert shared.left_out == (
        "not compared: tongueOut (only in the truth); sneer (only in the result)"
    )


def test_takes_of_the_same_controls_leave_nothing_out():
    one = take(np.eye(2), ("a", "b"))
    assert shared_controls(one, one).left_out == ""


def test_no_control_stands_for_two():
    truth = take(np.eye(1), ("jawOpen",))
    shared = shared_controls(truth, take(np.eye(2), ("jaw_open", "jawOpen")))
    assert shared.result.controls.names == ("jawOpen",)
    assert shared.of_result == ("jaw_open",)


def test_other_controls_or_no_poses_share_nothing():
    one = take(np.eye(2), ("a", "b"))
    assert shared_controls(one, take(np.eye(2), ("c", "d"))) is None
    assert shared_controls(replace(one, params=None), one) is None
    assert shared_controls(one, replace(one, params=None, controls=None)) is None

"""Labels that nobody posed are refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from facert.data.take import Source
from facert.errors import InputError
from facert.retarget.training import check_poses, train
from facert.settings import Settings


@pytest.fixture(name="predicted")
def _predicted(make_take):
    """What retargeting gives: a pose and its standard deviation for every frame."""
    take = make_take(posed=60, animation=0)
    return replace(take, std=np.full_like(take.params, 0.1))


def test_a_result_is_not_learned_from(predicted) -> None:
    with pytest.raises(InputError, match=r"/target/std: .* for all 60: a model predicted them"):
        check_poses(predicted)
    check_poses(replace(predicted, std=None))


def test_a_few_predicted_poses_among_labels_are_warned_about(predicted, caplog) -> None:
    std = predicted.std.copy()
    std[::2] = np.nan  # set by somebody
    std[1] = 0.0  # given exactly
    check_poses(replace(predicted, std=std))
    assert "29 poses with a standard deviation" in caplog.text
    caplog.clear()
    check_poses(replace(predicted, std=np.zeros_like(std)))
    assert not caplog.records


def test_a_take_without_poses_has_nothing_to_check(predicted) -> None:
    check_poses(replace(predicted, params=None))


def test_a_clock_among_the_weights_is_warned_of_once(make_take, caplog) -> None:
    take = make_take()
    weights = np.column_stack([take.source.matrix, 1000 * take.time])
    names = [*(f"w{i}" for i in range(weights.shape[1] - 1)), "extra"]
    train(replace(take, source=Source(weights, names), units=""), Settings(method="nearest"))
    assert [r.getMessage() for r in caplog.records if "'extra' (a clock)" in r.getMessage()]
    caplog.clear()
    train(take, Settings(method="nearest"))
    assert "no weights" not in caplog.text


@pytest.mark.parametrize("value", [1e9, -1e30, 400.0])
def test_an_absurd_value_of_a_label_is_named_with_frame_and_control(make_take, value, caplog):
    take = make_take(frames=60, posed=12, animation=0)
    train(take, Settings(method="nearest"))
    assert "many times" not in caplog.text
    frame, params = take.labels[3], take.params.copy()
    params[frame, 1] = value
    train(replace(take, params=params), Settings(method="nearest"))
    name = take.controls.names[1]
    assert f"the pose of frame {frame} has {name} at {value:.3g}" in caplog.text

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

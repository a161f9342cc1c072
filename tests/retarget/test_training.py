"""Labels that nobody posed are refused; slips among labels are named."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from facert.data.labelling import Poses, labelled
from facert.data.take import Controls, Source, Take
from facert.errors import InputError
from facert.retarget.training import check_poses, train
from facert.settings import Settings


@pytest.fixture(name="predicted")
def _predicted(make_take):
    """What retargeting gives: a pose and its standard deviation for every frame."""
    take = make_take(posed=60, animation=0)
    return replace(take, std=np.full_like(take.params, 0.1))


def test_a_result_is_not_learned_from(predicted) -> None:
    with pytest.raises(InputError, match=r"/target/std: .* a model predicted all 60 of them"):
        check_poses(predicted)
    check_poses(replace(predicted, std=None))


def test_a_few_predicted_poses_among_labels_are_warned_about(predicted, caplog) -> None:
    std = predicted.std.copy()
    std[::2] = np.nan  # set by somebody
    std[1] = 0.0  # given exactly
    check_poses(replace(predicted, std=std))
    assert "29 poses predicted by a model" in caplog.text
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


@pytest.mark.parametrize("value", [1e9, -1e12, 400.0])
def test_an_absurd_value_of_a_label_is_named_with_frame_and_control(make_take, value, caplog):
    take = make_take(frames=60, posed=12, animation=0)
    train(take, Settings(method="nearest"))
    assert "many times" not in caplog.text
    frame, params = take.labels[3], take.params.copy()
    params[frame, 1] = value
    train(replace(take, params=params), Settings(method="nearest"))
    name = take.controls.names[1]
    assert f"the pose of frame {frame} has {name} at {value:.3g}" in caplog.text


def posed(poses, limits=None):
    controls = Controls([f"c{i}" for i in range(poses.shape[1])], limits)
    weights = np.random.default_rng(0).random((len(poses), 3))
    return Take(np.arange(len(poses)) / 30.0, Source(weights, "abc"), controls, poses)


def test_a_label_in_which_nothing_can_be_computed_is_refused_by_frame_and_control(make_take):
    take = make_take(frames=60, posed=12, animation=0)
    frame, params = take.labels[3], take.params.copy()
    params[frame, 1] = -1e30
    with pytest.raises(InputError, match=f"the pose of frame {frame}, {take.controls.names[1]}"):
        train(replace(take, params=params), Settings(method="nearest"))


@pytest.fixture(scope="module")
def shares():
    """Poses (16, 30) of 0 to 1; most controls rest in most of them, and some are used once."""
    rng = np.random.default_rng(1)
    poses = rng.random((16, 30)) * (rng.random((16, 30)) < rng.uniform(0.0, 0.4, 30))
    poses[:, :3] = 0.03 * rng.random((16, 3))
    poses[4, 10:], poses[5, 20] = 0.0, 1.0
    return poses


def warned(take, caplog) -> list[str]:
    caplog.clear()
    train(take, Settings(method="nearest"))
    texts = [record.getMessage() for record in caplog.records]
    return [text for text in texts if "many times" in text]


def test_honest_poses_of_shares_percent_and_degrees_are_not_absurd(shares, caplog):
    overshoot, degrees, one = shares.copy(), shares.copy(), shares.copy()
    overshoot[3, 5] = 1.8
    degrees[:, 7] = np.linspace(-30.0, 40.0, 16)
    degrees[:, 8] = np.append(np.linspace(0.5, 4.0, 15), 45.0)  # mostly straight on
    degrees[3, 9] = 25.0  # used once, but as far as another
    one[:, :] = 0.0
    one[np.arange(16), np.arange(16)] = 1.0
    limits = np.tile([0.0, 100.0], (30, 1))
    for take in (
        *(posed(poses) for poses in (shares, overshoot, degrees, one, 100.0 * shares)),
        posed(np.where(shares > 0.9, 90.0, shares), limits),
    ):
        assert not warned(take, caplog)


@pytest.mark.parametrize("value", [8.0, 50.0, -5.0, 800.0, 1e9, -1e12])
@pytest.mark.parametrize("limits", [None, (0.0, 1.0), (0.0, np.inf)])
def test_a_slip_among_poses_of_shares_is_named(shares, value, limits, caplog):
    limits = None if limits is None else np.tile(limits, (30, 1))
    for control in (0, 8, 12, 20):
        poses = shares.copy()
        poses[5, control] = value
        found = warned(posed(poses, limits), caplog)
        assert len(found) == 1
        assert f"frame 5 has c{control} at {value:.3g}" in found[0]


@pytest.mark.real
@pytest.mark.parametrize("name", ["rom", "short", "utterance_a", "utterance_b"])
@pytest.mark.parametrize("target", ["arkit", "units"])
def test_poses_of_real_recordings_are_not_absurd(real_data, name, target, caplog):
    values = np.load(real_data / "tracks" / f"{name}.npz")[target]
    for count in (10, 20, 40):
        for seed in range(3):
            rows = np.random.default_rng(seed).permutation(len(values))[:count]
            assert not warned(posed(values[rows]), caplog)


def test_poses_of_a_named_model_are_predicted_without_deviations_too(predicted) -> None:
    result = replace(predicted, std=None, model="svr.safetensors: svr, 40 poses")
    with pytest.raises(InputError, match="a model predicted all 60"):
        check_poses(result)
    poses = Poses(result.controls.names, result.params[[7]], frames=np.array([7]))
    posed = labelled(result, poses)
    assert posed.labels.tolist() == [7]
    check_poses(posed)

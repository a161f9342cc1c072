from dataclasses import replace

import numpy as np
import pytest

import facert
from facert.data.rig import Rig
from facert.data.take import Controls
from facert.errors import InputError
from facert.pages.view_data import Performance, highest, retargeted

NAMES = ("jaw", "smile", "brow", "blink")
RNG = np.random.default_rng(0)


@pytest.fixture(scope="module")
def rig() -> Rig:
    neutral, shapes = RNG.normal(size=(9, 3)), RNG.normal(size=(4, 9, 3))
    return Rig(neutral, shapes, NAMES, np.array([[0, 1, 2], [3, 4, 5]]), "cm")


@pytest.fixture(scope="module")
def truth(make_take):
    return make_take(posed=60)


@pytest.fixture(scope="module")
def result(truth):
    off = 0.1 * RNG.normal(size=truth.params.shape)
    return replace(truth, params=truth.params + off, std=np.abs(off))


def test_errors_of_vertices_and_of_frames_agree(truth, result, rig) -> None:
    performance = Performance(result, result.labels[:0], rig, truth)
    for frame in (0, 17):
        each = performance.vertex_errors(frame)
        assert np.sqrt(np.mean(each**2)) == pytest.approx(performance.errors[frame])
    moved = rig.deform(result.params[[3]])[0] - rig.deform(truth.params[[3]])[0]
    np.testing.assert_allclose(performance.vertex_errors(3), np.linalg.norm(moved, axis=1))


def test_the_truth_may_name_its_controls_in_another_order(truth, result, rig) -> None:
    turned = replace(
        truth, controls=Controls(NAMES[::-1]), params=truth.params[:, ::-1], animation=None
    )
    one, other = (Performance(result, result.labels[:0], rig, true) for true in (truth, turned))
    np.testing.assert_allclose(one.errors, other.errors)
    np.testing.assert_allclose(one.vertex_errors(5), other.vertex_errors(5))


def test_the_std_of_one_control_moves_its_shape(truth, rig) -> None:
    std = np.zeros((60, 4))
    std[7, 2] = 0.5
    performance = Performance(replace(truth, std=std), truth.labels[:0], rig)
    np.testing.assert_allclose(
        performance.vertex_std(7), 0.5 * np.linalg.norm(rig.shapes[2], axis=1)
    )
    assert not performance.vertex_std(8).any()
    assert performance.std[7] == pytest.approx(0.25)


def test_without_rig_or_poses_there_are_no_faces(make_take, rig) -> None:
    bare = make_take(posed=0, animation=0)
    performance = Performance(bare, bare.labels, rig)
    assert performance.face is None
    assert performance.vertex_errors(0) is None
    assert performance.errors is None
    assert performance.scale().top == 1.0


def test_a_truth_of_other_frames_or_controls_is_refused(truth, result, make_take) -> None:
    with pytest.raises(InputError, match="60 frames, found 59"):
        Performance(result, result.labels, truth=make_take(frames=59, posed=59))
    other = replace(truth, controls=Controls(["a", "b", "c", "d"]))
    with pytest.raises(InputError, match="controls"):
        Performance(result, result.labels, truth=other)


def test_retargeted_poses_of_a_take_are_key_poses_or_the_truth(make_take, truth) -> None:
    few = make_take()
    model = facert.train(few, facert.Settings(method="gpr"))
    performance = retargeted(few, model)
    assert performance.key_poses.tolist() == few.labels.tolist()
    assert performance.truth is None
    assert len(performance.take.labels) == len(few)
    np.testing.assert_array_equal(performance.take.source.values, few.source.values)
    known = retargeted(truth, model)
    assert known.truth is truth
    assert not len(known.key_poses)


def test_the_highest_frames_keep_apart() -> None:
    time = np.arange(100) / 30
    values = np.exp(-(((np.arange(100) - 50) / 20.0) ** 2))
    values[3] = np.nan
    chosen = highest(values, time, 4)
    assert chosen[0] == 50
    assert len(chosen) == 4
    assert (
        np.abs(np.subtract.outer(time[chosen], time[chosen]))[~np.eye(4, dtype=bool)].min() >= 0.5
    )
    assert highest(np.full(5, np.nan), time[:5], 3) == []

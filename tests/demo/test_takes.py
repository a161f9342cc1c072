"""The demo's takes: reproducible, within limits, and a nonlinear but learnable relation."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, WhiteKernel

from facert.data.rig import Rig
from facert.data.take import Take
from facert.demo import actor_rig, character_rig, performance_take, training_take, write_demo
from facert.demo.acting import perform
from facert.demo.character import CONTROLS, Control, animate
from facert.demo.expressions import ACTIVATIONS
from facert.demo.files import FILES
from facert.errors import OutputExistsError
from facert.io.rig import read_rig
from facert.io.take import read_take

DATA = Path(__file__).resolve().parents[2] / "data"


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


@pytest.fixture(scope="module", name="all_posed")
def _all_posed() -> Take:
    return training_take(posed=None)


def test_training_take_has_the_promised_size() -> None:
    take = training_take()
    assert len(take) == 1800
    assert len(take.labels) == 40
    assert take.source.values.shape == (1800, 44, 3)
    assert take.animation is not None
    assert take.animation.shape == (300, len(CONTROLS))


def test_key_poses_are_spread_over_the_performance() -> None:
    labels = training_take(posed=10).labels
    np.testing.assert_array_equal(labels // 180, np.arange(10))


def test_key_poses_are_true_poses(all_posed: Take) -> None:
    take = training_take(posed=12)
    assert take.params is not None
    assert all_posed.params is not None
    np.testing.assert_array_equal(take.params[take.labels], all_posed.params[take.labels])


def test_performance_differs_and_is_posed_throughout(all_posed: Take) -> None:
    take = performance_take()
    assert len(take) == 600
    assert len(take.labels) == 600
    assert rms(take.source.matrix - all_posed.source.matrix[:600]) > 0.05


def test_the_seed_decides() -> None:
    again, other = performance_take(seed=5), performance_take(seed=6)
    np.testing.assert_array_equal(performance_take(seed=5).source.matrix, again.source.matrix)
    assert (again.source.matrix != other.source.matrix).any()


def test_limits_are_respected_and_reached(all_posed: Take) -> None:
    assert all_posed.params is not None
    assert all_posed.controls is not None
    assert all_posed.controls.limits is not None
    low, high = all_posed.controls.limits.T
    for poses in (all_posed.params, all_posed.animation):
        assert (poses >= low).all()
        assert (poses <= high).all()
    assert (all_posed.params == high).any(axis=0).sum() >= 5


def test_every_control_is_used(all_posed: Take) -> None:
    assert all_posed.params is not None
    assert (np.ptp(all_posed.params, axis=0) > 0.3).all()


def test_markers_tell_the_pose_but_not_by_a_line(all_posed: Take) -> None:
    performance = performance_take()
    assert all_posed.params is not None
    assert performance.params is not None
    mean = all_posed.source.matrix.mean(axis=0)
    _, _, axes = np.linalg.svd(all_posed.source.matrix - mean, full_matrices=False)
    train, test = ((t.source.matrix - mean) @ axes[:24].T for t in (all_posed, performance))
    constant = rms(performance.params - all_posed.params.mean(axis=0))
    affine = np.column_stack([train, np.ones(len(train))])
    line = np.linalg.lstsq(affine, all_posed.params, rcond=None)[0]
    linear = rms(np.column_stack([test, np.ones(len(test))]) @ line - performance.params)
    kernel = 50.0 * RBF(4.0) + WhiteKernel(0.012)
    some = slice(None, None, 3)
    process = GaussianProcessRegressor(kernel, optimizer=None, normalize_y=True)
    process.fit(train[some], all_posed.params[some])
    smooth = rms(process.predict(test) - performance.params)
    assert linear > 0.2 * constant
    assert smooth < 0.8 * linear


def test_blinks_last_as_long_as_real_ones() -> None:
    closed = perform(60, 120, seed=3)[:, ACTIVATIONS.index("blink_L")] > 0.5
    edges = np.flatnonzero(np.diff(closed.astype(int)))
    length = np.diff(edges)[:: 2 if not closed[0] else 1] / 120
    assert len(length) > 10
    assert (length > 0.08).all()
    assert (length < 0.4).all()


def test_rest_is_rest() -> None:
    np.testing.assert_array_equal(animate(np.zeros((1, len(ACTIVATIONS)))), 0)


@settings(deadline=None, max_examples=30)
@given(
    effect=st.lists(st.floats(-3, 3), min_size=2, max_size=8),
    power=st.floats(0.5, 3),
)
def test_a_slider_rises_with_its_effect(effect: list[float], power: float) -> None:
    slider = Control("slider", {}, -1, 1, power)
    setting = slider.setting(np.sort(effect))
    assert (np.diff(setting) >= 0).all()
    assert (np.abs(setting) <= 1).all()


@pytest.mark.parametrize("rig", [actor_rig(), character_rig()], ids=["actor", "character"])
def test_rigs_are_complete(rig: Rig) -> None:
    assert rig.units == "cm"
    assert rig.colours is not None
    height = np.ptp(rig.neutral[:, 1])
    assert 15 < height < 35


def test_written_twice_gives_the_same_bytes(tmp_path: Path) -> None:
    first = write_demo(tmp_path / "a", seed=3)
    second = write_demo(tmp_path / "b", seed=3)
    for one, other in zip(first, second, strict=True):
        assert one.read_bytes() == other.read_bytes()


def test_files_are_small_and_read_back(tmp_path: Path) -> None:
    paths = write_demo(tmp_path)
    assert sum(path.stat().st_size for path in paths) < 3e6
    take, rig = read_take(paths[0]), read_rig(paths[3])
    np.testing.assert_array_equal(take.source.values, training_take().source.values)
    np.testing.assert_array_equal(rig.shapes, character_rig().shapes)
    np.testing.assert_array_equal(rig.colours, character_rig().colours)


def test_nothing_is_written_over(tmp_path: Path) -> None:
    (tmp_path / FILES[-1]).write_text("mine")
    with pytest.raises(OutputExistsError):
        write_demo(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == [FILES[-1]]


def test_the_data_folder_holds_what_the_demo_writes() -> None:
    """Up to one step of rounding, which may fall differently on another processor."""
    step = 1.01 / 4096
    for name, made in zip(FILES[:2], (training_take(), performance_take()), strict=True):
        kept = read_take(DATA / name)
        np.testing.assert_allclose(kept.source.values, made.source.values, atol=step)
        np.testing.assert_allclose(kept.params, made.params, atol=step)
    for name, rig in zip(FILES[2:], (actor_rig(), character_rig()), strict=True):
        kept_rig = read_rig(DATA / name)
        np.testing.assert_allclose(kept_rig.neutral, rig.neutral, atol=step)
        np.testing.assert_allclose(kept_rig.shapes, rig.shapes, atol=step)
        np.testing.assert_array_equal(kept_rig.faces, rig.faces)

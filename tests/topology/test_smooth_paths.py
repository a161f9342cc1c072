import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline

from facert.topology.keyed import KeyedPerformance
from facert.topology.propagation import propagate
from facert.topology.smooth_path import MOST, SmoothPath, trust_in_path

KEYS = np.array([40, 3, 12, 55, 22])
SHARES = st.floats(1e-3, 10.0)


def values(columns=4):
    return np.random.default_rng(0).normal(size=(len(KEYS), columns))


def ramp(power, seed=0):
    """A slow rise to an expression and back, still for a third of the time."""
    rng = np.random.default_rng(seed)
    level = np.interp(np.arange(100), (0, 11, 45, 55, 88, 99), (0.0, 0.0, 1.0, 1.0, 0.0, 0.0))
    rise = level**2 * (3.0 - 2.0 * level)
    rest, shapes = rng.normal(size=(2, 20, 3))
    other = rng.normal(size=(20, 3))
    source = 3.0 * rest + rise[:, None, None] * shapes
    truth = 4.0 * rest + rise[:, None, None] * shapes + rise[:, None, None] ** power * other
    keys = np.linspace(0, 99, 10).round().astype(int)
    return KeyedPerformance(source, keys, truth[keys]), truth


def test_the_path_is_a_spline_at_rest_before_the_first_key_and_after_the_last():
    path, given_there = SmoothPath(60, KEYS), values()
    found = path.influence @ given_there
    order = np.argsort(KEYS)
    spline = CubicSpline(KEYS[order], given_there[order], bc_type="clamped")
    np.testing.assert_allclose(found[3:56], spline(np.arange(3, 56)), atol=1e-12)
    np.testing.assert_allclose(found[:3], given_there[[1, 1, 1]], atol=1e-12)
    np.testing.assert_allclose(found[56:], given_there[[3, 3, 3, 3]], atol=1e-12)


def stiffness(keys):
    """S: a path through the values y bends by ∫ y''² = yᵀ S y, here by the trapezoid rule."""
    order = np.argsort(keys)
    spline = CubicSpline(keys[order], np.eye(len(keys))[order], bc_type="clamped")
    times = np.linspace(keys.min(), keys.max(), 20001)
    bent = spline(times, 2)
    return np.trapezoid(bent[:, :, None] * bent[:, None, :], times, axis=0)


def test_the_path_is_what_a_gaussian_process_of_its_covariance_predicts():
    path, given_there = SmoothPath(60, KEYS), values()
    covariance, mean = path.covariance(), given_there.mean(axis=0)
    found = mean + covariance @ np.linalg.pinv(covariance[KEYS]) @ (given_there - mean)
    np.testing.assert_allclose(found, path.influence @ given_there, atol=1e-8)
    np.testing.assert_allclose(covariance.sum(axis=1), 0.0, atol=1e-12)
    np.testing.assert_allclose(covariance[KEYS].sum(axis=0), 0.0, atol=1e-12)
    assert covariance[KEYS].diagonal().mean() == pytest.approx(1.0)


def test_covariances_are_sound_for_keys_that_are_near_and_far():
    for frames, keys in ((60, [0, 59]), (5000, [0, 1, 2, 4000]), (5000, range(0, 5000, 20))):
        chosen = np.array(list(keys))
        between_keys = SmoothPath(frames, chosen).covariance()[chosen]
        assert np.linalg.eigvalsh(0.5 * (between_keys + between_keys.T)).min() > -1e-9
        np.testing.assert_allclose(between_keys, between_keys.T, atol=1e-9)


def test_what_a_path_misses_of_the_source_runs_from_nothing_to_its_whole_motion():
    path = SmoothPath(60, KEYS)
    steady = (path.influence @ values(12)).reshape(60, 4, 3)
    noise = np.random.default_rng(1).normal(size=(60, 4, 3))
    still = np.ones((60, 4, 3))
    labels = np.zeros((len(KEYS), 4, 3))
    missed = [path.missed(KeyedPerformance(x, KEYS, labels)) for x in (steady, still, noise)]
    assert missed[0] < 1e-12
    assert missed[1] == 0.0
    assert missed[2] > 0.9


@settings(max_examples=30, deadline=None)
@given(SHARES, SHARES, st.floats(1.01, 3.0))
def test_trust_falls_with_what_the_path_misses_and_rises_with_what_the_map_does(e, d, more):
    trust = trust_in_path(e, d)
    assert 0.0 <= trust_in_path(more * e, d) <= trust <= trust_in_path(e, more * d) <= MOST


def test_trust_at_its_ends():
    assert trust_in_path(0.0, 0.1) == MOST
    assert trust_in_path(0.1, 0.0) == trust_in_path(0.0, 0.0) == 0.0
    assert trust_in_path(1.0, 1e-300) == 0.0


@pytest.mark.parametrize("power", [0.5, 0.7, 1.5, 2.0])
def test_on_slow_ramps_the_default_is_no_worse_than_the_laplacian(power):
    take, truth = ramp(power)
    errors = {
        name: np.linalg.norm(propagate(take, name) - truth) for name in ("residual", "laplacian")
    }
    assert errors["residual"] < errors["laplacian"]


def test_slow_ramps_that_follow_linearly_are_left_to_the_source():
    take, truth = ramp(1.0)
    found = np.linalg.norm(propagate(take) - truth) / np.linalg.norm(truth - truth.mean(axis=0))
    assert found < 1e-3


def test_the_covariance_is_the_pseudo_inverse_of_the_stiffness_carried_to_all_frames():
    path = SmoothPath(60, KEYS)
    between_keys = np.linalg.pinv(stiffness(KEYS), rcond=1e-8, hermitian=True)
    expected = path.influence @ between_keys / between_keys.diagonal().mean()
    np.testing.assert_allclose(path.covariance(), expected, atol=1e-5)


def test_how_far_frames_may_differ_does_not_depend_on_keys_that_come_in_bursts():
    few = np.array([0, 800, 3000, 5200, 8990])
    starts = np.random.default_rng(0).choice(8980, 20)
    bursts = np.unique(np.concatenate([few, *(start + np.arange(6) for start in starts)]))
    differing = []
    for keys in (few, bursts):
        C = SmoothPath(9000, keys).covariance()[few][:, np.searchsorted(keys, few)]
        variances = C.diagonal()
        squared = variances[:, None] + variances - C - C.T
        differing.append(squared / squared[0, -1])
    np.testing.assert_allclose(*differing, atol=1e-11)


def test_a_path_that_misses_a_fifth_of_what_a_map_misses_is_trusted_half():
    assert trust_in_path(0.2 * 0.3, 0.3) == pytest.approx(MOST / 2)
    assert trust_in_path(0.1 * 0.3, 0.3) == pytest.approx(MOST / (1 + 0.5**6))
    assert trust_in_path(0.4 * 0.3, 0.3) == pytest.approx(MOST / (1 + 2.0**6))
    assert MOST == 30.0

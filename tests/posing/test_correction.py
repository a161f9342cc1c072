"""A retargeted pose with some controls set right."""

import numpy as np
import pytest

from facert.data.arrays import rms
from facert.posing.correction import correct
from facert.preprocess.known_poses import Given, KnownPoses

P = 6
FREE = np.tile([-9.0, 9.0], (P, 1))
G = np.array([0, 3])


@pytest.fixture(scope="module")
def world():
    """Known poses of two factors, true poses, and what a model made of them, with its std."""
    rng = np.random.default_rng(0)
    weights = rng.normal(size=(2, P))
    poses, truth = (rng.normal(size=(n, 2)) @ weights for n in (100, 200))
    poses += 0.05 * rng.normal(size=poses.shape)
    predicted = truth + 0.3 * rng.normal(size=(200, 2)) @ weights
    return KnownPoses(poses, FREE), truth, predicted


def corrected(known, start, values, soft=0.0, std=None, samples=0):
    rng = np.random.default_rng(0)
    return correct(start, std, known, Given(G, values, soft), samples, rng)


def test_without_a_change_the_pose_stays(world):
    known, _, predicted = world
    np.testing.assert_allclose(
        corrected(known, predicted[0], predicted[0, G]).pose, predicted[0], atol=1e-12
    )


def test_the_corrections_are_met_and_mend_the_others(world):
    known, truth, predicted = world
    done = np.array([corrected(known, s, t[G]).pose for s, t in zip(predicted, truth, strict=True)])
    assert (done[:, G] == truth[:, G]).all()
    rest = np.setdiff1d(np.arange(P), G)
    assert rms(done[:, rest] - truth[:, rest]) < 0.7 * rms(predicted[:, rest] - truth[:, rest])


@pytest.mark.parametrize("std", [None, np.full(P, 0.1)])
def test_where_no_known_pose_moves_the_others_stay(world, std):
    start = world[1][0]
    moved = corrected(KnownPoses(np.tile(start, (5, 1)), FREE), start, start[G] + 0.1, std=std)
    np.testing.assert_allclose(moved.pose - start, 0.1 * np.isin(np.arange(P), G), atol=1e-12)


def test_a_control_without_error_moves_no_other(world):
    known, _, predicted = world
    certain = np.where(np.isin(np.arange(P), G), 0.0, 0.1)
    moved = corrected(known, predicted[0], predicted[0, G] + 0.1, std=certain).pose - predicted[0]
    np.testing.assert_allclose(moved, 0.1 * np.isin(np.arange(P), G), atol=1e-12)


def test_twice_the_correction_moves_the_others_twice_as_far(world):
    known, _, predicted = world
    once, twice = (
        corrected(known, predicted[0], predicted[0, G] + step).pose - predicted[0]
        for step in (0.1, 0.2)
    )
    np.testing.assert_allclose(twice, 2.0 * once, atol=1e-12)


def test_what_the_model_is_sure_of_stays(world):
    known, _, predicted = world
    std = np.full(P, 0.3)
    std[5] = 1e-6
    moved = corrected(known, predicted[0], predicted[0, G] + 0.5, std=std).pose - predicted[0]
    assert abs(moved[5]) < 1e-4 < np.abs(moved[[1, 2, 4]]).min()


def test_corrections_leave_less_uncertainty_and_soft_ones_are_met_in_part(world):
    known, _, predicted = world
    std = np.full(P, 0.3)
    values = predicted[0, G] + 0.5
    hard, soft = (corrected(known, predicted[0], values, s, std) for s in (0.0, 0.3))
    assert (hard.std[G] == 0.0).all()
    assert (hard.std <= soft.std).all()
    assert (soft.std < std).all()
    assert ((predicted[0, G] < soft.pose[G]) & (soft.pose[G] < values)).all()


def test_samples_spread_by_the_standard_deviation(world):
    known, _, predicted = world
    posed = corrected(known, predicted[0], predicted[0, G] + 0.2, std=np.full(P, 0.3), samples=4000)
    assert (posed.samples[:, G] == posed.pose[G]).all()
    np.testing.assert_allclose(posed.samples.std(axis=0), posed.std, rtol=0.1, atol=1e-12)


def held(known, start, values, held, soft=0.0):
    rng = np.random.default_rng(0)
    return correct(start, None, known, Given(G, values, soft), 5, rng, np.array(held))


def test_what_is_held_stays_and_the_others_follow(world):
    known, _, predicted = world
    free = corrected(known, predicted[0], predicted[0, G] + 0.3)
    for soft in (0.0, 0.1):
        done = held(known, predicted[0], predicted[0, G] + 0.3, [1, 4], soft)
        assert (done.pose[[1, 4]] == predicted[0, [1, 4]]).all()
        assert (done.samples[:, [1, 4]] == predicted[0, [1, 4]]).all()
        assert (done.std[[1, 4]] == 0.0).all()
        assert (np.abs(done.pose - predicted[0])[[2, 5]] > 1e-3).all()
    assert (np.abs(free.pose - predicted[0])[[1, 4]] > 1e-3).all()


def test_what_is_held_makes_nothing_of_the_others_more_certain(world):
    known, _, predicted = world
    free = corrected(known, predicted[0], predicted[0, G] + 0.3)
    done = held(known, predicted[0], predicted[0, G] + 0.3, [1, 4])
    others = [0, 2, 3, 5]
    np.testing.assert_array_equal(done.pose[others], free.pose[others])
    np.testing.assert_array_equal(done.std[others], free.std[others])

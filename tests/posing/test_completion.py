"""A pose completed from some of its controls, in numbers."""

import numpy as np
import pytest
from hypothesis import given as for_all
from hypothesis import strategies as st
from scipy.spatial.distance import cdist

from facert.data.arrays import rms
from facert.posing import pose_regression
from facert.posing.completion import Completion
from facert.posing.pose_regression import PoseRegression
from facert.preprocess.known_poses import MOST, Given, KnownPoses, keep


def sheet(count, seed=0, controls=7):
    """Poses on a folded sheet, with limits at 0 and 1."""
    rng = np.random.default_rng(seed)
    latent = rng.uniform(-1.5, 1.5, size=(count, 2))
    to_poses = np.random.default_rng(1).normal(size=(2, controls))
    noise = 0.03 * rng.normal(size=(count, controls))
    return np.clip(0.4 + 0.4 * np.sin(latent @ to_poses) + noise, 0.0, 1.0)


LIMITS = np.tile([0.0, 1.0], (7, 1))
G = np.array([4, 1, 2])


@pytest.fixture(scope="module")
def known():
    return KnownPoses(sheet(80), LIMITS)


@pytest.fixture(scope="module")
def completion(known):
    return Completion.learn(known, G)


def solved(R, Y, noise):
    return np.linalg.solve(R + noise * np.eye(len(R)), Y)


def test_with_one_noise_the_regression_is_a_gaussian_process(monkeypatch):
    monkeypatch.setattr(pose_regression, "NOISES", np.array([0.1]))
    poses, values = sheet(30), sheet(5, seed=2)[:, :3]
    X, Y = poses[:, :3], poses[:, 3:]
    learned = PoseRegression.learn(X, Y)
    distances = cdist(learned.inputs, learned.inputs)
    products = learned.inputs @ learned.inputs.T
    R = (np.exp(-distances / distances.mean()) + products / products.diagonal().mean()) / 2.0
    np.testing.assert_allclose(learned.weights, solved(R, Y - Y.mean(0), 0.1), atol=1e-10)

    a = (values - X.mean(0)) / learned.scale
    k = np.exp(-cdist(a, learned.inputs) / distances.mean())
    k = (k + a @ learned.inputs.T / products.diagonal().mean()) / 2.0
    expected = Y.mean(0) + k @ solved(R, Y - Y.mean(0), 0.1)
    np.testing.assert_allclose(learned(values), expected, atol=1e-10)


def test_errors_are_those_of_leaving_poses_out(monkeypatch):
    monkeypatch.setattr(pose_regression, "NOISES", np.array([0.1]))
    poses = sheet(25)
    learned = PoseRegression.learn(poses[:, :3], poses[:, 3:])
    Y, inputs = poses[:, 3:] - poses[:, 3:].mean(0), learned.inputs
    R = np.exp(-cdist(inputs, inputs) / learned.distance) + inputs @ inputs.T / learned.product
    for i in (0, 11):
        others = np.delete(np.arange(25), i)
        alpha = solved(R[np.ix_(others, others)] / 2.0, Y[others], 0.1)
        missed = Y[i] - R[i, others] / 2.0 @ alpha
        np.testing.assert_allclose(learned.errors[i], missed, atol=1e-10)


def test_a_control_that_follows_exactly_gets_the_least_noise_and_one_of_noise_the_most():
    rng = np.random.default_rng(0)
    X = rng.uniform(size=(60, 2))
    follows, random = X @ [0.3, 0.5], rng.normal(size=60)
    learned = PoseRegression.learn(X, np.column_stack([follows, random]))
    assert np.abs(learned(X)[:, 0] - follows).max() < 0.01
    assert np.std(learned(X)[:, 1]) < 0.6 * np.std(random)


@pytest.mark.parametrize("power", [-3, 3])
def test_units_of_the_controls_do_not_matter(power):
    poses, values = sheet(40), sheet(5, seed=3)[:, :3]
    unit = 10.0**power
    plain = PoseRegression.learn(poses[:, :3], poses[:, 3:])
    scaled = PoseRegression.learn(unit * poses[:, :3], unit * poses[:, 3:])
    np.testing.assert_allclose(scaled(unit * values), unit * plain(values), rtol=1e-5)


@for_all(st.lists(st.floats(0.0, 1.0), min_size=3, max_size=3), st.integers(0, 2**32 - 1))
def test_hard_values_are_met_exactly_and_nothing_leaves_its_limits(completion, values, seed):
    given = Given(G, np.array(values))
    posed = completion.pose(given, 5, np.random.default_rng(seed))
    for pose in (posed.pose, *posed.samples):
        assert (pose[G] == values).all()
        assert ((pose >= 0.0) & (pose <= 1.0)).all()
    assert (posed.std[G] == 0.0).all()


def test_the_rest_is_nearer_than_by_the_mean_pose_or_the_nearest_one(known, completion):
    test, rest = sheet(200, seed=5), completion.rest
    poses, _ = completion.complete(test[:, G])
    nearest = known.poses[cdist(test[:, G], known.poses[:, G]).argmin(axis=1)]
    missed = rms(poses[:, rest] - test[:, rest])
    assert missed < 0.8 * rms(nearest[:, rest] - test[:, rest])
    assert missed < 0.5 * rms(known.poses.mean(axis=0)[rest] - test[:, rest])


def test_the_std_is_that_of_the_errors(completion):
    test, rest = sheet(300, seed=6), completion.rest
    poses, std = completion.complete(test[:, G])
    assert 1 / 1.5 < rms(poses[:, rest] - test[:, rest]) / rms(std[:, rest]) < 1.5


def test_samples_have_the_mean_and_std_that_are_predicted(known):
    free = Completion.learn(KnownPoses(known.poses, np.tile([-9.0, 9.0], (7, 1))), G)
    given = Given(G, known.poses[3, G])
    posed = free.pose(given, 4000, np.random.default_rng(0))
    np.testing.assert_allclose(posed.samples.std(axis=0), posed.std, rtol=0.1, atol=1e-12)
    np.testing.assert_allclose(posed.samples.mean(axis=0), posed.pose, atol=0.02)


def test_the_same_seed_gives_the_same_samples(completion):
    given = Given(G, np.array([0.3, 0.4, 0.5]), 0.1)
    draws = [completion.pose(given, 3, np.random.default_rng(s)).samples for s in (1, 1, 2)]
    assert (draws[0] == draws[1]).all()
    assert (draws[0] != draws[2]).any()


def test_soft_values_lie_between_what_was_asked_and_what_is_likely(known, completion):
    values = known.poses[:, G].mean(axis=0) + np.array([0.3, 0.0, 0.0])
    rng = np.random.default_rng(0)
    hard, firm, soft, loose = (
        completion.pose(Given(G, values, s), 0, rng) for s in (0.0, 1e-6, 0.2, 1e3)
    )
    np.testing.assert_allclose(firm.pose, hard.pose, atol=1e-4)
    np.testing.assert_allclose(loose.pose[G], known.poses[:, G].mean(axis=0), atol=1e-4)
    assert loose.pose[G[0]] < soft.pose[G[0]] < hard.pose[G[0]]
    assert (soft.std[G] > 0.0).all()
    assert (loose.std[G] > soft.std[G]).all()


def test_soft_values_of_controls_that_go_together_do_not_depend_on_rounding(known):
    rng = np.random.default_rng(0)
    poses = rng.normal(size=(50, 2)) @ rng.normal(size=(2, 7))
    given = np.arange(5)
    together = Completion.learn(KnownPoses(poses, np.tile([-9.0, 9.0], (7, 1))), given)
    firm, firmer = (
        together.pose(Given(given, poses[3, given] + 0.01, soft), 0, rng) for soft in (1e-6, 1e-10)
    )
    np.testing.assert_allclose(firm.pose, firmer.pose, atol=1e-6)


def test_samples_of_soft_values_keep_to_the_limits(known, completion):
    given = Given(G, np.array([0.98, 0.02, 0.5]), 0.3)
    samples = completion.pose(given, 200, np.random.default_rng(0)).samples
    assert ((samples >= 0.0) & (samples <= 1.0)).all()
    assert (np.ptp(samples[:, G], axis=0) > 0.1).all()


def test_the_std_grows_away_from_the_known_poses(known):
    completion = Completion.learn(KnownPoses(known.poses, np.tile([-9.0, 9.0], (7, 1))), G)
    _, std = completion.complete(known.poses[0, G] + np.array([[0.0], [2.0], [4.0]]))
    spread = np.sqrt(np.mean(std[:, completion.rest] ** 2, axis=1))
    assert spread[0] < spread[1] < spread[2]


def test_what_never_moves_predicts_nothing(known):
    poses = known.poses.copy()
    poses[:, 0] = 0.25
    still = Completion.learn(KnownPoses(poses, LIMITS), np.array([0, 1]))
    without = Completion.learn(KnownPoses(poses[:, 1:], LIMITS[1:]), np.array([0]))
    pose, _ = still.complete(np.array([[0.9, 0.4]]))
    expected, _ = without.complete(np.array([[0.4]]))
    np.testing.assert_allclose(pose[0, 1:], expected[0], atol=1e-12)


def test_where_only_still_controls_are_given_the_mean_pose_comes_out(known):
    poses = known.poses.copy()
    poses[:, 0] = 0.25
    pose, std = Completion.learn(KnownPoses(poses, LIMITS), np.array([0])).complete(np.ones((1, 1)))
    np.testing.assert_allclose(pose[0, 1:], poses[:, 1:].mean(axis=0), atol=1e-6)
    np.testing.assert_allclose(std[0, 1:], poses[:, 1:].std(axis=0), rtol=0.05)


def test_every_control_may_be_given(known):
    pose, _ = Completion.learn(known, np.arange(7)).complete(known.poses[:2])
    assert (pose == known.poses[:2]).all()


def test_at_most_so_many_poses_are_kept():
    labels, animation = sheet(20), sheet(2 * MOST, seed=1)
    kept = keep(labels, animation, seed=0)
    assert kept.shape == (MOST, 7)
    assert (kept == keep(labels, animation, seed=0)).all()
    assert (keep(labels, sheet(30, seed=2), seed=0)[:20] == labels).all()
    assert (keep(labels, None, seed=0) == labels).all()
    assert (keep(labels, animation, seed=0)[: len(labels)] == labels).all()

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from facert.mesh.rigid import RigidMotion, align, determined, mean_motion


def some_motion(frames=30, seed=0):
    rng = np.random.default_rng(seed)
    rotations = Rotation.from_rotvec(rng.normal(size=(frames, 3))).as_matrix()
    return RigidMotion(rotations, rng.normal(size=(frames, 3)))


def some_points(count=6, seed=1):
    return np.random.default_rng(seed).normal(size=(count, 3))


def test_a_motion_and_its_inverse_leave_points_where_they_were():
    motion, points = some_motion(), np.random.default_rng(2).normal(size=(30, 6, 3))
    np.testing.assert_allclose(motion.undo(motion.apply(points)), points, atol=1e-12)
    np.testing.assert_allclose(motion.inverse().apply(motion.apply(points)), points, atol=1e-12)


def test_one_motion_after_another_is_both():
    first, second = some_motion(seed=0), some_motion(seed=3)
    points = some_points()
    np.testing.assert_allclose(
        second.after(first).apply(points), second.apply(first.apply(points)), atol=1e-12
    )


def test_matrices_say_the_same_in_homogeneous_coordinates():
    motion, points = some_motion(), some_points()
    homogeneous = np.hstack([points, np.ones((6, 1))])
    moved = homogeneous @ motion.matrices.transpose(0, 2, 1)
    np.testing.assert_allclose(moved[:, :, :3], motion.apply(points), atol=1e-12)


def test_alignment_finds_the_motion_of_a_rigid_shape_whatever_the_weights():
    shape, motion = some_points(), some_motion()
    weights = np.random.default_rng(4).uniform(0.1, 5.0, (30, 6))
    found = align(shape, motion.apply(shape), weights)
    np.testing.assert_allclose(found.rotations, motion.rotations, atol=1e-10)
    np.testing.assert_allclose(found.translations, motion.translations, atol=1e-10)


def test_alignment_agrees_with_scipy_frame_by_frame():
    rng = np.random.default_rng(5)
    shape, weights = some_points(), rng.uniform(0.1, 5.0, (10, 6))
    points = some_motion(10).apply(shape) + 0.1 * rng.normal(size=(10, 6, 3))
    found = align(shape, points, weights)
    for t in range(10):
        centre, rest = (np.average(p, axis=0, weights=weights[t]) for p in (points[t], shape))
        expected, _ = Rotation.align_vectors(points[t] - centre, shape - rest, weights[t])
        np.testing.assert_allclose(found.rotations[t], expected.as_matrix(), atol=1e-9)
        np.testing.assert_allclose(found.translations[t], centre - expected.apply(rest))


def test_points_without_weight_do_not_count():
    shape, motion = some_points(), some_motion()
    points, weights = motion.apply(shape), np.ones((30, 6))
    points[:, 2], weights[:, 2] = np.nan, 0.0
    np.testing.assert_allclose(align(shape, points, weights).rotations, motion.rotations)


def test_a_mirrored_shape_is_met_by_a_rotation_all_the_same():
    shape = some_points()
    found = align(shape, (shape * [-1.0, 1.0, 1.0])[None], np.ones((1, 6)))
    assert np.linalg.det(found.rotations[0]) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("seen", "enough"),
    [([0, 1, 2, 3], True), ([0, 1, 3], True), ([0, 1], False), ([0, 1, 2], False), ([], False)],
)
def test_three_points_not_on_a_line_fix_a_rotation(seen, enough):
    shape = np.array([[0.0, 0, 0], [1, 0, 0], [3, 0, 0], [0, 2, 0]])
    mask = np.zeros((1, 4), dtype=bool)
    mask[0, seen] = True
    assert determined(shape, mask)[0] == enough


def test_unknown_frames_turn_at_an_even_pace_and_the_ends_are_held():
    motion, time = some_motion(10), np.arange(10.0)
    known = np.isin(np.arange(10), [2, 6, 7])
    found = motion.interpolated(time, known)
    between = Slerp([2.0, 6.0], Rotation.from_matrix(motion.rotations[[2, 6]]))
    np.testing.assert_allclose(found.rotations[3], between(3.0).as_matrix())
    np.testing.assert_array_equal(found.rotations[known], motion.rotations[known])
    np.testing.assert_allclose(found.translations[4], motion.translations[[2, 6]].mean(axis=0))
    np.testing.assert_allclose(found.rotations[0], motion.rotations[2])
    np.testing.assert_allclose(found.translations[9], motion.translations[7])


def test_one_known_frame_stands_for_all():
    motion = some_motion(4)
    found = motion.interpolated(np.arange(4.0), np.array([False, True, False, False]))
    np.testing.assert_array_equal(found.rotations, motion.rotations[[1, 1, 1, 1]])


def test_the_mean_of_opposite_turns_is_none():
    turns = Rotation.from_rotvec([[0.3, 0, 0], [-0.3, 0, 0]]).as_matrix()
    found = mean_motion(RigidMotion(turns, np.array([[1.0, 0, 0], [3.0, 0, 0]])))
    np.testing.assert_allclose(found.rotations[0], np.eye(3), atol=1e-12)
    np.testing.assert_allclose(found.translations[0], [2.0, 0, 0])


@pytest.mark.parametrize("count", [1, 2])
def test_with_a_pull_too_few_points_turn_no_further_than_they_must(count):
    shape = np.array([[1.0, 2.0, 3.0], [4.0, 2.0, 3.0]])[:count]
    moved = shape[None] + np.array([0.5, -1.0, 2.0])
    motion = align(shape, moved, np.ones((1, count)), pull=1e-6)
    np.testing.assert_allclose(motion.rotations[0], np.eye(3), atol=1e-9)
    np.testing.assert_allclose(motion.apply(shape), moved, atol=1e-9)


def test_a_small_pull_changes_little_where_points_decide():
    rng = np.random.default_rng(4)
    shape = rng.normal(size=(12, 3))
    turned = shape @ Rotation.from_rotvec([0.3, -0.2, 0.5]).as_matrix().T
    motion = align(shape, turned[None], np.ones((1, 12)), pull=1e-6)
    np.testing.assert_allclose(motion.apply(shape)[0], turned, atol=1e-5)

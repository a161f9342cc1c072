from dataclasses import replace

import numpy as np
import pytest

from facert.data.take import Controls, Source, Take
from facert.errors import InputError
from facert.topology.keyed import KeyedPerformance
from facert.topology.propagated_takes import Propagation, propagate_poses, propagate_positions
from facert.topology.propagation import propagate


@pytest.fixture
def take(make_take):
    """Sixty frames, all posed."""
    return make_take(posed=60, animation=0)


def character(take, names=None):
    """Another face with the same markers, twice as large."""
    markers = 2.0 * take.source.values + 1.0
    return replace(take, source=Source(markers, names or take.source.names), units="m")


def test_poses_of_the_keys_make_all_poses(take):
    keys = range(0, 60, 6)
    result = propagate_poses(take, keys, Propagation(limits="none"))
    np.testing.assert_allclose(result.params[::6], take.params[::6], atol=1e-9)
    assert np.sqrt(np.mean((result.params - take.params) ** 2)) < 0.1 * take.params.std()


def test_other_poses_are_not_looked_at(take):
    keys = [0, 20, 40, 59]
    bare = np.full_like(take.params, np.nan)
    bare[keys] = take.params[keys]
    found = propagate_poses(replace(take, params=bare), keys)
    np.testing.assert_array_equal(found.params, propagate_poses(take, keys).params)


def test_poses_stay_within_declared_limits(take):
    controls = Controls(take.controls.names, [[-0.05, 0.05]] * 4)
    result = propagate_poses(replace(take, controls=controls), range(0, 60, 6))
    assert np.abs(result.params).max() == pytest.approx(0.05)


def test_poses_stay_within_what_is_known_unless_limits_are_given(take):
    keys = [10, 25, 40, 55]
    free = propagate_poses(take, keys, Propagation(limits="none")).params
    low, high = take.params[keys].min(axis=0), take.params[keys].max(axis=0)
    assert ((free < low) | (free > high)).any()
    np.testing.assert_array_equal(propagate_poses(take, keys).params, np.clip(free, low, high))
    declared = propagate_poses(take, keys, Propagation(limits="declared"))
    np.testing.assert_array_equal(declared.params, free)  # none are


def test_old_animation_counts_for_the_range_too(take):
    keys = [10, 25, 40, 55]
    animation = np.vstack([take.params[keys], [[-9.0] * 4, [9.0] * 4]])
    free = propagate_poses(take, keys, Propagation(limits="none"))
    found = propagate_poses(replace(take, animation=animation), keys)
    np.testing.assert_array_equal(found.params, free.params)


def test_feature_points_follow_the_marker_of_their_name(take):
    order = [3, 1, 4, 0, 2]
    target = character(take)
    shuffled = Source(target.source.values[:, order], [target.source.names[i] for i in order])
    result = propagate_positions(take, replace(target, source=shuffled), range(0, 60, 10))
    assert result.source.names == shuffled.names
    assert result.units == "m"
    assert result.params is None
    np.testing.assert_allclose(result.source.values, shuffled.values, atol=1e-6)


def test_without_a_marker_of_their_name_they_follow_the_whole_face(take):
    target = character(take, [f"other{i}" for i in range(5)])
    keys = np.arange(0, 60, 6)
    found = propagate_positions(take, target, keys, Propagation("affine"))
    flat = take.source.matrix[:, None, :]
    labels = target.source.matrix[keys][:, None, :]
    expected = propagate(KeyedPerformance(flat, keys, labels), "affine")[:, 0]
    np.testing.assert_allclose(found.source.matrix, expected, atol=1e-12)


def test_hidden_markers_are_filled(take):
    values = take.source.values.copy()
    values[np.random.default_rng(0).random(values.shape[:2]) < 0.1] = np.nan
    holed = replace(take, source=Source(values, take.source.names))
    keys = range(0, 60, 6)
    whole, found = propagate_poses(take, keys), propagate_poses(holed, keys)
    assert np.sqrt(np.mean((found.params - whole.params) ** 2)) < 0.1 * take.params.std()


def test_bad_input_is_named(take):
    with pytest.raises(InputError, match=r"--keys.*0 to 59"):
        propagate_poses(take, [0, 60])
    with pytest.raises(InputError, match="2 key frames or more"):
        propagate_poses(take, [5])
    half = take.params.copy()
    half[10:] = np.nan
    with pytest.raises(InputError, match="none in frame 20"):
        propagate_poses(replace(take, params=half), [0, 20])
    with pytest.raises(InputError, match="/target/params"):
        propagate_poses(replace(take, params=None), [0, 20])
    lost = take.source.values.copy()
    lost[:, 2] = np.nan
    with pytest.raises(InputError, match="'m2' in none"):
        propagate_poses(replace(take, source=Source(lost, take.source.names)), [0, 20])
    short = Take(time=take.time[:10], source=Source(take.source.values[:10], take.source.names))
    with pytest.raises(InputError, match="60 frames"):
        propagate_positions(take, short, [0, 5])
    gap = character(take).source.values.copy()
    gap[20, 1] = np.nan
    with pytest.raises(InputError, match="none in frame 20"):
        propagate_positions(take, replace(take, source=Source(gap, take.source.names)), [0, 20])

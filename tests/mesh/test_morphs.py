"""A mesh in motion as morph targets is the same motion."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from facert.data.rig import Mesh, MeshSequence, Rig
from facert.errors import InputError
from facert.mesh.morphs import Morphs, compact_morphs, moving_morphs, rig_morphs

RNG = np.random.default_rng(0)
MESH = Mesh(RNG.normal(size=(40, 3)), np.array([[0, 1, 2]]), "cm")


def sequence_of(moved: np.ndarray) -> MeshSequence:
    vertices = MESH.vertices + moved
    return MeshSequence(MESH, np.arange(len(moved)) / 30, lambda rows: vertices[rows])


def motion_of_rank(rank: int, frames: int, seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return np.einsum("tk,kvc->tvc", rng.normal(size=(frames, rank)), rng.normal(size=(rank, 40, 3)))


def played(morphs: Morphs) -> np.ndarray:
    return morphs.neutral.vertices + np.einsum("tk,kvc->tvc", morphs.weights, morphs.targets)


def farthest(moved: np.ndarray) -> float:
    return float(np.linalg.norm(moved, axis=-1).max())


@settings(max_examples=20, deadline=None)
@given(st.integers(1, 150), st.floats(1e-6, 0.3), st.integers(0, 9))
def test_no_vertex_is_off_by_more_than_promised(frames: int, tolerance: float, seed: int) -> None:
    moved = motion_of_rank(90, frames, seed) * np.geomspace(1, 1e-4, 40)[:, None]
    morphs = compact_morphs(sequence_of(moved), tolerance)
    off = farthest(played(morphs) - MESH.vertices - moved)
    assert off <= morphs.error + 1e-9
    assert morphs.error <= tolerance * farthest(moved) + 1e-9


def test_a_motion_of_few_directions_needs_no_more_targets() -> None:
    morphs = compact_morphs(sequence_of(motion_of_rank(6, 300)))
    assert len(morphs.targets) == 6
    assert len(set(morphs.names)) == 6


def test_a_larger_tolerance_needs_fewer_targets() -> None:
    moved = motion_of_rank(90, 200) * np.geomspace(1, 1e-4, 40)[:, None]
    counts = [len(compact_morphs(sequence_of(moved), one).targets) for one in (1e-3, 1e-2, 1e-1)]
    assert counts == sorted(counts, reverse=True)
    assert counts[0] > counts[-1]


def test_a_blink_in_a_single_frame_is_kept() -> None:
    moved = motion_of_rank(12, 300)
    moved[7, 3] += [0.0, 0.5 * farthest(moved), 0.0]
    morphs = compact_morphs(sequence_of(moved), 0.05)
    assert farthest((played(morphs) - MESH.vertices - moved)[7, 3]) <= 0.05 * farthest(moved)


def test_weights_run_to_one() -> None:
    morphs = compact_morphs(sequence_of(motion_of_rank(6, 50)))
    np.testing.assert_allclose(morphs.weights.max(axis=0), 1)
    assert np.abs(morphs.weights).max() <= 1 + 1e-12


def test_a_mesh_that_rests_has_targets_that_do_nothing() -> None:
    morphs = compact_morphs(sequence_of(np.zeros((5, 40, 3))))
    assert morphs.error == 0
    np.testing.assert_array_equal(played(morphs), np.tile(MESH.vertices, (5, 1, 1)))


def test_a_rig_keeps_its_shapes_and_those_that_rest_can_be_left_out() -> None:
    rig = Rig(MESH.vertices, RNG.normal(size=(3, 40, 3)), ("a", "b", "c"), MESH.faces)
    params = np.array([[0.5, 0, 1], [np.nan] * 3, [0.25, 0, 0]])
    morphs = rig_morphs(rig, params, np.array([0.0, 0.1, 0.2]))
    assert morphs.names == ("a", "b", "c")
    morphs = moving_morphs(morphs)
    assert morphs.names == ("a", "c")
    np.testing.assert_array_equal(morphs.time, [0, 0.2])
    np.testing.assert_allclose(played(morphs), rig.deform(params[[0, 2]]), atol=1e-12)


def test_a_rig_without_a_pose_is_refused() -> None:
    rig = Rig(MESH.vertices, RNG.normal(size=(1, 40, 3)), ("a",), MESH.faces)
    with pytest.raises(InputError, match="/target/params"):
        rig_morphs(rig, np.full((2, 1), np.nan), np.arange(2.0))


def test_many_frames_of_a_small_mesh_are_fetched_at_once() -> None:
    """Of a triangle there are nine directions, in however many frames."""
    frames, asked = 100_000, []
    mesh = Mesh(np.eye(3), np.array([[0, 1, 2]]))
    moved = mesh.vertices * np.linspace(1, 2, frames)[:, None, None]

    def fetch(rows: np.ndarray) -> np.ndarray:
        asked.append(len(rows))
        return moved[rows]

    tracemalloc.start()
    morphs = compact_morphs(MeshSequence(mesh, np.arange(frames) / 30, fetch))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert len(morphs.targets) == 1
    assert len(asked) < 20
    assert peak < 6 * moved.nbytes

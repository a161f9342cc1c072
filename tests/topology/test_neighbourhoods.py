import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from facert.errors import InputError
from facert.topology.neighbourhoods import (
    Neighbourhoods,
    adjacency,
    mesh_rings,
    temporal_windows,
)


def lists(neighbourhoods: Neighbourhoods) -> list[list[int]]:
    parts = np.split(neighbourhoods.members, np.cumsum(neighbourhoods.sizes)[:-1])
    return [sorted(part.tolist()) for part in parts]


@given(frames=st.integers(1, 40), reach=st.integers(1, 12))
def test_a_window_holds_the_frames_around_each_frame(frames, reach):
    found = lists(temporal_windows(frames, 2 * reach + 1))
    for frame, window in enumerate(found):
        assert window == list(range(max(0, frame - reach), min(frames, frame + reach + 1)))


@pytest.mark.parametrize("width", [0, 1, 4, -3])
def test_a_window_has_a_middle(width):
    with pytest.raises(InputError, match="odd"):
        temporal_windows(10, width)


def test_the_ring_of_a_vertex_is_itself_and_its_edges():
    faces = np.array([[0, 1, 2], [1, 3, 2]])
    assert lists(mesh_rings(faces, 4)) == [[0, 1, 2], [0, 1, 2, 3], [0, 1, 2, 3], [1, 2, 3]]


def test_doubled_degenerate_and_non_manifold_faces_change_nothing_else():
    plain = np.array([[0, 1, 2], [1, 3, 2]])
    doubled = np.concatenate([plain, plain, [[0, 0, 1]]])
    assert lists(mesh_rings(doubled, 4)) == lists(mesh_rings(plain, 4))
    three_at_an_edge = np.array([[0, 1, 2], [0, 1, 3], [0, 1, 4]])
    assert lists(mesh_rings(three_at_an_edge, 5))[0] == [0, 1, 2, 3, 4]


def test_a_vertex_without_a_face_is_alone():
    rings = mesh_rings(np.array([[0, 1, 2]]), 5)
    assert lists(rings)[3:] == [[3], [4]]
    assert rings.components.tolist() == [0, 0, 0, 1, 2]


def test_adjacency_is_symmetric_without_loops(sheet):
    points, faces = sheet
    A = adjacency(faces, len(points)).toarray()
    assert (A == A.T).all()
    assert not A.diagonal().any()
    assert set(np.unique(A)) == {0.0, 1.0}


def test_components_are_what_neighbourhoods_join(two_sheets):
    points, faces = two_sheets
    components = mesh_rings(faces, len(points)).components
    assert components.tolist() == [0] * 72 + [1] * 72
    chain = Neighbourhoods(5, np.array([0, 1, 2, 3, 1, 3, 4]), np.array([2, 2, 2, 1]))
    assert chain.components.tolist() == [0, 0, 0, 0, 1]


def test_groups_by_size_hold_every_neighbourhood_once(sheet):
    points, faces = sheet
    rings = mesh_rings(faces, len(points))
    grouped = [sorted(row) for members in rings.by_size() for row in members.tolist()]
    assert sorted(grouped) == sorted(lists(rings))


def test_faces_use_vertices_that_exist():
    with pytest.raises(InputError, match="/faces"):
        mesh_rings(np.array([[0, 1, 7]]), 4)

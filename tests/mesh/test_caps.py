import numpy as np

from facert.mesh.caps import caps_of

SIZE = 11


def bowl(open_middle: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """A square of quads that bulges to the viewer, perhaps with a hole of four quads in it."""
    x, y = (axis.ravel() for axis in np.meshgrid(np.arange(SIZE) - 5.0, np.arange(SIZE) - 5.0))
    corners = np.flatnonzero((x < 5) & (y < 5))
    if open_middle:
        corners = np.flatnonzero((x < 5) & (y < 5) & (np.maximum(abs(x + 0.5), abs(y + 0.5)) > 1))
    a, b, c, d = corners, corners + 1, corners + SIZE + 1, corners + SIZE
    faces = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    return np.column_stack([x, y, -0.05 * (x * x + y * y)]), faces


def test_a_hole_is_closed_and_an_outline_is_not() -> None:
    vertices, faces = bowl(open_middle=True)
    caps = caps_of(vertices, faces)
    assert caps.edges.shape == (8, 2)
    assert np.abs(vertices[caps.edges.ravel(), :2]).max() == 1.0
    np.testing.assert_allclose(caps.middles(vertices)[0, :2], 0.0, atol=1e-12)
    closed = np.concatenate([vertices, caps.middles(vertices)])[caps.faces(len(vertices))]
    normals = np.cross(closed[:, 1] - closed[:, 0], closed[:, 2] - closed[:, 0])
    assert (normals[:, 2] > 0).all()  # wound like the mesh
    assert not len(caps_of(*bowl()).edges)


def test_the_middle_goes_with_the_hole() -> None:
    vertices, faces = bowl(open_middle=True)
    caps = caps_of(vertices, faces)
    np.testing.assert_allclose(caps.middles(vertices + 3.0), caps.middles(vertices) + 3.0)


def test_a_seam_of_two_vertices_at_one_place_is_no_hole() -> None:
    vertices, faces = bowl()
    split = np.concatenate([vertices, vertices[60:61]])
    left = (faces == 60).any(axis=1) & (faces <= 60).all(axis=1)
    faces[left] = np.where(faces[left] == 60, len(vertices), faces[left])
    assert left.any()
    assert not len(caps_of(split, faces).edges)


def test_a_closed_mesh_and_none_have_no_holes() -> None:
    tetrahedron = np.array([[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]])
    caps = caps_of(np.eye(4)[:, :3], tetrahedron)
    assert caps.faces(4).shape == (0, 3)
    assert caps.middles(np.eye(4)[:, :3]).shape == (0, 3)
    assert not len(caps_of(np.zeros((3, 3)), np.empty((0, 3), dtype=np.int64)).edges)

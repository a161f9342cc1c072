import numpy as np
import pytest

from facert.topology import laplacian


def test_energies_are_symmetric_semidefinite_and_blind_to_constants(sheet):
    points, faces = sheet
    for energy in (
        laplacian.uniform_energy(points, faces),
        laplacian.cotangent_energy(points, faces),
        laplacian.biharmonic_energy(points, faces),
        laplacian.path_energy(30),
    ):
        dense = energy.toarray()
        np.testing.assert_allclose(dense, dense.T, atol=1e-12)
        assert np.linalg.eigvalsh(dense).min() > -1e-10
        np.testing.assert_allclose(dense.sum(axis=0), 0, atol=1e-10)


def test_on_a_flat_grid_cotangent_weights_are_the_textbooks():
    vertices = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, 0]], dtype=float)
    faces = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])
    C, areas = laplacian.cotangent_matrix(vertices, faces)
    expected = np.diag([1, 1, 1, 1, 4.0])  # the right angle at the centre: no weight on the sides
    expected[4, :4] = expected[:4, 4] = -1
    np.testing.assert_allclose(C.toarray(), expected, atol=1e-6)
    assert areas.sum() == pytest.approx(1)


def test_the_bending_energy_does_not_change_with_the_unit(sheet):
    points, faces = sheet
    energies = [laplacian.biharmonic_energy(s * points, faces).toarray() for s in (1.0, 40.0)]
    np.testing.assert_allclose(energies[1] * 40.0**0, energies[0], rtol=1e-6, atol=1e-9)


def test_a_frame_lies_between_its_neighbours():
    L = laplacian.path_laplacian(4).toarray()
    expected = [[1, -1, 0, 0], [-0.5, 1, -0.5, 0], [0, -0.5, 1, -0.5], [0, 0, -1, 1]]
    np.testing.assert_array_equal(L, expected)
    assert not laplacian.path_laplacian(1).toarray().any()


def test_vertices_that_no_face_uses_have_no_weight(sheet):
    points, faces = sheet
    more = np.concatenate([[[9.0, 9, 9]], points])
    C, areas = laplacian.cotangent_matrix(more, faces + 1)
    plain, _ = laplacian.cotangent_matrix(points, faces)
    assert areas[0] == 0
    np.testing.assert_allclose(C.toarray()[1:, 1:], plain.toarray(), atol=1e-12)


def test_cotangent_and_bending_energies_are_those_of_their_operators(sheet):
    """L = diag(C)⁻¹ C in LᵀL; C M⁻¹ C times the mean area."""
    points, faces = sheet
    C, areas = laplacian.cotangent_matrix(points, faces)
    C = C.toarray()
    L = C / C.diagonal()[:, None]
    energy = laplacian.cotangent_energy(points, faces).toarray()
    np.testing.assert_allclose(energy, L.T @ L, atol=1e-12)
    bending = laplacian.biharmonic_energy(points, faces).toarray()
    np.testing.assert_allclose(bending, areas.mean() * C @ np.diag(1.0 / areas) @ C, atol=1e-12)

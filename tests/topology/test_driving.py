from dataclasses import replace

import numpy as np
import pytest

from facert.data.take import Source
from facert.errors import InputError
from facert.io.formats import read_rig_file, read_take_file
from facert.mesh.capture import simulate_capture
from facert.topology.driving import METHODS, FaceDriver
from facert.topology.suggested_points import suggest_points

LABELLED = np.array([0, 7, 64, 71, 27, 30, 44])
LINEAR = [name for name, method in METHODS.items() if method.displacements]
ENERGIES = [name for name in LINEAR if METHODS[name].energy]


SHIFT = np.array([5.0, -3.0, 2.0])


def moved(points, seed=0, frames=3):
    displacement = 0.3 * np.random.default_rng(seed).normal(size=(frames, len(LABELLED), 3))
    return points[LABELLED] + displacement


@pytest.mark.parametrize("method", LINEAR)
def test_a_face_whose_points_rest_rests(sheet, method):
    points, faces = sheet
    driver = FaceDriver(points, faces, LABELLED, method)
    np.testing.assert_allclose(driver.deform(points[None, LABELLED])[0], points, atol=1e-9)


def test_equation_9_on_positions_drifts_at_rest(sheet):
    points, faces = sheet
    literal = FaceDriver(points, faces, LABELLED, "literal").deform(points[None, LABELLED])[0]
    np.testing.assert_allclose(literal[LABELLED], points[LABELLED], atol=1e-9)
    assert np.abs(literal - points).max() > 0.05


def energies(points, faces):
    """B of Algorithm 1 as it is printed, and LᵀL with L = I - D⁻¹A."""
    joined = np.zeros((len(points), len(points)))
    for face in faces:
        joined[np.ix_(face, face)] = 1.0
    B = np.zeros_like(joined)
    for members in map(np.flatnonzero, joined):
        local = points[members] - points[members].mean(axis=0)
        g, _, _ = np.linalg.svd(local, full_matrices=False)
        G = np.column_stack([np.full(len(local), len(local) ** -0.5), g[:, :2]])
        B[np.ix_(members, members)] += np.eye(len(local)) - G @ G.T
    A = joined - np.eye(len(points))
    L = np.eye(len(points)) - A / A.sum(axis=1, keepdims=True)
    return B, L.T @ L


@pytest.mark.parametrize(
    ("method", "of_framework", "of_laplacian"),
    [("framework", 1.0, 0.0), ("smooth", 1.0, 0.3), ("laplacian", 0.0, 1.0)],
)
def test_displacements_have_the_least_energy_that_meets_the_points(
    sheet, method, of_framework, of_laplacian
):
    """The default weighs the uniform Laplacian by 0.3, whatever the mesh and its unit."""
    points, faces = sheet
    given = moved(points, frames=1)
    B, squared = energies(points, faces)
    energy, free = of_framework * B + of_laplacian * squared, np.delete(np.arange(72), LABELLED)
    expected = points.copy()
    expected[LABELLED] = given[0]
    pull = energy[np.ix_(free, LABELLED)] @ (given[0] - points[LABELLED])
    expected[free] -= np.linalg.solve(energy[np.ix_(free, free)], pull)
    found = FaceDriver(points, faces, LABELLED, method).deform(given)[0]
    np.testing.assert_allclose(found, expected, atol=1e-8)


@pytest.mark.parametrize("method", list(METHODS))
def test_points_are_met_and_moved_with_the_whole_face(sheet, method):
    points, faces = sheet
    driver, given = FaceDriver(points, faces, LABELLED, method), moved(points)
    deformed = driver.deform(given)
    np.testing.assert_allclose(deformed[:, LABELLED], given, atol=1e-8)
    shifted = driver.deform(given + SHIFT)
    np.testing.assert_allclose(shifted, deformed + SHIFT, atol=1e-8)


@pytest.mark.parametrize("method", ENERGIES)
def test_how_the_face_lies_and_in_what_unit_does_not_matter(sheet, turn, method):
    points, faces = sheet
    given = moved(points)
    deformed = FaceDriver(points, faces, LABELLED, method).deform(given)
    place = lambda x: 25.0 * x @ turn + [1.0, 2.0, 3.0]  # noqa: E731
    placed = FaceDriver(place(points), faces, LABELLED, method).deform(place(given))
    np.testing.assert_allclose(placed, place(deformed), atol=25 * 1e-8)


@pytest.mark.parametrize("method", ENERGIES)
def test_the_order_of_vertices_and_of_points_does_not_matter(sheet, method):
    points, faces = sheet
    given = moved(points)
    deformed = FaceDriver(points, faces, LABELLED, method).deform(given)
    order = np.random.default_rng(3).permutation(len(points))
    place, mixed = np.argsort(order), np.array([3, 1, 0, 6, 2, 5, 4])
    shuffled = FaceDriver(points[order], place[faces], place[LABELLED[mixed]], method)
    np.testing.assert_allclose(shuffled.deform(given[:, mixed]), deformed[:, order], atol=1e-8)


def test_all_frames_at_once_are_each_frame_alone(sheet):
    points, faces = sheet
    driver, given = FaceDriver(points, faces, LABELLED), moved(points)
    for together, alone in zip(driver.deform(given), given, strict=True):
        np.testing.assert_allclose(together, driver.deform(alone[None])[0], atol=1e-12)


def test_without_the_influence_matrix_the_face_is_the_same(sheet, monkeypatch):
    points, faces = sheet
    given = moved(points)
    dense = FaceDriver(points, faces, LABELLED).deform(given)
    monkeypatch.setattr("facert.topology.driving.DENSE", 0)
    sparse = FaceDriver(points, faces, LABELLED).deform(given)
    np.testing.assert_allclose(sparse, dense, atol=1e-10)


def test_a_part_without_points_is_refused_or_carried_rigidly(two_sheets):
    points, faces = two_sheets
    with pytest.raises(InputError, match=r"point 72 \(72 in all\)"):
        FaceDriver(points, faces, LABELLED)
    driver = FaceDriver(points, faces, LABELLED, loose="carry")
    deformed = driver.deform(moved(points))
    lengths = [np.linalg.norm(x[72:] - x[72], axis=1) for x in (points, *deformed)]
    for carried in lengths[1:]:
        np.testing.assert_allclose(carried, lengths[0], atol=1e-9)


def test_what_is_carried_turns_with_a_face_that_turns(two_sheets, turn):
    points, faces = two_sheets
    driver = FaceDriver(points, faces, np.arange(72), loose="carry")
    turned = points @ turn + [1.0, 2.0, 3.0]
    np.testing.assert_allclose(driver.deform(turned[None, :72])[0], turned, atol=1e-4)
    np.testing.assert_allclose(driver.deform(points[None, :72])[0], points, atol=1e-9)


def test_what_is_carried_follows_the_vertices_that_are_nearest_to_it(sheet):
    """Not the far corner, which alone moves."""
    points, faces = sheet
    above = points[[0, 1, 8]] + [0.0, 0.0, 0.2]
    labelled = np.append(LABELLED, [1, 8])
    driver = FaceDriver(
        np.vstack([points, above]), np.vstack([faces, [[72, 73, 74]]]), labelled, loose="carry"
    )
    given = points[labelled].copy()
    given[list(labelled).index(71)] += [0.0, 0.0, 3.0]
    (deformed,) = driver.deform(given[None])
    assert np.abs(deformed[:72] - points).mean() > 0.1
    np.testing.assert_allclose(deformed[72:], above, atol=1e-4)


def test_radial_functions_need_no_mesh_and_reach_every_part(two_sheets):
    points, faces = two_sheets
    deformed = FaceDriver(points, faces, LABELLED, "rbf-linear").deform(moved(points))
    assert np.isfinite(deformed).all()


def test_a_non_manifold_face_and_a_vertex_without_a_face(sheet):
    points, faces = sheet
    fin = np.concatenate([faces, [[0, 1, 20]]])  # a third triangle at the edge 0-1
    alone = np.concatenate([points, [[50.0, 0.0, 0.0]]])
    for method in ENERGIES:
        deformed = FaceDriver(points, fin, LABELLED, method).deform(moved(points))
        assert np.isfinite(deformed).all()
    with pytest.raises(InputError, match=r"point 72 \(1 in all\)"):
        FaceDriver(alone, fin, LABELLED)
    carried = FaceDriver(alone, fin, LABELLED, loose="carry").deform(moved(points))
    assert np.isfinite(carried).all()


def test_bad_input_is_named(sheet):
    points, faces = sheet
    with pytest.raises(InputError, match="one of smooth, framework"):
        FaceDriver(points, faces, LABELLED, "magic")
    with pytest.raises(InputError, match=r"labels.*from 0 to 71"):
        FaceDriver(points, faces, np.array([0, 99]))
    with pytest.raises(InputError, match="7 twice"):
        FaceDriver(points, faces, np.array([0, 7, 7]))
    with pytest.raises(InputError, match="/neutral"):
        FaceDriver(np.where(points == points[0], np.nan, points), faces, LABELLED)
    with pytest.raises(InputError, match="span space"):
        FaceDriver(points, faces, LABELLED[:2], "rbf-thin-plate")
    driver = FaceDriver(points, faces, LABELLED)
    with pytest.raises(InputError, match="NaN"):
        driver.deform(np.full((1, 7, 3), np.nan))
    with pytest.raises(InputError, match=r"\(T, 7, 3\)"):
        driver.deform(points[None])


@pytest.mark.real
def test_recorded_expressions_are_followed_best_by_the_default(real_data):
    rig = read_rig_file(real_data / "rigs" / "ict_face.npz")
    recorded = read_take_file(real_data / "recordings" / "rom.csv")
    points = suggest_points(rig, 40)
    frames = recorded.source.values[100:2500:200]
    take = replace(recorded, source=Source(frames, recorded.source.names), time=np.arange(12.0))
    truth = simulate_capture(rig, take, vertices=np.arange(len(rig.neutral))).source.values

    def error(method):
        driver = FaceDriver(rig.neutral, rig.faces, points, method)
        return np.sqrt(np.mean((driver.deform(truth[:, points]) - truth) ** 2))

    default = error("smooth")
    assert default < 0.7 * error("rbf-linear")
    assert default < 0.8 * error("laplacian")

import numpy as np
import pytest

from facert.data.take import Source, Take
from facert.errors import InputError
from facert.io.formats import read_take_file
from facert.mesh.rigid import align
from facert.preprocess.head_motion import stabilise, stable_markers

STABLE = [f"m{i}" for i in range(8)]


def off(found, truth):
    """RMS distance after one rigid motion for all frames: where the head rests is a choice."""
    one = align(truth.reshape(-1, 3), found.reshape(1, -1, 3), np.ones((1, truth.size // 3)))
    back = one.undo(found.reshape(1, -1, 3)).reshape(truth.shape)
    return np.sqrt(np.mean((back - truth) ** 2))


def test_head_motion_is_removed_and_handed_back(face, head, as_take):
    moved = head.apply(face)
    found = stabilise(as_take(moved), STABLE)
    assert off(found.take.source.values, face) < 0.01
    np.testing.assert_allclose(found.head.apply(found.take.source.values), moved, atol=1e-9)
    assert found.names == tuple(STABLE)
    assert not found.interpolated.any()
    assert found.residual < 0.05


def test_the_motion_is_recovered_to_the_noise(face, head, as_take):
    noise = 0.02 * np.random.default_rng(0).normal(size=face.shape)
    still = face.copy()
    still[:, :8] = face[:1, :8]
    found = stabilise(as_take(head.apply(still + noise)), STABLE)
    assert off(found.take.source.values, still) < 2 * 0.02


def test_automatic_choice_finds_the_markers_that_do_not_move(face, head, as_take):
    found = stabilise(as_take(head.apply(face)))
    assert set(found.names) <= set(STABLE)
    assert off(found.take.source.values, face) < 0.01


def test_stable_markers_do_not_depend_on_units_or_head(face, head):
    chosen = stable_markers(face)
    np.testing.assert_array_equal(stable_markers(1000.0 * head.apply(face)), chosen)


def test_a_take_without_head_motion_keeps_its_motion(face, as_take):
    found = stabilise(as_take(face), STABLE)
    np.testing.assert_allclose(found.take.source.values, face, atol=0.05)
    assert found.head.degrees.max() < 1.0


def test_stabilising_again_changes_nothing(face, head, as_take):
    once = stabilise(as_take(head.apply(face)), STABLE).take
    twice = stabilise(once, STABLE).take
    np.testing.assert_allclose(twice.source.values, once.source.values, atol=1e-3)


def test_every_frame_gets_the_pose_of_the_reference_frame(face, head, as_take):
    moved = head.apply(face)
    found = stabilise(as_take(moved), STABLE, reference=7)
    np.testing.assert_allclose(found.take.source.values[7], moved[7], atol=1e-12)
    np.testing.assert_allclose(found.head.matrices[7], np.eye(4), atol=1e-12)


@pytest.mark.parametrize("stable", [STABLE, "automatic"])
def test_two_takes_get_the_same_head_pose_when_one_is_like_the_other(face, head, as_take, stable):
    one = stabilise(as_take(head.apply(face)[:200]), stable).take
    other = stabilise(as_take(head.apply(face)[200:]), stable, reference=one)
    together = np.concatenate([one.source.values, other.take.source.values])
    assert off(together, face) < 0.02
    np.testing.assert_allclose(
        other.head.apply(other.take.source.values), head.apply(face)[200:], atol=1e-9
    )
    if stable == "automatic":
        assert set(other.names) == set(stabilise(one).names)


def test_gaps_and_gross_errors_of_stable_markers_hardly_matter(face, head, as_take):
    rng = np.random.default_rng(3)
    moved = head.apply(face)
    moved[rng.random(moved.shape[:2]) < 0.2] = np.nan
    moved[50:60, 0] += 10.0
    found = stabilise(as_take(moved), STABLE)
    inside = ~np.isnan(moved[:, 8:])
    kept = found.take.source.values[:, 8:][inside].reshape(-1, 3)
    assert off(kept[None], face[:, 8:][inside].reshape(1, -1, 3)) < 0.03


def test_frames_that_show_too_few_get_the_motion_of_their_neighbours(face, head, as_take):
    moved = head.apply(face)
    moved[100:104, 2:8] = np.nan
    found = stabilise(as_take(moved), STABLE)
    np.testing.assert_array_equal(np.flatnonzero(found.interpolated), [100, 101, 102, 103])
    assert off(found.take.source.values[:, 8:], face[:, 8:]) < 0.05


def on_a_line(markers):
    """The first three markers on a line."""
    changed = markers.copy()
    changed[:, 2] = 2.0 * changed[:, 1] - changed[:, 0]
    return changed


@pytest.mark.parametrize(
    ("stable", "reference", "word"),
    [
        (["m0", "m1"], "mean", "three markers"),
        (["m0", "m1", "m99"], "mean", "m99"),
        (["m0", "m1", "m2"], "mean", "not on a line"),
        (STABLE, 400, "0 to 399"),
        (STABLE, 5, "shows too few"),
    ],
)
def test_what_cannot_be_done_is_refused(face, as_take, stable, reference, word):
    markers = on_a_line(face)
    markers[5] = np.nan
    with pytest.raises(InputError, match=word):
        stabilise(as_take(markers), stable, reference)


def test_markers_that_were_never_seen_are_refused_or_passed_over(face, as_take):
    markers = face.copy()
    markers[:, 0] = np.nan
    with pytest.raises(InputError, match="never was"):
        stabilise(as_take(markers), STABLE)
    assert "m0" not in stabilise(as_take(markers)).names


def test_weights_have_no_head_motion():
    take = Take(np.arange(5.0), Source(np.random.default_rng(0).random((5, 3)), ["a", "b", "c"]))
    with pytest.raises(InputError, match="weights"):
        stabilise(take)


@pytest.mark.real
@pytest.mark.parametrize("name", ["cheeks", "eyebrows"])
def test_real_markers_come_out_as_those_that_others_stabilised(real_data, name):
    raw = read_take_file(real_data / "markers" / f"{name}.npz")
    track = read_take_file(real_data / "tracks" / f"optical_{name}.npz", target="solved")
    chosen = ("ForeHead_M", "ForeHead_L", "ForeHead_R", "NoseTop")
    truth = track.source.values
    left = off(stabilise(raw, chosen).take.source.values, truth)
    assert left < 0.02 * truth.std(axis=0).max()
    automatic = off(stabilise(raw).take.source.values, truth)
    assert automatic < 0.7 * off(raw.source.values, truth)


def test_a_marker_that_strays_in_a_few_frames_is_as_stable_as_before(face):
    """In fewer than the twentieth that does not count at either end."""
    strayed, rng = face.copy(), np.random.default_rng(0)
    for marker in (1, 4, 6):
        strayed[rng.permutation(400)[:8], marker] += 5.0
    assert set(stable_markers(strayed)) <= set(range(8))


def test_markers_whose_squares_are_no_numbers_are_refused(face, as_take):
    with pytest.raises(InputError, match="/source/markers: expected numbers of a sensible size"):
        stabilise(as_take(face * 1e300), STABLE)

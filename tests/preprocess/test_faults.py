import numpy as np
import pytest

from facert.data.take import Source
from facert.errors import InputError
from facert.io.formats import read_take_file
from facert.preprocess.faults import (
    exchanged,
    find_faults,
    held_values,
    single_spikes,
    without_faults,
)


def source(markers):
    return Source(markers, [f"m{i}" for i in range(markers.shape[1])])


def at(shape, *places):
    mask = np.zeros(shape[:2], dtype=bool)
    for frames, marker in places:
        mask[frames, marker] = True
    return mask


def test_a_clean_take_has_no_faults(face, head):
    for markers in (face, head.apply(face), np.round(face, 2)):
        assert str(find_faults(source(markers))) == "none"


def test_gaps_and_noise_are_no_faults(face):
    rng = np.random.default_rng(0)
    noisy = face + 0.05 * rng.normal(size=face.shape)
    noisy[rng.random(face.shape[:2]) < 0.3] = np.nan
    assert find_faults(source(noisy)).any.mean() < 1e-3


@pytest.mark.parametrize("scale", [1e20, 1e150, 1e300])
def test_a_take_of_absurd_size_is_refused_before_anything_is_searched(face, scale):
    for values in (face * scale, face[:, :, 0] * scale):
        with pytest.raises(InputError, match=r"/source/(markers|weights): expected numbers of a"):
            find_faults(source(values))
    spiked = face.copy()
    spiked[3, 2] = scale
    assert find_faults(source(spiked)).any[3, 2]


def test_the_origin_is_no_place_for_a_marker(face):
    markers = face.copy()
    markers[10:20, 3] = 0.0
    markers[5, 4, 0] = 0.0  # one coordinate may be
    np.testing.assert_array_equal(
        find_faults(source(markers)).zero, at(face.shape, (slice(10, 20), 3))
    )


def test_a_held_value_is_frozen_but_for_its_first_frame(face):
    markers = face.copy()
    markers[100:131, 12] = markers[100, 12]
    markers[380:, 15] = markers[380, 15]
    expected = at(face.shape, (slice(101, 131), 12), (slice(381, 400), 15))
    np.testing.assert_array_equal(find_faults(source(markers)).frozen, expected)


def test_doubled_frames_and_rests_are_not_frozen(face):
    doubled = np.repeat(face[::2], 2, axis=0)
    assert not held_values(doubled).any()
    resting = face.copy()
    resting[100:131, 12] = face[100, 12]
    resting[131:, 12] += face[100, 12] - face[131, 12] + 1e-4  # goes on from where it was
    assert not held_values(resting).any()
    assert not held_values(np.repeat(face[:1], 50, axis=0)).any()


@pytest.mark.parametrize("frames", [slice(50, 51), slice(50, 120), slice(0, 30), slice(370, 400)])
def test_markers_in_each_others_place_are_swapped(face, head, frames):
    markers = head.apply(face)
    markers[frames, [9, 14]] = markers[frames, [14, 9]]
    expected = at(face.shape, (frames, 9), (frames, 14))
    np.testing.assert_array_equal(find_faults(source(markers)).swapped, expected)


def test_a_swap_across_a_gap_is_seen(face):
    markers = face.copy()
    markers[50:60, [9, 14]] = markers[50:60, [14, 9]]
    markers[47:50, 9] = markers[60:62, 14] = np.nan
    np.testing.assert_array_equal(
        exchanged(markers), at(face.shape, (slice(50, 60), 9), (slice(50, 60), 14))
    )


def test_single_spikes_are_found_and_nothing_beside_them(face):
    rng = np.random.default_rng(1)
    hit = rng.random(face.shape[:2]) < 0.005
    hit[1:] &= ~hit[:-1]
    markers = face + 2.0 * hit[:, :, None] * rng.choice([-1.0, 1.0], face.shape)
    found = single_spikes(markers)
    assert (found & hit).sum() >= 0.95 * hit.sum()
    assert (found & ~hit).sum() <= 2


def test_a_fast_motion_of_many_and_a_lasting_odd_pose_are_no_spikes(face):
    blink = face.copy()
    factor = np.random.default_rng(2).normal(size=(12, 3))
    for start in range(20, 400, 40):
        blink[start : start + 2, 8:] += factor
    assert not single_spikes(blink).any()
    odd = face.copy()
    odd[200:230, 15] += 3.0 * np.sin(np.linspace(0.0, np.pi, 30))[:, None] ** 2
    assert not single_spikes(odd).any()


def test_units_do_not_matter(face):
    markers = face.copy()
    markers[100:131, 12] = markers[100, 12]
    markers[200, 10] += 3.0
    np.testing.assert_array_equal(
        find_faults(source(1e3 * markers)).any, find_faults(source(markers)).any
    )


def test_faults_are_counted_by_kind_and_hidden(face):
    markers = face.copy()
    markers[10:20, 3] = 0.0
    markers[200, 10] += 3.0
    faults = find_faults(source(markers))
    assert str(faults) == "10 zero, 1 spike"
    hidden = faults.hidden_from(source(markers))
    np.testing.assert_array_equal(~hidden.valid, faults.any)
    np.testing.assert_array_equal(hidden.values[~faults.any], markers[~faults.any])


def test_weights_rest_and_jump_as_they_like():
    weights = Source(np.zeros((20, 2)) + (np.arange(20) > 9)[:, None], ["a", "b"])
    faults = find_faults(weights)
    assert not faults.any.any()
    assert faults.hidden_from(weights) is weights


def test_few_frames_or_markers_are_no_obstacle(face):
    for markers in (face[:1], face[:2], face[:3], face[:, :1], face[:, :2]):
        assert not find_faults(source(markers)).any.any()


REAL = {
    **{f"tracks/{name}": "arkit" for name in ("rom", "utterance_a", "utterance_b")},
    **{f"tracks/optical_{name}": "solved" for name in ("cheeks", "eyebrows")},
    "markers/cheeks": None,
    "markers/eyebrows": None,
}


@pytest.mark.real
@pytest.mark.parametrize(("name", "target"), REAL.items())
def test_false_alarms_on_real_takes_are_below_one_in_a_thousand(real_data, name, target):
    real = read_take_file(real_data / f"{name}.npz", target=target).source
    assert find_faults(real).any.mean() < 1e-3


@pytest.mark.parametrize("scale", [1.0, 0.01, 10.0])
@pytest.mark.parametrize("size", [5.0, 12.0, 40.0])
def test_a_marker_elsewhere_for_seconds_has_strayed(face, head, size, scale):
    markers = head.apply(face)
    way = size * np.array([0.6, 0.0, 0.8])
    places = [(slice(100, 190), 10), (slice(0, 60), 14), (slice(340, 400), 3), (slice(180, 260), 7)]
    for frames, marker in places:
        markers[frames, marker] += way
    found = find_faults(source(scale * markers))
    np.testing.assert_array_equal(found.any, at(face.shape, *places))
    np.testing.assert_array_equal(found.strayed, found.any)


def test_a_reflection_that_stands_still_has_strayed(face, head):
    markers = head.apply(face)
    rng = np.random.default_rng(0)
    markers[150:220, 11] = markers[150, 11] + [0.0, 20.0, 10.0] + 0.01 * rng.normal(size=(70, 3))
    expected = at(face.shape, (slice(150, 220), 11))
    np.testing.assert_array_equal(find_faults(source(markers)).any, expected)


def test_a_stray_that_comes_and_goes_slowly_is_found_while_it_is_far(face):
    markers = face.copy()
    ramp = np.minimum(1.0, np.minimum(np.arange(90), np.arange(90)[::-1]) / 10.0)
    markers[100:190, 10] += 15.0 * ramp[:, None] * [1.0, 0.0, 0.0]
    found = find_faults(source(markers)).any
    assert found[103:187, 10].all()
    found[100:190, 10] = False
    assert not found.any()


def test_a_marker_that_strays_in_a_third_of_the_take_is_hidden_there_and_nowhere_else(face, head):
    markers = head.apply(face)
    places = [(slice(start, start + 35), 10) for start in range(20, 400, 100)]
    for frames, marker in places:
        markers[frames, marker] += [9.0, -3.0, 4.0]
    np.testing.assert_array_equal(find_faults(source(markers)).any, at(face.shape, *places))


def test_expressions_that_come_once_have_not_strayed(face, head):
    jaw = face.copy()
    opening = np.sin(np.linspace(0.0, np.pi, 40))[:, None] ** 2
    for marker, far in ((15, 4.0), (16, 3.0), (17, 3.5), (18, 2.0)):
        jaw[200:240, marker] += far * opening * [0.1, -1.0, -0.2]
    for markers in (jaw, head.apply(jaw)):
        assert not find_faults(source(markers)).any.any()
    raised = face.copy()
    raised[200:240, 15] += 2.5 * opening * [0.0, 1.0, 0.0]  # by a marker alone
    assert not find_faults(source(raised)).any.any()


def test_strays_are_named_with_their_frames(face, as_take, caplog):
    markers = face.copy()
    markers[120:210, 10] += [9.0, 0.0, 0.0]
    hidden = without_faults(as_take(markers)).source
    np.testing.assert_array_equal(~hidden.valid, at(face.shape, (slice(120, 210), 10)))
    line = "m10 in 90 frames from 120 is far from where the other markers put it"
    assert f"{line}: taken as not observed" in caplog.text


SENTINELS = (-50.0, -100.0, 9999.0, -9999.0, -16512.0, 1e6, 999.9, 1e30)


@pytest.mark.parametrize("value", SENTINELS)
@pytest.mark.parametrize("axes", [slice(None), 1])
def test_what_is_written_for_a_lost_marker_is_hidden_wherever_it_stands(face, head, value, axes):
    markers = head.apply(face)
    places = [(slice(0, 30), 4), (slice(50, 51), 9), (slice(60, 380), 12), (slice(None), 16)]
    for frames, marker in places:
        markers[frames, marker, axes] = value
    np.testing.assert_array_equal(find_faults(source(markers)).any, at(face.shape, *places))


@pytest.mark.parametrize("value", [0.0, *SENTINELS])
def test_it_is_hidden_where_everything_else_is_still(face, value):
    still = np.repeat(face[:1], 60, axis=0)
    still[10:40, 7] = value
    expected = at(still.shape, (slice(10, 40), 7))
    np.testing.assert_array_equal(find_faults(source(still)).any, expected)
    still[20:30] = value  # of all markers: no face
    np.testing.assert_array_equal(
        find_faults(source(still)).any, expected | at(still.shape, (slice(20, 30), slice(None)))
    )


def test_a_marker_on_the_shoulder_and_one_a_kilometre_away(face, head, as_take, caplog):
    body = np.array([40.0, -60.0, 10.0]) + 0.1 * face[:, 5:7]
    markers = np.concatenate([head.apply(face), body], axis=1)
    assert not find_faults(source(markers)).any.any()
    markers[77, 3, 2] = 1e5
    np.testing.assert_array_equal(
        find_faults(source(markers)).absurd, at(markers.shape, (slice(77, 78), 3))
    )
    without_faults(as_take(markers))
    assert "m3 at frame 77 is (" in caplog.text

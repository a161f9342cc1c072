import numpy as np
import pytest

from facert import InputError
from facert.data.normalisation import Normalisation
from facert.retarget.options import Adjustments, PoseScale

UNITS = Normalisation(np.zeros(4), 1.0)
NAMES = ["jawOpen", "eyeBlinkLeft", "eyeBlinkRight", "browInnerUp"]


def applied(adjustments, params):
    return PoseScale(UNITS, None, adjustments).params(params)


def test_nothing_asked_changes_nothing():
    params = np.random.default_rng(0).normal(size=(5, 4))
    for adjustments in (Adjustments.none(4), Adjustments.of({}, NAMES)):
        np.testing.assert_array_equal(applied(adjustments, params), params)
        assert adjustments.smooth_all


def test_gain_comes_before_limits():
    made = Adjustments.of({"jawOpen": {"gain": 2.0, "limits": [0.0, 1.0]}}, NAMES)
    params = np.array([[0.3, 5.0, 5.0, 5.0], [0.8, 0.0, 0.0, 0.0], [-0.2, 1.0, 1.0, 1.0]])
    expected = params.copy()
    expected[:, 0] = [0.6, 1.0, 0.0]
    np.testing.assert_allclose(applied(made, params), expected)


@pytest.mark.parametrize("gain", [1.0, -1.3])
def test_a_normalised_pose_at_its_bound_is_the_bound_itself(gain):
    """Whatever rounding makes of it on the way to normalised units and back."""
    rng = np.random.default_rng(0)
    means, scales = 10.0 * rng.normal(size=(200, 4)), rng.uniform(0.1, 30.0, 200)
    bounds = np.sort(rng.normal(size=(4, 2)), axis=1)
    bounds[0, 0], bounds[1, 1] = -np.inf, np.inf
    adjustments = Adjustments.of({name: {"gain": gain} for name in NAMES}, NAMES)
    for mean, scale in zip(means, scales, strict=True):
        units = Normalisation(mean, scale)
        at_bounds = units.apply(bounds.T)
        found = PoseScale(units, bounds, adjustments).params(at_bounds)
        np.testing.assert_array_equal(found, gain * bounds.T)
        inside = 0.5 * (np.clip(at_bounds[:1], -3.0, 3.0) + np.clip(at_bounds[1:], -3.0, 3.0))
        kept = PoseScale(units, bounds, adjustments).params(inside)
        np.testing.assert_allclose(
            kept, np.clip(gain * units.undo(inside), *np.sort(found, axis=0))
        )


def test_names_are_found_in_any_spelling_and_by_wildcards():
    made = Adjustments.of({"eyeBlink*": {"gain": 1.2}, "EyeBlink_R": {"gain": 1.5}}, NAMES)
    np.testing.assert_allclose(made.gain, [1.0, 1.2, 1.5, 1.0])


def test_what_a_later_table_does_not_mention_stays():
    made = Adjustments.of({"*": {"smoothing": 0.3}, "jawOpen": {"gain": 1.1}}, NAMES)
    np.testing.assert_allclose(made.smoothing, 0.3)
    np.testing.assert_allclose(made.gain, [1.1, 1.0, 1.0, 1.0])


def test_smoothing_goes_from_the_measured_to_the_cleaned():
    made = Adjustments.of({"jawOpen": {"smoothing": 0.0}, "brow*": {"smoothing": 0.25}}, NAMES)
    smooth, rough = np.zeros((3, 4)), np.ones((3, 4))
    np.testing.assert_allclose(made.mixed(smooth, rough), [[1.0, 0.0, 0.0, 0.75]] * 3)
    assert not made.smooth_all


def test_a_name_without_its_side_is_answered_with_the_pattern_for_both():
    with pytest.raises(InputError, match=r"eyeBlink: .*Did you mean 'eyeBlink\*' for both sides\?"):
        Adjustments.of({"eyeBlink": {"gain": 1.0}}, NAMES)


@pytest.mark.parametrize(
    ("tables", "word"),
    [
        ({"jawOpne": {"gain": 1.0}}, "jawOpen"),
        ({"lid*": {"gain": 1.0}}, "pattern"),
        ({"jawOpen": 1.0}, "table"),
        ({"jawOpen": {"gian": 1.0}}, r"Did you mean gain\?"),
        ({"jawOpen": {"gain": "much"}}, "number"),
        ({"jawOpen": {"gain": True}}, "number"),
        ({"jawOpen": {"smoothing": 1.5}}, "from 0 to 1"),
        ({"jawOpen": {"limits": [1.0, 0.0]}}, "low, high"),
        ({"jawOpen": {"limits": 1.0}}, "low, high"),
        ({"jawOpen": {"limits": ["a", "b"]}}, "low, high"),
    ],
)
def test_what_makes_no_sense_is_refused(tables, word):
    with pytest.raises(InputError, match=word):
        Adjustments.of(tables, NAMES)

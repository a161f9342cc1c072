from dataclasses import FrozenInstanceError

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from facert.data.rig import Rig
from facert.data.take import Controls, Source, Take
from facert.errors import InputError

MATRICES = arrays.arrays(
    float, arrays.array_shapes(min_dims=2, max_dims=2, max_side=5), elements=st.floats(-9, 9)
)


def make_take(frames=3, **changes):
    source = Source(np.zeros((frames, 2, 3)), ["a", "b"])
    return Take(**({"time": np.arange(frames) / 30, "source": source} | changes))


def test_a_marker_with_one_lost_coordinate_is_not_observed():
    values = np.zeros((2, 2, 3))
    values[1, 0, 2] = np.nan
    source = Source(values, ["a", "b"])
    assert np.isnan(source.values[1, 0]).all()
    assert source.valid.tolist() == [[True, True], [False, True]]


def test_weights_are_observed_one_by_one():
    source = Source([[0, np.nan], [1, 2]], ["a", "b"])
    assert source.kind == "weights"
    assert source.valid.tolist() == [[True, False], [True, True]]


def test_the_matrix_of_markers_has_one_row_a_frame():
    values = np.arange(12.0).reshape(2, 2, 3)
    source = Source(values, ["a", "b"])
    assert source.kind == "markers"
    assert source.matrix.shape == (2, 6)
    doubled = source.with_matrix(2 * source.matrix)
    np.testing.assert_array_equal(doubled.values, 2 * values)
    assert doubled.names == source.names


@given(MATRICES)
def test_arrays_are_copied_and_cannot_be_changed(values):
    names = [f"n{index}" for index in range(values.shape[1])]
    source = Source(values, names)
    with pytest.raises(ValueError, match="read-only"):
        source.values[0, 0] = 1.0
    values[0, 0] = 100.0
    assert source.values[0, 0] != 100.0
    with pytest.raises(FrozenInstanceError):
        source.names = ()


@pytest.mark.parametrize(
    ("values", "names", "message"),
    [
        (np.zeros(3), ["a"], r"markers \(T, M, 3\) or weights"),
        (np.zeros((2, 2, 2)), ["a", "b"], r"markers \(T, M, 3\) or weights"),
        (np.zeros((0, 2)), ["a", "b"], "numbers"),
        (np.array([["x"]]), ["a"], "numbers"),
        ([[np.inf]], ["a"], "infinite"),
        (np.full((2, 1), np.nan), ["a"], "at least one observed value"),
        (np.zeros((2, 2)), ["a"], "2 names"),
        (np.zeros((2, 2)), ["a", "a"], "'a' twice"),
        (np.zeros((2, 1)), [""], "an empty name"),
        (np.zeros((2, 1)), ["a\0"], "without control characters"),
        (np.zeros((2, 1)), ["\x1b[31mred"], "without control characters"),
        (np.zeros((2, 1)), ["\ud800"], "without control characters"),
    ],
)
def test_a_source_that_cannot_be_is_refused(values, names, message):
    with pytest.raises(InputError, match=message):
        Source(values, names)


@pytest.mark.parametrize(
    "limits",
    [[[1, 0]], [[0, 1], [0, 1]], [[np.nan, 1]], [[np.inf, np.inf]], [[-np.inf, -np.inf]]],
    ids=["order", "shape", "NaN", "beyond all", "below all"],
)
def test_limits_are_one_rising_pair_a_control(limits):
    with pytest.raises(InputError, match="/target/limits"):
        Controls(["a"], limits)


def test_labels_are_the_frames_with_a_pose():
    params = np.full((4, 2), np.nan)
    params[[1, 3]] = 0.5
    take = make_take(4, controls=Controls(["a", "b"]), params=params)
    assert take.labels.tolist() == [1, 3]
    assert make_take().labels.tolist() == []
    assert len(take) == 4


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"time": [0.0, 1.0]}, "/time: expected 3 seconds"),
        ({"time": [0.0, 1.0, 1.0]}, "strictly rising"),
        ({"time": [0.0, np.nan, 1.0]}, "strictly rising"),
        ({"fps": 0.0}, "fps"),
        ({"fps": np.nan}, "fps"),
        ({"params": np.zeros((3, 1))}, "/target/names"),
        ({"controls": Controls(["a"]), "params": np.zeros((2, 1))}, "/target/params"),
        ({"controls": Controls(["a"]), "std": np.zeros((3, 2))}, "/target/std"),
        ({"controls": Controls(["a"]), "params": np.full((3, 1), np.inf)}, "infinite"),
        ({"controls": Controls(["a"]), "animation": np.zeros((9, 2))}, "/animation/params"),
        ({"controls": Controls(["a"]), "animation": np.full((9, 1), np.nan)}, "/animation/params"),
        (
            {"controls": Controls(["a", "b"]), "params": [[0, 0], [0, np.nan], [0, 0]]},
            "row 1 known in part",
        ),
    ],
)
def test_a_take_that_cannot_be_is_refused(changes, message):
    with pytest.raises(InputError, match=message):
        make_take(**changes)


def test_a_rig_adds_its_shapes_to_the_neutral():
    rng = np.random.default_rng(0)
    neutral, shapes = rng.normal(size=(4, 3)), rng.normal(size=(2, 4, 3))
    rig = Rig(neutral, shapes, ("a", "b"), np.array([[0, 1, 2]]))
    params = rng.random((5, 2))
    expected = neutral + np.einsum("tp,pvc->tvc", params, shapes)
    np.testing.assert_allclose(rig.deform(params), expected)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"neutral": np.zeros((4, 2))}, "/neutral"),
        ({"shapes": np.zeros((2, 3, 3))}, "/shapes"),
        ({"shapes": np.full((2, 4, 3), np.nan)}, "NaN or infinity"),
        ({"names": ("a",)}, "/names"),
        ({"faces": [[0, 1, 4]]}, "/faces: expected vertex indices 0 to 3"),
        ({"faces": [[-1, 1, 2]]}, "/faces"),
        ({"faces": [[0.0, 1.0, 2.0]]}, "/faces: expected integers"),
        ({"faces": [[0, 1, 2, 3]]}, "/faces: expected integers"),
    ],
)
def test_a_rig_that_cannot_be_is_refused(changes, message):
    fields = {
        "neutral": np.zeros((4, 3)),
        "shapes": np.zeros((2, 4, 3)),
        "names": ("a", "b"),
        "faces": [[0, 1, 2]],
    }
    with pytest.raises(InputError, match=message):
        Rig(**(fields | changes))


def test_attributes_are_plain_text():
    with pytest.raises(InputError, match=r"attribute units.*found 'cm\\x00'"):
        make_take(units="cm\0")


@pytest.mark.parametrize("fps", [1e300, 1e-300, 0.0, np.inf, np.nan])
def test_a_rate_that_is_none_is_refused(fps):
    with pytest.raises(InputError, match="fps: expected"):
        Take(np.arange(3) / 25, Source(np.eye(3), ("a", "b", "c")), fps=fps)


def test_times_of_garbage_are_refused():
    with pytest.raises(InputError, match=r"/time: expected seconds up to 1e\+20, found up to 1.0e"):
        Take(np.array([0, 1, 1e300]), Source(np.eye(3), ("a", "b", "c")))


@pytest.mark.parametrize("field", ["neutral", "shapes"])
def test_a_coordinate_whose_square_is_infinite_is_refused(field):
    arrays = {"neutral": np.eye(3), "shapes": np.zeros((1, 3, 3))}
    arrays[field].flat[1] = -1e300
    with pytest.raises(InputError, match=rf"/{field}: expected numbers of a sensible size"):
        Rig(**arrays, names=("a",), faces=[[0, 1, 2]])

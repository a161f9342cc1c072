import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from facert.data.normalisation import Normalisation
from facert.errors import InputError


def rows(seed=0):
    return np.random.default_rng(seed).normal(size=(20, 3)) * [1.0, 5.0, 0.1] + 7.0


def test_rows_are_centred_and_the_largest_deviation_is_one():
    normalised = Normalisation.of(rows(), "x").apply(rows())
    np.testing.assert_allclose(normalised.mean(axis=0), 0.0, atol=1e-12)
    assert normalised.std(axis=0).max() == pytest.approx(1.0)


def test_dimensions_keep_their_relative_size():
    deviation = Normalisation.of(rows(), "x").apply(rows()).std(axis=0)
    np.testing.assert_allclose(deviation / deviation[0], rows().std(axis=0) / rows()[:, 0].std())


@given(st.floats(1e-6, 1e6), st.floats(-100, 100))
def test_neither_unit_nor_origin_matters(scale, shift):
    moved = scale * (rows() + shift)
    np.testing.assert_allclose(
        Normalisation.of(moved, "x").apply(moved),
        Normalisation.of(rows(), "x").apply(rows()),
        atol=1e-8,
    )


def test_undo_is_the_way_back():
    units = Normalisation.of(rows(), "x")
    np.testing.assert_allclose(units.undo(units.apply(rows(1))), rows(1), rtol=1e-12)


def test_what_was_not_observed_is_passed_over():
    gaps = np.vstack([rows(), np.full((5, 3), np.nan)])
    assert Normalisation.of(gaps, "x").scale == Normalisation.of(rows(), "x").scale


@pytest.mark.parametrize("value", [0.0, 1e-300, 123.456])
def test_rows_that_never_change_are_refused(value):
    with pytest.raises(InputError, match="/source/markers: expected values that change"):
        Normalisation.of(np.full((5, 3), value), "/source/markers")


def test_rounding_is_no_motion():
    still = 100.0 + 1e-13 * np.random.default_rng(0).normal(size=(10, 3))
    with pytest.raises(InputError, match="the same row throughout"):
        Normalisation.of(still, "x")


def test_a_row_alone_is_told_from_rows_that_are_all_the_same():
    for rows, message in ((1, "one row alone. Give a longer take"), (3, "the same row throughout")):
        with pytest.raises(InputError, match=message):
            Normalisation.of(np.ones((rows, 4)), "/source")

"""Lengths and axes are converted, not relabelled."""

from __future__ import annotations

import logging

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from facert.data.rig import Rig
from facert.data.take import Source, Take
from facert.data.units import METRES, with_units, with_up_axis
from facert.errors import InputError

RNG = np.random.default_rng(0)
MARKERS = Source(RNG.normal(size=(2, 3, 3)), ("a", "b", "c"), RNG.random((2, 3, 3)))
TAKE = Take([0, 1], MARKERS, units="cm", up_axis="z")
WEIGHTS = Take([0, 1], Source(np.ones((2, 1)), ("jaw",)), units="cm")
RIG = Rig(RNG.normal(size=(4, 3)), RNG.normal(size=(2, 4, 3)), ("x", "y"), [[0, 1, 2]], "mm")


def test_markers_and_their_deviations_are_scaled() -> None:
    found = with_units(TAKE, "metres")
    np.testing.assert_allclose(found.source.values, MARKERS.values / 100)
    np.testing.assert_allclose(found.source.std, MARKERS.std / 100)
    assert found.units == "m"


def test_a_rig_is_scaled_as_a_whole() -> None:
    found = with_units(RIG, "in")
    params = RNG.random((3, 2))
    np.testing.assert_allclose(found.deform(params), RIG.deform(params) / 25.4)
    assert found.units == "in"


@given(st.sampled_from(sorted(METRES)), st.sampled_from(sorted(METRES)))
def test_there_and_back_is_the_same(one: str, other: str) -> None:
    there = with_units(with_units(TAKE, one), other)
    np.testing.assert_allclose(with_units(there, "cm").source.values, MARKERS.values)


def test_weights_have_no_length() -> None:
    np.testing.assert_array_equal(with_units(WEIGHTS, "mm").source.values, WEIGHTS.source.values)


def test_a_file_without_a_unit_is_taken_at_its_word(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO, "facert")
    bare = Take([0, 1], MARKERS)
    np.testing.assert_array_equal(with_units(bare, "cm").source.values, MARKERS.values)
    np.testing.assert_array_equal(with_up_axis(bare, "y", "").source.values, MARKERS.values)
    assert "taken to be cm" in caplog.text
    assert "taken to be y" in caplog.text


def test_from_z_to_y_what_was_up_is_up() -> None:
    found = with_up_axis(TAKE, "Y", "+z")
    x, y, z = np.moveaxis(MARKERS.values, 2, 0)
    np.testing.assert_allclose(found.source.values, np.stack([x, z, -y], axis=2))
    np.testing.assert_allclose(found.source.std, MARKERS.std[..., [0, 2, 1]])
    assert found.up_axis == "y"


@pytest.mark.parametrize("present", "xyz")
@pytest.mark.parametrize("wanted", "xyz")
def test_turning_keeps_hands_and_heights(present: str, wanted: str) -> None:
    found = with_up_axis(RIG, wanted, present)
    height = RIG.neutral[:, "xyz".index(present)]
    np.testing.assert_allclose(found.neutral[:, "xyz".index(wanted)], height)
    turn = np.linalg.lstsq(RIG.neutral, found.neutral)[0]
    assert np.linalg.det(turn) == pytest.approx(1)
    params = RNG.random((1, 2))
    np.testing.assert_allclose(found.deform(params), RIG.deform(params) @ turn)
    again = with_up_axis(found, present, wanted)
    np.testing.assert_allclose(again.neutral, RIG.neutral, atol=1e-12)


def test_what_is_not_known_is_refused() -> None:
    with pytest.raises(InputError, match="--units: expected m, dm, cm"):
        with_units(TAKE, "parsec")
    with pytest.raises(InputError, match="--in-units"):
        with_units(Take([0, 1], MARKERS, units="furlong"), "cm")
    with pytest.raises(InputError, match="x, y or z"):
        with_up_axis(TAKE, "w", "y")
    with pytest.raises(InputError, match="x, y or z"):
        with_up_axis(TAKE, "y", "w")

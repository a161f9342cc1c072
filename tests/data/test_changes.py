"""Names of other programs become ours, or nothing is read."""

from __future__ import annotations

import numpy as np
import pytest

from facert.data.changes import renamed
from facert.data.rig import Rig
from facert.data.take import Controls, Source, Take
from facert.errors import InputError

SOURCE = Source(np.zeros((2, 3)), ("Mouth_Open", "Blink_L", "Blink_R"), np.ones((2, 3)))
TAKE = Take([0, 1], SOURCE, Controls(("jaw", "lids"), [[0, 1], [0, 2]]), np.zeros((2, 2)))
RIG = Rig(np.eye(3), np.zeros((2, 3, 3)), ("smile", "frown"), [[0, 1, 2]])


def test_markers_weights_and_controls_are_renamed_and_the_rest_stays() -> None:
    found = renamed(TAKE, {"Mouth_Open": "jawOpen", "lids": "eyeBlink"})
    assert found.source.names == ("jawOpen", "Blink_L", "Blink_R")
    assert found.controls.names == ("jaw", "eyeBlink")
    np.testing.assert_array_equal(found.controls.limits, [[0, 1], [0, 2]])
    np.testing.assert_array_equal(found.source.std, SOURCE.std)


def test_any_spelling_of_a_name_is_understood() -> None:
    found = renamed(TAKE, {"mouth-open": "a", "blinkLeft": "b", "BLINK_R": "c"})
    assert found.source.names == ("a", "b", "c")


def test_names_can_be_swapped() -> None:
    found = renamed(TAKE, {"Blink_L": "Blink_R", "Blink_R": "Blink_L"})
    assert found.source.names == ("Mouth_Open", "Blink_R", "Blink_L")


def test_shapes_of_a_rig_are_renamed() -> None:
    assert renamed(RIG, {"Smile": "mouthSmile"}).names == ("mouthSmile", "frown")


def test_an_unknown_name_is_an_error_with_the_nearest_one() -> None:
    with pytest.raises(InputError, match=r"found 'mouth_opn'.*Did you mean 'Mouth_Open'\?"):
        renamed(TAKE, {"mouth_opn": "jawOpen"})
    with pytest.raises(InputError, match=r"found 'xyz' \(1 more\)"):
        renamed(TAKE, {"xyz": "a", "uvw": "b"})


@pytest.mark.parametrize(
    ("names", "message"),
    [
        ({"jaw": "lids"}, "'lids' twice"),
        ({"jaw": 3}, "jaw: expected a name"),
        ({"face": {"jaw": "a"}}, "face: expected a name"),
        ({"jaw": ""}, "an empty name"),
        ({"jaw": "a\n"}, "control characters"),
    ],
)
def test_a_map_that_makes_no_sense_is_refused(names: dict, message: str) -> None:
    with pytest.raises(InputError, match=message):
        renamed(TAKE, names)

"""Names of other programs become ours, or nothing is read."""

from __future__ import annotations

import unicodedata
from dataclasses import replace

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


FACES = ("Anna:jawOpen", "Anna:levé", "Ben:jawOpen")


def test_a_pattern_removes_a_prefix_from_all_names_that_have_it() -> None:
    rig = Rig(np.eye(3), np.zeros((3, 3, 3)), FACES, [[0, 1, 2]])
    assert renamed(rig, {"Anna:*": "*"}).names == ("jawOpen", "levé", "Ben:jawOpen")
    both = renamed(rig, {"Anna:*": "a_*", "ben:jaw_open": "b"})
    assert both.names == ("a_jawOpen", "a_levé", "b")
    found = renamed(replace(rig, names=("*1", "*2", "x")), {"*1": "chin"})
    assert found.names == ("chin", "*2", "x")  # a star may be a part of a name


@pytest.mark.parametrize(
    ("names", "message"),
    [
        ({"Anna:*": "x"}, "one \\* on either side"),
        ({"*:*": "*"}, "one \\* on either side"),
        ({"Carl:*": "*"}, "found 'Carl:\\*'"),
        ({"*:jawOpen": "*"}, None),
        ({"*a:jawOpen": "Ben:jawOpen*"}, None),
    ],
)
def test_a_pattern_that_makes_no_sense_is_refused(names: dict, message: str | None) -> None:
    rig = Rig(np.eye(3), np.zeros((3, 3, 3)), FACES, [[0, 1, 2]])
    if message is None:
        assert len(set(renamed(rig, names).names)) == 3
    else:
        with pytest.raises(InputError, match=message):
            renamed(rig, names)


def test_a_map_sees_through_a_prefix_and_forms_of_unicode() -> None:
    names = ("Face1:jawOpen", "Face1:" + unicodedata.normalize("NFD", "sourcilLevé"), "Face1:x")
    rig = Rig(np.eye(3), np.zeros((3, 3, 3)), names, [[0, 1, 2]])
    assert renamed(rig, {"JawOpen": "a", "sourcilLevé": "b"}).names == ("a", "b", "Face1:x")


def test_of_two_patterns_that_fit_a_name_the_first_counts() -> None:
    names = tuple(f"Face:lip{letter}_L" for letter in "abcdefgh")
    rig = Rig(np.eye(3), np.zeros((8, 3, 3)), names, [[0, 1, 2]])
    patterns = {f"{name[:-2]}*": f"{name[5:-2]}*" for name in names}
    assert renamed(rig, patterns | {"*_L": "*Left"}).names == tuple(name[5:] for name in names)
    wanted = tuple(f"{name[:-2]}Left" for name in names)
    assert renamed(rig, {"*_L": "*Left"} | patterns).names == wanted

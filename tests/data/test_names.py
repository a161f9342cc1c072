import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from facert.data.names import (
    ARKIT_ANGLES,
    ARKIT_NAMES,
    ARKIT_SHAPES,
    NameIndex,
    canonical,
    control_groups,
    fitting,
    instead_of,
    match,
    nearest,
    shape_drivers,
)
from facert.errors import InputError


def spellings(name):
    """Ways in which programs write an ARKit name."""
    snake = re.sub(r"(?<!^)([A-Z])", r"_\1", name).lower()
    short = re.sub("Left$", "_L", re.sub("Right$", "_R", name))
    return [name, name[0].upper() + name[1:], short, snake, snake.replace("_", "-"), name.lower()]


def test_there_are_52_shapes_and_nine_angles():
    assert (len(ARKIT_SHAPES), len(ARKIT_ANGLES), len(set(ARKIT_NAMES))) == (52, 9, 61)


@pytest.mark.parametrize("name", ARKIT_NAMES)
def test_every_spelling_of_an_arkit_name_is_one(name):
    assert {canonical(spelling) for spelling in spellings(name)} == {name}


@given(st.text(min_size=1))
def test_a_canonical_name_is_its_own(name):
    assert canonical(canonical(name)) == canonical(name)


def test_other_names_stay_as_they_are():
    assert canonical("eye-left-closure") == "eye-left-closure"
    assert canonical("日本") == "日本"


def test_the_nearest_name_is_a_hint():
    assert nearest("eyeBlnik_L", ARKIT_NAMES) == "eyeBlinkLeft"
    assert nearest("quux", ARKIT_NAMES) is None


def test_a_name_is_found_as_it_is_spelled_before_any_other_spelling():
    index = NameIndex(["smile_L", "smileLeft", "frownLeft"])
    assert index.find("smileLeft") == 1
    assert index.find("smile_L") == 0
    assert index.find("SmileLeft") is None  # either could be meant
    assert index.find("frown_l") == 2


@given(st.permutations(ARKIT_NAMES))
def test_names_are_matched_whatever_their_order(names):
    upper = [name[0].upper() + name[1:] for name in ARKIT_NAMES]
    assert [names[index] for index in match(upper, names, "names")] == list(ARKIT_NAMES)


def test_a_name_without_a_match_is_named_with_the_nearest():
    expected = r"'jawOpn' \(and 1 more\), found no such name.* Did you mean 'JawOpen'\?"
    with pytest.raises(InputError, match=expected):
        match(["jawLeft", "jawOpn", "nose"], ["JawOpen", "JawLeft"], "/source/names")


@pytest.mark.parametrize(
    ("name", "meant"),
    [
        ("mouthSmile", "'mouthSmile*' for both sides"),
        ("mouth", "'mouthLeft' and 'mouthRight'"),  # mouth* would be the smile as well
        ("mouth_smile", "'mouthSmile_L' and 'mouthSmile_R'"),  # no pattern in this spelling
        ("lid", "'L_lid' and 'R_lid'"),
        ("mouthSmileL_", "'mouthSmile_L'"),
        ("puf_L", "'puff_L'"),
        ("zzz", "None"),
    ],
)
def test_what_was_meant_by_a_name_that_is_not_there(name, meant):
    names = ["mouthSmile_L", "mouthSmile_R", "mouthLeft", "mouthRight", "L_lid", "R_lid", "puff_L"]
    assert str(instead_of(name, names)) == meant


def test_a_pattern_means_every_name_that_fits_and_a_name_the_one_of_any_spelling():
    names = ["jawOpen", "jaw*", "eyeBlink_L", "eyeBlink_R", "eyeBlink"]
    assert fitting("eyeBlink*", names) == [2, 3, 4]
    assert fitting("eyeBlink_[LR]", names) == fitting("eyeBlink_?", names) == [2, 3]
    assert fitting("EyeBlinkLeft", names) == [2]
    assert fitting("jaw*", names) == [1]
    assert fitting("lid*", names) == fitting("lid", names) == []


@pytest.mark.parametrize(("one", "other"), [("m1_12", "m11_2"), ("x+1", "x-1"), ("p.1", "p.-1")])
def test_other_numbers_are_another_name(one, other):
    assert NameIndex([one]).find(other) is None


def test_numbers_are_found_in_other_spellings():
    assert match(["Marker_012", "m1.12"], ["m1_12", "marker012"], "names").tolist() == [1, 0]


@pytest.mark.parametrize("wanted", [["smile_L", "smileLeft"], ["smileLeft", "SmileLeft"]])
def test_one_name_never_stands_for_two(wanted):
    with pytest.raises(InputError, match=f"'{wanted[0]}' and '{wanted[1]}', found only 'smile"):
        match(wanted, ["smile_L", "jaw"], "/source/names")


@given(st.permutations(ARKIT_NAMES))
def test_controls_drive_the_shapes_of_their_names_whatever_the_spelling(names):
    upper = [name[0].upper() + name[1:] for name in ARKIT_NAMES]
    drivers = shape_drivers(upper, names)
    assert (drivers @ np.arange(61)).tolist() == [names.index(name) for name in ARKIT_NAMES]
    assert drivers.sum() == 61


def test_a_control_without_a_side_drives_both_halves():
    shapes = ["browInnerUp_L", "jawOpen", "browInnerUp_R", "browInner"]
    drivers = shape_drivers(["BrowInnerUp", "jaw_open"], shapes)
    assert drivers.tolist() == [[1, 0, 1, 0], [0, 1, 0, 0]]


def test_the_whole_shape_comes_before_its_halves():
    assert shape_drivers(["puff"], ["puff_L", "puff_R", "puff"]).tolist() == [[0, 0, 1]]


@pytest.mark.parametrize(
    ("controls", "message"),
    [
        (["up", "wider"], r"found 'wider' \(did you mean 'wide'\?\), 1 unknown in all"),
        (["up", "lean"], "found 'lean', 1 unknown"),  # one half is not the whole
        (["up", "Up"], "found 'up' and 'Up' for 'up'"),
        (["puff", "puffLeft"], "found 'puff' and 'puffLeft' for 'puff_L'"),
    ],
)
def test_every_control_has_shapes_of_its_own(controls, message):
    with pytest.raises(InputError, match=f"/target/names: .*{message}"):
        shape_drivers(controls, ["up", "wide", "lean_L", "puff_L", "puff_R"])


@given(st.lists(st.text(min_size=1), unique=True, min_size=1))
def test_every_control_is_in_one_group(names):
    groups = control_groups(names)
    together = np.concatenate(list(groups.values()))
    assert sorted(together.tolist()) == list(range(len(names)))


@pytest.mark.parametrize(
    ("name", "group"),
    [
        ("browInnerUp_L", "brows"),
        ("eyebrows-left-extern-up", "brows"),
        ("EyeBlinkLeft", "eyes"),
        ("leftEyeYaw", "eyes"),
        ("eye-left-closure", "eyes"),
        ("cheekSquintLeft", "cheeks"),
        ("nose-left-elevation", "nose"),
        ("mouth-corner-puller", "mouth"),
        ("tongueOut", "mouth"),
        ("CTRL_L_lipCorner", "mouth"),
        ("jawOpen", "jaw"),
        ("HeadYaw", "head"),
        ("neck-platysma", "head"),
        ("squash", "other"),
    ],
)
def test_controls_are_grouped_by_the_words_of_their_names(name, group):
    assert list(control_groups([name])) == [group]


def test_groups_come_in_a_fixed_order():
    names = ["zap", "jawOpen", "mouthClose", "browDownLeft", "jawLeft"]
    groups = {group: indices.tolist() for group, indices in control_groups(names).items()}
    assert groups == {"brows": [3], "mouth": [2], "jaw": [1, 4], "other": [0]}
    assert list(groups) == ["brows", "mouth", "jaw", "other"]

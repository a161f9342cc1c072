import pytest

from facert.data.names import ARKIT_SHAPES
from facert.data.sides import counterparts


def partners(*names: str) -> list[str]:
    return [names[place] for place in counterparts(names)]


@pytest.mark.parametrize(
    ("left", "right"),
    [
        ("eyeBlinkLeft", "eyeBlinkRight"),
        ("EyeBlink_L", "EyeBlink_R"),
        ("brow.L", "brow.R"),
        ("L_brow_inner", "R_brow_inner"),
        ("lf_lip_corner", "rt_lip_corner"),
        ("Lft_brow", "Rgt_brow"),
        ("mouth-left-corner", "mouth-right-corner"),
        ("face:CTRL_L_eye_blink", "face:CTRL_R_eye_blink"),
        ("lookLeft_L", "lookRight_R"),
        ("Blick_links_L", "Blick_links_R"),
    ],
)
def test_a_side_has_its_counterpart_in_every_spelling(left: str, right: str) -> None:
    assert partners(left, "jawOpen", right) == [right, "jawOpen", left]


def test_without_a_side_or_a_counterpart_a_control_is_its_own() -> None:
    alone = ("lid_L", "jaw_open", "levator", "BrowR2", "brow_l_1")
    assert partners(*alone) == list(alone)


def test_every_shape_of_arkit_is_the_counterpart_of_its_counterpart() -> None:
    found = counterparts(ARKIT_SHAPES)
    assert found[found].tolist() == list(range(len(ARKIT_SHAPES)))
    assert sum(found[place] != place for place in range(len(found))) == 2 * 20


def test_two_spellings_of_one_name_have_no_counterpart_for_certain() -> None:
    same = ("brow_L", "browLeft", "brow_R")
    assert partners(*same) == list(same)

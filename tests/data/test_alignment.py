"""Names match without a prefix or suffix of either list, and only where that is sure."""

from __future__ import annotations

import logging
import unicodedata

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from facert.data.labelling import Poses, labelled, weights_as_poses
from facert.data.names import (
    ARKIT_SHAPES,
    are_same,
    fitting,
    instead_of,
    match,
    nearest,
    shape_drivers,
)
from facert.data.regions import Regions
from facert.data.rig import Rig
from facert.data.shared_controls import shared_controls
from facert.data.take import Controls, Source, Take
from facert.errors import InputError
from facert.preprocess.source_layout import SourceLayout

FEW = ("jawOpen", "browInnerUp", "eyeBlink_L", "mouthSmileLeft", "cheekPuff", "browDown_R")
PLACES = [ARKIT_SHAPES.index(name) for name in (
    "jawOpen", "browInnerUp", "eyeBlinkLeft", "mouthSmileLeft", "cheekPuff", "browDownRight"
)]  # fmt: skip
PREFIXES = (
    "Face1:blendShape1.", "blendShapes.", "BS_node.", "CTRL_expressions_", "head_mesh|",
    "Group1|Face:", "Anna:", "BS_", "head.", "Körper:", "腾讯_", "ref-", "scene/face/", "M_F00_",
)  # fmt: skip
SUFFIXES = ("_shape", ".weight", "_geo", "Shape", "1", "_ncl1_1")


def spelled(names, prefix="", suffix=""):
    return tuple(f"{prefix}{name}{suffix}" for name in names)


AFFIXES = [*((prefix, "") for prefix in PREFIXES), *(("", suffix) for suffix in SUFFIXES)]


@pytest.mark.parametrize(("prefix", "suffix"), [*AFFIXES, ("BS_", "_geo")])
def test_an_affix_of_either_list_is_seen_through_and_logged(prefix, suffix, caplog):
    caplog.set_level(logging.INFO)
    few, many = spelled(FEW, prefix, suffix), spelled(ARKIT_SHAPES, prefix, suffix)
    assert match(FEW, many, "names").tolist() == PLACES
    assert match(few, ARKIT_SHAPES, "names").tolist() == PLACES
    assert match(few, spelled(ARKIT_SHAPES, "Kopf:"), "names").tolist() == PLACES
    assert match(few, many, "names").tolist() == PLACES
    lines = [record.getMessage() for record in caplog.records]
    assert len(lines) == 3
    assert all(repr(prefix or suffix) in line and "(and 5 more)" in line for line in lines)


@pytest.mark.parametrize(
    ("wanted", "among"),
    [
        (["mouthOpen", "mouthClose", "mouthUp"], ["jawOpen", "jawClose", "jawUp"]),
        (["brow.up", "brow.down", "brow.in"], ["lid.up", "lid.down", "lid.in"]),
        (["brow", "eye", "lip"], ["brow_L", "eye_L", "lip_L"]),
        (["L_brow", "L_eye", "L_lip"], ["R_brow", "R_eye", "R_lip"]),
        (["1", "2", "3"], ["M1", "M2", "M3"]),
        (["P_1", "P_2", "P_3"], ["1", "2", "3"]),
        (["open"], ["jaw_open", "brow_up"]),
        (["smile"], ["smileWide"]),
        (["open", "shut", "wide"], ["jaw_open", "brow_shut", "lip_wide"]),
        (["jawOpen", "mouthPucker"], ["JawOpen", "mouthFunnel"]),
        (["upperLip0", "upperLip1", "upperLip2"], ["lowerLip0", "lowerLip1", "lowerLip2"]),
        (["inner_1a", "inner_1b", "inner_1c"], ["outer_1a", "outer_1b", "outer_1c"]),
        (["smile", "frown", "blink"], ["lower_smile", "lower_frown", "lower_blink"]),
        (["lf_blink", "lf_smile", "lf_frown"], ["rt_blink", "rt_smile", "rt_frown"]),
        (["jaw.tx", "lip.tx", "brow.tx"], ["jaw.ty", "lip.ty", "brow.ty"]),
        (["jaw_pos", "lip_pos", "brow_pos"], ["jaw_neg", "lip_neg", "brow_neg"]),
        (["jaw_min", "lip_min", "brow_min"], ["jaw_max", "lip_max", "brow_max"]),
        (["AU01", "AU02", "AU04"], ["AU01_r", "AU02_r", "AU04_r", "AU01_c", "AU02_c", "AU04_c"]),
    ],
)
def test_words_of_a_name_are_no_affix(wanted, among):
    with pytest.raises(InputError, match="no such name"):
        match(wanted, among, "names")


def test_what_the_other_list_shows_to_be_an_affix_is_one():
    assert match(["open", "close"], ["mouthOpen", "mouthClose"], "names").tolist() == [0, 1]


def test_names_that_match_as_they_are_are_left_alone(caplog):
    caplog.set_level(logging.INFO)
    both = (*ARKIT_SHAPES, *spelled(ARKIT_SHAPES, "Ben:"))
    assert match(FEW, both, "names").tolist() == PLACES
    assert match(spelled(FEW, "Ben:"), both, "names").tolist() == [52 + place for place in PLACES]
    assert not caplog.records


@pytest.mark.parametrize(
    ("first", "second"), [("Anna:", "Ben:"), ("Actor1:", "Actor2:"), ("a_", "b_")]
)
@pytest.mark.parametrize("own", ["", "Kopf:"])
def test_two_subjects_are_never_mixed(first, second, own):
    two = spelled(ARKIT_SHAPES, first) + spelled(FEW, second)
    expected = f"those of two, '{first}\\*' and '{second}\\*'.* \"{first}\\*\" = \"\\*\""
    with pytest.raises(InputError, match=expected):
        match(spelled(FEW, own), two, "/source/names")
    with pytest.raises(InputError, match=expected):
        match(two, spelled(FEW, own), "/source/names")


def test_a_second_subject_with_few_of_the_names_is_passed_over():
    two = spelled(FEW, "Anna:") + spelled(FEW[:3], "Ben:")
    assert match(FEW, two, "names").tolist() == [0, 1, 2, 3, 4, 5]


def test_names_without_the_affix_match_beside_those_with_it():
    among = (*spelled(FEW, "Face:"), "headYaw", "*12")
    assert match([*FEW, "HeadYaw"], among, "names").tolist() == [0, 1, 2, 3, 4, 5, 6]


@pytest.mark.parametrize("prefix", ["Face:", "bs_"])
def test_names_that_differ_in_signs_alone_stay_apart_behind_a_prefix(prefix):
    names = ("lip-1", "lip+1", "cheek", "cheek.", "jaw", "brow", "lid")
    assert match(names, spelled(names, prefix), "names").tolist() == list(range(7))
    assert match(spelled(names, prefix), names, "names").tolist() == list(range(7))


def test_subjects_of_markers():
    wanted, among = ["LBRO", "RBRO", "1"], ["Actor1:RBRO", "Actor1:LBRO", "Actor1:1", "*12"]
    assert match(wanted, among, "names").tolist() == [1, 0, 2]
    assert match(["LBRO"], ["Actor1:LBRO", "Actor1:RBRO"], "names").tolist() == [0]


@settings(deadline=None)
@given(st.lists(st.text(min_size=1), unique=True, min_size=1), st.sampled_from(["Face:", "a|b:"]))
def test_a_namespace_never_hides_a_name_whatever_it_is(names, prefix):
    longer = spelled(names, prefix)
    for wanted, among in ((names, longer), (longer, names)):
        try:
            found = match(wanted, among, "names")
        except InputError:
            continue
        assert found.tolist() == list(range(len(names)))


@pytest.mark.parametrize("form", ["NFC", "NFD", "NFKC", "NFKD"])
def test_forms_of_unicode_are_one_name(form):
    names = ["sourcilLevéGauche", "ÄrgerLinks", "бровьЙ", "眉が上", "ｊａｗＯｐｅｎ", "naïve"]
    other = [unicodedata.normalize(form, name) for name in names]
    assert match(names, other[::-1], "names").tolist() == [5, 4, 3, 2, 1, 0]
    assert match(other, spelled(names, "Face:"), "names").tolist() == [0, 1, 2, 3, 4, 5]


def test_two_forms_of_a_name_in_one_list_stay_apart():
    one, other = (unicodedata.normalize(form, "levé") for form in ("NFC", "NFD"))
    assert match([other, one], [one, other], "names").tolist() == [1, 0]
    with pytest.raises(InputError, match=r"'levé' \(é is U\+00E9, not É\)|e \+ U\+0301"):
        match(["LEVÉ"], [one, other], "names")


def test_characters_that_look_alike_are_shown_by_code_point():
    with pytest.raises(InputError, match=r"'jаwOpen' \(а is U\+0430, not a\)\?"):
        match(["jawOpen", "x"], ["jаwOpen", "x"], "names")


def test_the_nearest_name_is_found_behind_a_prefix():
    among = spelled(FEW, "Face1:blendShape1.")
    assert nearest("jawOpn", among) == "Face1:blendShape1.jawOpen"
    assert instead_of("Kopf:jawOpn", among) == "'Face1:blendShape1.jawOpen'"
    with pytest.raises(InputError, match="such as 'Face2:squint'"):
        match(["jawOpen"], ["Face2:squint", "Face2:puff"], "names")


def test_patterns_of_controls_see_through_a_prefix():
    among = spelled(FEW, "CTRL_expressions_")
    assert fitting("brow*", among) == [1, 5]
    assert fitting("JawOpen", among) == [0]
    assert fitting("CTRL*Puff", among) == [4]


def test_a_rig_with_a_prefix_is_driven_by_plain_controls():
    shapes = ["F.browInner_L", "F.browInner_R", "F.jaw"]
    expected = [[1, 1, 0], [0, 0, 1]]
    for prefix in ("", "CTRL_", "x:"):
        assert shape_drivers(spelled(["browInner", "jaw"], prefix), shapes).tolist() == expected
    assert shape_drivers(["browInner"], shapes).tolist() == expected[:1]


def take(names, controls=()):
    params = np.zeros((2, len(controls))) if controls else None
    return Take(
        [0, 1],
        Source(np.eye(2, len(names)), names),
        Controls(controls) if controls else None,
        params,
    )


def test_weights_become_poses_of_a_rig_with_other_prefixes():
    rig = Rig(np.eye(3), np.zeros((52, 3, 3)), spelled(ARKIT_SHAPES, "blendShape1."), [[0, 1, 2]])
    posed = weights_as_poses(take(("unknown", *FEW)), rig)
    assert posed.controls.names == FEW


def test_poses_with_a_prefix_are_of_the_takes_controls():
    found = take(("a", "b"), FEW)
    values = np.arange(6.0)[None]
    poses = Poses(spelled(FEW[::-1], "Face:"), values, frames=np.array([1]))
    posed = labelled(found, poses)
    assert posed.controls.names == FEW
    assert posed.params[1].tolist() == values[0, ::-1].tolist()


def test_truth_and_result_are_compared_without_a_prefix():
    found = shared_controls(take(("a",), spelled(FEW, "Face:")), take(("a",), FEW[:4]))
    assert found.names == FEW[:4]
    assert found.of_truth == ("Face:cheekPuff", "Face:browDown_R")


def test_regions_name_markers_and_controls_without_a_prefix():
    tables = {
        "brows": {"markers": ["LBRO"], "controls": ["browInnerUp"]},
        "rest": {"markers": ["CHIN"], "controls": ["JawOpen"]},
    }
    found = Regions.of(tables).matched(["A:LBRO", "A:CHIN"], ["BS_jawOpen", "BS_browInnerUp"])
    assert found.tables["brows"] == {"markers": ["A:LBRO"], "controls": ["BS_browInnerUp"]}


def test_lists_are_the_same_in_any_order_spelling_and_prefix():
    assert are_same(spelled(FEW[::-1], "Face:"), ARKIT_SHAPES) is False
    assert are_same(spelled(FEW[::-1], "Face:"), FEW)
    assert not are_same(FEW, FEW[1:])
    assert not are_same(("jawOpen", "JawOpen"), ("jawOpen", "mouthOpen"))


def test_one_half_of_a_face_is_not_the_whole(caplog):
    caplog.set_level(logging.INFO)
    with pytest.raises(InputError, match="3 unknown in all"):
        shape_drivers(["AU01_c", "AU02_c", "AU04_c"], ["AU01_r", "AU02_r", "AU04_r"])
    assert not caplog.records


@pytest.mark.parametrize("own", ["", "Anna:"])
def test_a_second_subject_never_stands_in_for_the_first(own):
    both = spelled(FEW[:3], own) + spelled(FEW, "Ben:")
    with pytest.raises(InputError, match=rf"those of two, 'Ben:\*' and '{own}jawOpen'"):
        match(spelled(FEW, own), both, "/source/names")
    columns = SourceLayout("weights", spelled(FEW, own)).columns
    with pytest.raises(InputError, match="those of two"):
        columns(both)

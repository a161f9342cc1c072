import unicodedata

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from facert.data.affixes import without_affix
from facert.data.names import ARKIT_SHAPES
from facert.data.spelling import folded, words

FEW = ("jawOpen", "browInnerUp", "eyeBlinkLeft", "mouthSmile_L")
AFFIXES = [
    ("Face1:blendShape1.", ""),
    ("blendShapes.", ""),
    ("BS_node.", ""),
    ("CTRL_expressions_", ""),
    ("head_mesh|", ""),
    ("Group1|Face:", ""),
    ("Anna:", ""),
    ("Körper:", ""),
    ("", "_shape"),
    ("", ".weight"),
    ("BS_", "_geo"),
]


@pytest.mark.parametrize(("prefix", "suffix"), AFFIXES)
@pytest.mark.parametrize("names", [FEW, ARKIT_SHAPES])
def test_what_all_names_share_is_seen_through(prefix, suffix, names):
    assert without_affix([f"{prefix}{name}{suffix}" for name in names]) == names


@pytest.mark.parametrize(
    "names",
    [
        ("mouthOpen", "mouthClose"),
        ("jaw_open", "mouth_open"),
        ("eyeBlink_L", "eyeLook_L"),
        ("eyeBlink_L", "eyeBlink_R"),
        ("brow_up", "brow_down"),
        ("wide_up", "wide_down"),
        ("M1", "M2", "M3"),
        ("Anna:jawOpen", "Ben:jawOpen"),
        ("jawOpen",),
        ARKIT_SHAPES,
        (),
    ],
)
def test_words_of_the_names_themselves_stay(names):
    assert without_affix(names) == tuple(names)


@settings(deadline=None)
@given(st.lists(st.text(min_size=1), unique=True))
def test_names_stay_as_many_and_different_whatever_they_are(names):
    assert len(set(without_affix(names))) == len(names)


FORMS = ("NFC", "NFD", "NFKC", "NFKD")


@settings(deadline=None)
@given(st.text(), st.sampled_from(FORMS))
def test_forms_of_unicode_are_one_spelling(name, form):
    assert folded(unicodedata.normalize(form, name)) == folded(name)


@pytest.mark.parametrize(
    ("name", "found"),
    [
        ("sourcilLevéGauche", ("sourcil", "levé", "gauche")),
        ("ÉlanÉté_L", ("élan", "été", "left")),
        ("броваВверх", ("брова", "вверх")),
        ("眉毛上_L", ("眉毛上", "left")),
        ("ｊａｗＯｐｅｎ", ("jaw", "open")),
        ("भौंह_ऊपर", ("भौंह", "ऊपर")),
        ("STRASSE", ("strasse",)),
        ("straße", ("strasse",)),
        ("jaw\u200bOpen", ("jaw", "open")),
    ],
)
def test_words_of_any_language_are_whole(name, found):
    for form in ("NFC", "NFD"):
        assert words(unicodedata.normalize(form, name)) == tuple(
            unicodedata.normalize("NFC", word) for word in found
        )

"""The words that a name is made of, whatever their case, what parts them and the form of Unicode.

Programs spell one name in many ways: ``EyeBlinkLeft``, ``eyeBlink_L``, ``eye-blink.left``; macOS
writes ``é`` as two characters, other systems as one.
"""

from __future__ import annotations

import difflib
import itertools
import re
import unicodedata
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

SIDES = ("left", "right")
OTHER = "other"

_SHORT = {"l": "left", "r": "right"}
_NUMBER = re.compile(r"[-+]?\d+")
# In the outline of a name: A is a capital, a another cased letter, c one without case, m a mark on
# the letter before it, 0 a digit.
_WORD = re.compile(r"(?:Am*)+(?![am])|(?:Am*)?(?:am*)+|[-+]?0+|(?:cm*)+")
_KEPT = 2**16  # Names whose words are remembered: all columns of a large table

# The first word of a name that begins like one of these decides the part of the face.
_STEMS = {
    "brows": ("brow", "eyebrow", "forehead"),
    "eyes": ("eye", "lid", "gaze", "blink", "pupil"),
    "nose": ("nose", "nostril"),
    "cheeks": ("cheek",),
    "mouth": ("mouth", "lip", "tongue", "teeth", "smile"),
    "jaw": ("jaw", "chin"),
    "head": ("head", "neck"),
}
PARTS = (*_STEMS, OTHER)
"""Parts of the face, in a fixed order."""


@dataclass(frozen=True, slots=True)
class Word:
    """A word of a name: its text, folded, and where it stands in the composed name."""

    text: str
    begin: int
    end: int


def composed(name: str) -> str:
    """The name in one form of Unicode, NFKC: accents are one with their letter, no full width."""
    return name if name.isascii() else unicodedata.normalize("NFKC", name)


@lru_cache(_KEPT)
def parsed(name: str) -> tuple[Word, ...]:
    """The words of a name, with their places in `composed`."""
    name = composed(name)
    outline = name.translate(_ASCII) if name.isascii() else "".join(map(_outline, name))
    spans = (found.span() for found in _WORD.finditer(outline))
    return tuple(Word(_same(name[begin:end]), begin, end) for begin, end in spans)


@lru_cache(_KEPT)
def words(name: str) -> tuple[str, ...]:
    """The words of a name, case folded, numbers with their sign, ``l`` and ``r`` written out."""
    return tuple(word.text for word in parsed(name))


@lru_cache(_KEPT)
def folded(name: str) -> str:
    """The form that all spellings of a name share: its words, with a mark between two numbers.

    >>> folded("EyeBlink_L"), folded("eye-blink-left"), folded("m1.12"), folded("m11.2")
    ('eyeblinkleft', 'eyeblinkleft', 'm1_12', 'm11_2')
    """
    return joined(words(name)) or composed(name)


def joined(found: Sequence[str]) -> str:
    """The form that all spellings of a name share, from its words."""
    parts = list(found[:1])
    for before, word in itertools.pairwise(found):
        parts += ["_", word] if is_number(before) and is_number(word) else [word]
    return "".join(parts)


def is_number(word: str) -> bool:
    """Whether a word is a number."""
    return _NUMBER.fullmatch(word) is not None


def contrasted(name: str, other: str) -> str:
    """The name in quotes, with the code points of what may look the same in another one.

    >>> contrasted("jaw", "jow"), contrasted("j\u0430w", "jaw")
    ("'jaw'", "'j\u0430w' (\u0430 is U+0430, not a)")
    """
    changes = difflib.SequenceMatcher(a=name, b=other, autojunk=False).get_opcodes()
    parts = [
        f"{name[a:b] or 'nothing'} is {_points(name[a:b])}, not {_points(other[c:d]) or 'that'}"
        for tag, a, b, c, d in changes
        if tag != "equal" and not (name[a:b] + other[c:d]).isascii()
    ]
    return f"{name!r} ({'; '.join(parts)})" if parts else repr(name)


def _points(text: str) -> str:
    return " + ".join(sign if sign.isascii() else f"U+{ord(sign):04X}" for sign in text)


def part_of_face(name: str) -> str:
    """The part of the face, one of `PARTS`, by the first word of a name that shows it."""
    return next((part for word in words(name) if (part := part_of(word)) != OTHER), OTHER)


def part_of(word: str) -> str:
    """The part of the face that a word shows, one of `PARTS`."""
    return next((part for part, stems in _STEMS.items() if word.startswith(stems)), OTHER)


def _outline(sign: str) -> str:
    if sign.isascii() and not sign.isalnum():
        return sign if sign in "+-" else " "
    if sign.isupper() or sign.istitle():
        return "A"
    if sign.islower():
        return "a"
    if sign.isdigit():
        return "0"
    return "c" if sign.isalnum() else "m" if unicodedata.category(sign)[0] == "M" else " "


def _same(word: str) -> str:
    word = composed(word.casefold())
    return _SHORT.get(word, word)


_ASCII = {code: _outline(chr(code)) for code in range(128)}

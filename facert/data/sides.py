"""Left and right among the names of controls: which name is which other one's, mirrored."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from facert.data.arrays import IntArray
from facert.data.spelling import SIDES, words

# Abbreviations that `words` leaves as they are; `l` and `r` are written out there
_SPELLED = {"lf": "left", "lft": "left", "lt": "left", "rt": "right", "rgt": "right"}


def counterparts(names: Sequence[str]) -> IntArray:
    """Index of each control's counterpart on the other side, (P,).

    It is the control whose name has every side exchanged, and no other word; a control without a
    side, or whose counterpart is not there, is its own.

    >>> counterparts(["browDown_L", "jawOpen", "browDown_R", "lid_L"]).tolist()
    [2, 1, 0, 3]
    """
    spelled = [tuple(_SPELLED.get(word, word) for word in words(name)) for name in names]
    places: dict[tuple[str, ...], list[int]] = {}
    for place, name in enumerate(spelled):
        places.setdefault(name, []).append(place)
    found = np.arange(len(names))
    for place, name in enumerate(spelled):
        others = places.get(tuple(_exchanged(word) for word in name), [])
        if len(others) == 1 and len(places[name]) == 1:
            found[place] = others[0]
    return found.astype(np.int64)


def _exchanged(word: str) -> str:
    left, right = SIDES
    return {left: right, right: left}.get(word, word)

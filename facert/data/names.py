"""Names of shapes and controls: their spellings, the standard list, groups of the face.

Programs spell one shape in many ways: ``EyeBlinkLeft`` (Live Link CSV), ``eyeBlinkLeft`` (ARKit),
``eyeBlink_L`` (ICT-FaceKit, Face Cap). Names are matched by their words, whatever the case,
the separators and the way to write the side.
"""

from __future__ import annotations

import difflib
from collections import Counter
from collections.abc import Sequence
from fnmatch import fnmatchcase

import numpy as np

from facert.data.arrays import FloatArray, IntArray
from facert.data.spelling import PARTS, SIDES, folded, part_of_face, words
from facert.errors import InputError

_SHAPES = """
    eyeBlinkLeft eyeLookDownLeft eyeLookInLeft eyeLookOutLeft eyeLookUpLeft eyeSquintLeft
    eyeWideLeft eyeBlinkRight eyeLookDownRight eyeLookInRight eyeLookOutRight eyeLookUpRight
    eyeSquintRight eyeWideRight jawForward jawRight jawLeft jawOpen mouthClose mouthFunnel
    mouthPucker mouthRight mouthLeft mouthSmileLeft mouthSmileRight mouthFrownLeft mouthFrownRight
    mouthDimpleLeft mouthDimpleRight mouthStretchLeft mouthStretchRight mouthRollLower
    mouthRollUpper mouthShrugLower mouthShrugUpper mouthPressLeft mouthPressRight
    mouthLowerDownLeft mouthLowerDownRight mouthUpperUpLeft mouthUpperUpRight browDownLeft
    browDownRight browInnerUp browOuterUpLeft browOuterUpRight cheekPuff cheekSquintLeft
    cheekSquintRight noseSneerLeft noseSneerRight tongueOut
"""
_ANGLES = """
    headYaw headPitch headRoll leftEyeYaw leftEyePitch leftEyeRoll rightEyeYaw rightEyePitch
    rightEyeRoll
"""

ARKIT_SHAPES = tuple(_SHAPES.split())
"""The 52 shapes in the order of the Live Link Face CSV."""

ARKIT_ANGLES = tuple(_ANGLES.split())
"""The nine angles that follow them, in radians."""

ARKIT_NAMES = ARKIT_SHAPES + ARKIT_ANGLES

_ARKIT_SPELLING = {folded(name): name for name in ARKIT_NAMES}


def canonical(name: str) -> str:
    """ARKit's own spelling of an ARKit shape or angle; any other name as it is.

    >>> canonical("EyeBlink_L"), canonical("mouth-open")
    ('eyeBlinkLeft', 'mouth-open')
    """
    return _ARKIT_SPELLING.get(folded(name), name)


def nearest(name: str, candidates: Sequence[str]) -> str | None:
    """The candidate that is spelled most like `name`, or None when none comes near."""
    spelled = {folded(candidate): candidate for candidate in candidates}
    found = difflib.get_close_matches(folded(name), spelled, n=1, cutoff=0.7)
    return spelled[found[0]] if found else None


class NameIndex:
    """Index of names, all different, in a list, whatever their spelling.

    A name is found as it is spelled, or else by the one other spelling of it in the list.
    """

    def __init__(self, names: Sequence[str]) -> None:
        spellings = [folded(name) for name in names]
        count = Counter(spellings)
        self._folded = {key: i for i, key in enumerate(spellings) if count[key] == 1}
        self._exact = {name: i for i, name in enumerate(names)}

    def find(self, name: str) -> int | None:
        """The position of `name`, or None."""
        return self._exact.get(name, self._folded.get(folded(name)))

    def find_halves(self, name: str) -> list[int]:
        """The position of `name`, or else those of its left and right half; empty without both."""
        whole = self.find(name)
        if whole is not None:
            return [whole]
        halves = [self.find(f"{name}_{side}") for side in "LR"]
        return [half for half in halves if half is not None] if None not in halves else []


def match(wanted: Sequence[str], among: Sequence[str], field: str) -> IntArray:
    """Indices into `among` of each wanted name, in any spelling, (P,).

    Raises `InputError` naming `field`, what holds `among`: for the first name that is not there,
    with the nearest one that is; for two names that would stand at one place.
    """
    index = NameIndex(among)
    positions = [index.find(name) for name in wanted]
    if None in positions:
        lost = wanted[positions.index(None)]
        near = nearest(lost, among)
        found = f"no such name among {len(among)}"
        fix = "Rename it in one of the files."
        more = positions.count(None) - 1
        also = f" (and {more} more)" if more else ""
        hint = f"Did you mean {near!r}? {fix}" if near else fix
        raise InputError(field, f"the name {lost!r}{also}", found, hint)
    places = np.array(positions, dtype=np.int64)
    _require_different(places, wanted, among, field)
    return places


def fitting(pattern: str, names: Sequence[str]) -> list[int]:
    """Indices of the names that match a name in any spelling, or with wildcards.

    >>> fitting("eyeBlink*", ["jawOpen", "eyeBlink_L"]), fitting("JawOpen", ["jawOpen", "jaw*"])
    ([1], [0])
    """
    if pattern not in names and any(wildcard in pattern for wildcard in "*?["):
        return [index for index, name in enumerate(names) if fnmatchcase(name, pattern)]
    place = NameIndex(names).find(pattern)
    return [] if place is None else [place]


def instead_of(name: str, among: Sequence[str]) -> str | None:
    """Suggestions for a name that is not there, for a message.

    >>> instead_of("smile", ["smile_L", "smile_R"]), instead_of("smille_L", ["smile_L", "smile_R"])
    ("'smile*' for both sides", "'smile_L'")
    """
    sides = [one for one in among if _without_side(one) == words(name)]
    if len(sides) > 1:
        pattern = f"{name}*"
        if [one for one in among if fnmatchcase(one, pattern)] == sides:
            return f"{pattern!r} for both sides"
        return " and ".join(map(repr, sides))
    near = nearest(name, among)
    return None if near is None else repr(near)


def _without_side(name: str) -> tuple[str, ...]:
    return tuple(word for word in words(name) if word not in SIDES)


def _require_different(
    found: IntArray, wanted: Sequence[str], among: Sequence[str], field: str
) -> None:
    """Refuse names that match the same name of the list: one of them is missing."""
    shared = np.flatnonzero(np.bincount(found, minlength=1) > 1)
    if not len(shared):
        return
    first, second = (wanted[index] for index in np.flatnonzero(found == shared[0])[:2])
    expected, fix = (
        f"a name each for {first!r} and {second!r}",
        "Add the missing one, or rename it.",
    )
    raise InputError(field, expected, f"only {among[shared[0]]!r}", fix)


def shape_drivers(controls: Sequence[str], shapes: Sequence[str]) -> FloatArray:
    """Matrix of the rig's shapes that each control drives, whatever the spelling of either.

    A control drives the shape of its name; where the rig has a left and a right half of it
    instead, both. The result (P, K) is 1 where a control drives a shape, else 0: poses (n, P) times
    this are settings of the rig.

    Raises `InputError` when the rig has no shape for a control, or one shape for two of them.
    """
    index = NameIndex(shapes)
    driven = [index.find_halves(control) for control in controls]
    unknown = [name for name, found in zip(controls, driven, strict=True) if not found]
    if unknown:
        near = nearest(unknown[0], shapes)
        hint = f" (did you mean {near!r}?)" if near else ""
        unmatched = f"{unknown[0]!r}{hint}, {len(unknown)} unknown in all"
        expected, fix = "controls that the rig has a shape for", "Give the rig of its character."
        raise InputError("/target/names", expected, unmatched, fix)
    drivers = np.zeros((len(controls), len(shapes)))
    for control, found in enumerate(driven):
        drivers[control, found] = 1.0
    _require_one_driver(drivers, controls, shapes)
    return drivers


def _require_one_driver(
    drivers: FloatArray, controls: Sequence[str], shapes: Sequence[str]
) -> None:
    twice = np.flatnonzero(drivers.sum(axis=0) > 1)
    if len(twice):
        first, second = (controls[index] for index in np.flatnonzero(drivers[:, twice[0]])[:2])
        found = f"{first!r} and {second!r} for {shapes[twice[0]]!r}"
        fix = "Leave out one of them, or give the rig of this take's character."
        raise InputError("/target/names", "controls with a shape each", found, fix)


def control_groups(names: Sequence[str]) -> dict[str, IntArray]:
    """Sort controls into the parts of the face by the words of their names.

    Names are as those of ARKit, ICT-FaceKit or MakeHuman. The result goes from the group (brows,
    eyes, nose, cheeks, mouth, jaw, head, other; in this order, empty ones left out) to the indices
    of its controls. Each control is in one group.
    """
    groups = [part_of_face(name) for name in names]
    present = Counter(groups)
    return {
        group: np.array([i for i, found in enumerate(groups) if found == group], dtype=np.int64)
        for group in PARTS
        if present[group]
    }

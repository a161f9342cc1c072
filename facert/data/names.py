"""Names of shapes and controls: their spellings, the standard list, groups of the face.

Programs spell one shape in many ways: ``EyeBlinkLeft`` (Live Link CSV), ``eyeBlinkLeft`` (ARKit),
``eyeBlink_L`` (ICT-FaceKit, Face Cap). Names are matched by their words, whatever the case,
the separators and the way to write the side.
"""

from __future__ import annotations

import difflib
import logging
import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from fnmatch import fnmatchcase

import numpy as np

from facert.data.affixes import NONE, without_affix
from facert.data.alignment import NEARLY, Alignment, find_alignment
from facert.data.arrays import FloatArray, IntArray
from facert.data.spelling import (
    PARTS,
    SIDES,
    composed,
    contrasted,
    folded,
    part_of_face,
    words,
)
from facert.errors import InputError

log = logging.getLogger(__name__)

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

_FIRST_WORD = re.compile(r"[A-Za-z][a-z]+")

_ARKIT_SPELLING = {folded(name): name for name in ARKIT_NAMES}


def canonical(name: str) -> str:
    """ARKit's own spelling of an ARKit shape or angle; any other name as it is.

    >>> canonical("EyeBlink_L"), canonical("mouth-open")
    ('eyeBlinkLeft', 'mouth-open')
    """
    return _ARKIT_SPELLING.get(folded(name), name)


def nearest(name: str, candidates: Sequence[str]) -> str | None:
    """The candidate that is spelled most like `name`, or None when none comes near.

    Where none does as it is, the one that does without what all candidates share.
    """
    (own,) = without_affix([name])
    for sought, cores in ((name, candidates), (own, without_affix(candidates))):
        spelled = {folded(core): one for core, one in zip(cores, candidates, strict=True)}
        found = difflib.get_close_matches(folded(sought), spelled, n=1, cutoff=0.7)
        if found:
            return spelled[found[0]]
    return None


class _Spellings:
    """Positions by name: as it is spelled, in any form of Unicode, or else in any spelling."""

    def __init__(self, names: Mapping[int, str]) -> None:
        self._forms = [(form, _different(form, names)) for form in (str, composed, folded)]

    def find(self, name: str) -> int | None:
        found = (places.get(form(name)) for form, places in self._forms)
        return next((place for place in found if place is not None), None)


def _different(form: Callable[[str], str], names: Mapping[int, str]) -> dict[str, int]:
    """Positions by a form of the names, without those that have it in common."""
    count = Counter(map(form, names.values()))
    return {key: place for place, name in names.items() if count[key := form(name)] == 1}


class NameIndex:
    """Index of names, all different, in a list, whatever their spelling.

    A name is found as it is spelled, or else by the one other spelling of it in the list.

    Parameters
    ----------
    names : sequence of str
    aligned : Alignment, optional
        What to see through in these names, and in those that are looked up; see `among`.
    """

    def __init__(self, names: Sequence[str], aligned: Alignment | None = None) -> None:
        self._names = names
        self._whole = _Spellings(dict(enumerate(names)))
        self.aligned = aligned
        """What is seen through, if anything."""
        removed = NONE if aligned is None else aligned.of_among
        cores = {place: removed.core(name) for place, name in enumerate(names) if aligned}
        self._cores = _Spellings({place: core for place, core in cores.items() if core})

    @classmethod
    def among(
        cls,
        names: Sequence[str],
        wanted: Sequence[str],
        field: str,
        *,
        halves: bool = False,
        quiet: bool = False,
    ) -> NameIndex:
        """Index of names in which the wanted ones, as a list, are to be found.

        Where most are not found as they are, a prefix or a suffix of either list is seen through
        if nearly all match without it; the log names it. With `halves`, a wanted name may be the
        whole of a left and a right one.

        Raises `InputError` naming `field`, what holds `names`, when they are those of two subjects.
        """
        plain = cls(names)
        found = plain._found(wanted, halves)
        if found >= NEARLY * min(len(wanted), len(names)):
            return plain
        aligned = find_alignment(wanted, names, field, halves)
        index = cls(names, aligned)
        if aligned is None or index._found(wanted, halves) <= found:
            return plain
        if not quiet:
            log.info("%s; if that is wrong, facert convert --map", aligned.text(wanted, names))
        return index

    def _found(self, wanted: Sequence[str], halves: bool) -> int:
        """The number of wanted names that are there."""
        if halves:
            return sum(bool(self.find_halves(name)) for name in wanted)
        return sum(self.find(name) is not None for name in wanted)

    def find(self, name: str) -> int | None:
        """The position of `name`, or None."""
        found = (spellings.find(one) for spellings, one in self._readings(name))
        return next((place for place in found if place is not None), None)

    def find_halves(self, name: str) -> list[int]:
        """The position of `name`, or else those of its left and right half; empty without both."""
        whole = self.find(name)
        if whole is not None:
            return [whole]
        for spellings, one in self._readings(name):
            halves = [spellings.find(f"{one}_{side}") for side in "LR"]
            if None not in halves:
                return [half for half in halves if half is not None]
        return []

    def find_whole(self, name: str) -> int | None:
        """The position of `name`, or else of the whole that it is the left or the right half of."""
        whole = self.find(name)
        if whole is not None:
            return whole
        found = (
            spellings.find(folded(one).removesuffix("left").removesuffix("right"))
            for spellings, one in self._readings(name)
        )
        return next((place for place in found if place is not None), None)

    def _readings(self, name: str) -> Iterator[tuple[_Spellings, str]]:
        """A name as it is to be looked up, and where: at first without what is seen through."""
        core = None if self.aligned is None else self.aligned.of_wanted.core(name)
        if core is not None:
            yield self._cores, core
        yield self._whole, name

    def places(self, wanted: Sequence[str], field: str) -> IntArray:
        """Indices of each wanted name, (P,); raises what `match` does."""
        positions = [self.find(name) for name in wanted]
        if None in positions:
            lost = [name for name, place in zip(wanted, positions, strict=True) if place is None]
            raise _lost(lost, self._names, field)
        found = np.array(positions, dtype=np.int64)
        _require_different(found, wanted, self._names, field)
        return found


def match(wanted: Sequence[str], among: Sequence[str], field: str) -> IntArray:
    """Indices into `among` of each wanted name, in any spelling, (P,).

    A prefix or suffix of either list is seen through, see `NameIndex.among`.

    Raises `InputError` naming `field`, what holds `among`: for the first name that is not there,
    with the nearest one that is; for two names that would stand at one place; for two subjects.
    """
    return NameIndex.among(among, wanted, field).places(wanted, field)


def _lost(names: Sequence[str], among: Sequence[str], field: str) -> InputError:
    """An error for names that are not there, with the nearest to the first one."""
    near = nearest(names[0], among)
    more = len(names) - 1
    also = f" (and {more} more)" if more else ""
    example = f", such as {among[0]!r}" if among and not near else ""
    fix = "Rename it in one of the files."
    hint = f"Did you mean {contrasted(near, names[0])}? {fix}" if near else fix
    return InputError(
        field, f"the name {names[0]!r}{also}", f"no such name among {len(among)}{example}", hint
    )


def are_same(names: Sequence[str], others: Sequence[str]) -> bool:
    """Whether two lists hold the same names, in any order and spelling."""
    index = NameIndex.among(others, names, "names", quiet=True)
    places = {index.find(name) for name in names}
    return None not in places and len(places) == len(names) == len(others)


def fitting(pattern: str, names: Sequence[str]) -> list[int]:
    """Indices of the names that match a name in any spelling, or with wildcards.

    What all names share is seen through.

    >>> fitting("eyeBlink*", ["jawOpen", "eyeBlink_L"]), fitting("JawOpen", ["jawOpen", "jaw*"])
    ([1], [0])
    """
    if pattern in names or not any(wildcard in pattern for wildcard in "*?["):
        place = NameIndex.among(names, [pattern], "names", quiet=True).find(pattern)
        return [] if place is None else [place]
    form = composed(pattern)
    for spelled in (names, without_affix(names)):
        found = [i for i, one in enumerate(spelled) if fnmatchcase(composed(one), form)]
        if found:
            return found
    return []


def fitting_some(pattern: str, names: Sequence[str], field: str) -> list[int]:
    """Indices of the names that match, as `fitting` has it.

    Raises `InputError` naming `field` where none does, with what may have been meant.
    """
    found = fitting(pattern, names)
    if not found:
        meant = instead_of(pattern, names)
        fix = f"Did you mean {meant}?" if meant else f"There are {', '.join(names)}."
        raise InputError(field, "controls, or a pattern that some fit", repr(pattern), fix)
    return found


def instead_of(name: str, among: Sequence[str]) -> str | None:
    """Suggestions for a name that is not there, for a message.

    >>> instead_of("smile", ["smile_L", "smile_R"]), instead_of("smille_L", ["smile_L", "smile_R"])
    ("'smile*' for both sides", "'smile_L'")
    >>> instead_of("mouht*", ["mouthOpen", "mouthSmile_L", "jawOpen"])
    "'mouth*'"
    """
    sides = [one for one in among if _without_side(one) == words(name)]
    if len(sides) > 1:
        pattern = f"{name}*"
        if [one for one in among if fnmatchcase(one, pattern)] == sides:
            return f"{pattern!r} for both sides"
        return " and ".join(map(repr, sides))
    near = nearest(name, among)
    return _pattern_instead(name, among) if near is None else repr(near)


def _pattern_instead(pattern: str, among: Sequence[str]) -> str | None:
    """The pattern of some names whose first word is spelled nearly as that of a pattern."""
    first = [word[0] for word in map(_FIRST_WORD.match, among) if word]
    near = difflib.get_close_matches(pattern.rstrip("*"), first, n=1, cutoff=0.7)
    return repr(f"{near[0]}*") if near and pattern.endswith("*") else None


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


def shape_drivers(
    controls: Sequence[str], shapes: Sequence[str], quiet: bool = False
) -> FloatArray:
    """Matrix of the rig's shapes that each control drives, whatever the spelling of either.

    A control drives the shape of its name; where the rig has a left and a right half of it
    instead, both. The result (P, K) is 1 where a control drives a shape, else 0: poses (n, P) times
    this are settings of the rig. A prefix or suffix of either list is seen through, and the log
    names it unless it is to be `quiet`.

    Raises `InputError` when the rig has no shape for a control, or one shape for two of them.
    """
    index = NameIndex.among(shapes, controls, "/target/names", halves=True, quiet=quiet)
    driven = [index.find_halves(control) for control in controls]
    unknown = [name for name, found in zip(controls, driven, strict=True) if not found]
    if unknown:
        near = nearest(unknown[0], shapes)
        hint = f" (did you mean {contrasted(near, unknown[0])}?)" if near else ""
        unmatched = f"{unknown[0]!r}{hint}, {len(unknown)} unknown in all"
        expected = "controls that the rig has a shape for"
        fix = "Give the rig of its character; --drivers maps controls to bones."
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

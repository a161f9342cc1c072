"""What all names of a list begin or end with beside their own words, such as a namespace.

``Face1:blendShape1.jawOpen``, ``BS_node.jawOpen``, ``CTRL_expressions_jawOpen``, ``jawOpen_geo``:
programs put the name of a scene, a subject, a node or a rig before a name, and a kind behind it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from facert.data.spelling import (
    OTHER,
    SIDES,
    composed,
    is_number,
    parsed,
    part_of,
    part_of_face,
    words,
)

_STRONG = ":|/\\"
"""Signs that part a namespace or a path from a name, and never two words of a name."""
_MOST_FACIAL = 0.5
_MANY = 8
"""So many names share no word of their own; fewer may be all the corners, or all that opens."""
_KINDS = {"bs", "bsnode", "blend", "blendshape", "blendshapes", "ctl", "ctrl", "control"}
_KINDS |= {"controls", "curve", "expression", "expressions", "face", "geo", "geometry", "grp"}
_KINDS |= {"head", "mesh", "morph", "morpher", "node", "rig", "shape", "shapes", "target"}
_KINDS |= {"targets", "value", "weight", "weights"}
_MOST_BEFORE, _MOST_AFTER = 16, 6  # Words that are removed: a path in a scene may be long
_CARRIERS = ("head", "face")  # Of a mesh as of a part of the face
_PLACES = {"upper", "lower", "up", "down", "inner", "outer", "in", "out", "top", "bottom"}
_PLACES |= {
    "front",
    "back",
    "c",
    "center",
    "centre",
    "mid",
    "middle",
    "lf",
    "lft",
    "lt",
    "rt",
    "rgt",
}


@dataclass(frozen=True, slots=True)
class Affix:
    """The words that a name begins and ends with beside its own."""

    before: tuple[str, ...] = ()
    after: tuple[str, ...] = ()

    @property
    def words(self) -> tuple[str, ...]:
        """All of them."""
        return self.before + self.after

    @property
    def is_kind(self) -> bool:
        """Whether it means a kind of node, or counts them, as far as its words are known."""
        return all(word in _KINDS or is_number(word) for word in self.words)

    @property
    def tells_apart(self) -> bool:
        """Whether it says a side or a place, which distinguishes the names of one face."""
        return any(word in SIDES or word in _PLACES for word in self.words)

    def core(self, name: str) -> str | None:
        """The name without it; None where the name does not have it, or has nothing else."""
        span = self._span(name)
        return None if span is None else composed(name)[span]

    def spelled(self, name: str) -> tuple[str, str]:
        """How a name that has it spells it: what the name begins with, and what it ends with."""
        span = self._span(name)
        assert span is not None  # it has it
        return composed(name)[: span.start], composed(name)[span.stop :]

    def own_words(self, name: str) -> tuple[str, ...]:
        """The words of a name without it; none where the name lacks it, or has nothing else."""
        found = words(name)
        begin, end = len(self.before), len(found) - len(self.after)
        has = found[:begin] == self.before and found[max(end, 0) :] == self.after
        return found[begin:end] if has else ()

    def _span(self, name: str) -> slice | None:
        if not self.own_words(name):
            return None
        found = parsed(name)
        first, last = found[len(self.before)], found[len(found) - len(self.after) - 1]
        # Signs at an end that stays are the name's own
        begin = first.begin if self.before else 0
        return slice(begin, last.end if self.after else len(composed(name)))


NONE = Affix()


def without_affix(names: Sequence[str]) -> tuple[str, ...]:
    """The names without the prefix and the suffix that all of them share, as far as it is clear.

    A prefix that ends with ``:``, ``|`` or ``/`` is a namespace or a path. Other words may be the
    names' own: they are removed where they show neither a side nor a part of the face, most of what
    remains shows a part of the face, and the names are many or the words mean a kind of node.

    >>> without_affix(["Face1:bs.jawOpen", "Face1:bs.tongueOut"])
    ('jawOpen', 'tongueOut')
    >>> without_affix(["BS_jawOpen_geo", "BS_lidUp_geo"]), without_affix(["mouthOpen", "mouthIn"])
    (('jawOpen', 'lidUp'), ('mouthOpen', 'mouthIn'))
    """
    for affix in shared_affixes(names):
        cores = cores_of(affix, names)
        if cores is not None and is_clear(affix, names, cores):
            return cores
    return tuple(names)


def shared_affixes(names: Sequence[str], share: float = 1.0) -> list[Affix]:
    """The affixes that at least this share of the names have, the longest first."""
    texts = [words(name) for name in names]
    befores = _common(texts, share, _MOST_BEFORE)
    turned = _common([one[::-1] for one in texts], share, _MOST_AFTER)
    afters = [after[::-1] for after in turned]
    found = [Affix(before, after) for before in befores for after in afters]
    return sorted(filter(lambda affix: affix.words, found), key=lambda affix: -len(affix.words))


def cores_of(affix: Affix, names: Sequence[str]) -> tuple[str, ...] | None:
    """The names without an affix; None where one lacks it, or two would be alike."""
    cores = [core for name in names if (core := affix.core(name)) is not None]
    return tuple(cores) if len(set(cores)) == len(names) else None


def is_clear(affix: Affix, names: Sequence[str], cores: Sequence[str]) -> bool:
    """Whether an affix is no part of the names' own words, by these names alone."""
    if not affix.after and all(is_namespace(affix, name) for name in names):
        return True
    facial = sum(part_of_face(core) != OTHER for core in cores)
    sure = len(names) >= _MANY or affix.is_kind
    return sure and is_foreign(affix) and facial > _MOST_FACIAL * len(cores)


def is_namespace(affix: Affix, name: str) -> bool:
    """Whether one of the signs of namespaces and paths parts it from the rest of a name."""
    if not affix.before:
        return False
    found, count = parsed(name), len(affix.before)
    return any(
        sign in _STRONG for sign in composed(name)[found[count - 1].end : found[count].begin]
    )


def is_foreign(affix: Affix) -> bool:
    """Whether an affix shows neither a place nor a part of the face, as its own words would."""
    facial = any(part_of(word) != OTHER and word not in _CARRIERS for word in affix.words)
    return not facial and not affix.tells_apart


def _common(texts: Sequence[tuple[str, ...]], share: float, most: int) -> list[tuple[str, ...]]:
    """Beginnings that at least this share, above a half, have: none, then a word more each."""
    found: list[tuple[str, ...]] = [()]
    having = list(texts)
    while having and len(found) <= most:
        size = len(found[-1]) + 1
        longer = Counter(one[:size] for one in having if len(one) >= size)
        best, count = max(longer.items(), key=lambda item: item[1], default=((), 0))
        if not count or count < share * len(texts):
            break
        found.append(best)
        having = [one for one in having if one[:size] == best]
    return found

"""What all names of a list begin or end with beside their own words, such as a namespace.

``Face1:blendShape1.jawOpen``, ``BS_node.jawOpen``, ``CTRL_expressions_jawOpen``, ``jawOpen_geo``:
programs put the name of a scene, a subject, a node or a rig before a name, and a kind behind it.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

from facert.data.spelling import OTHER, SIDES, composed, is_number, parsed, part_of, part_of_face

_STRONG = ":|/\\"
"""What parts a namespace or a path from a name, and no two words of a name."""
_MOST_FACIAL = 0.5
_MANY = 8
"""Names that share no word of their own: fewer may be all the corners, or all that opens."""
_KINDS = frozenset(
    (
        *("bs", "bsnode", "blend", "blendshape", "blendshapes", "ctl", "ctrl", "control"),
        *("controls", "curve", "expression", "expressions", "face", "geo", "geometry", "grp"),
        *("head", "mesh", "morph", "morpher", "node", "rig", "shape", "shapes", "target"),
        *("targets", "value", "weight", "weights"),
    )
)
_CARRIERS = ("head", "face")  # Of a mesh as of a part of the face


@dataclass(frozen=True, slots=True)
class Affix:
    """What a name begins and ends with: so many words of it, and how that is spelled there."""

    before: tuple[str, ...] = ()
    after: tuple[str, ...] = ()

    @property
    def words(self) -> tuple[str, ...]:
        """The words of it."""
        return self.before + self.after

    def core(self, name: str) -> str | None:
        """The name without it; None where the name has it not, or nothing else."""
        found = parsed(name)
        texts = tuple(word.text for word in found)
        end = len(found) - len(self.after)
        if end <= len(self.before):
            return None
        if texts[: len(self.before)] != self.before or texts[end:] != self.after:
            return None
        own = found[len(self.before) : end]
        return composed(name)[own[0].begin : own[-1].end]


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


def shared_affixes(names: Sequence[str]) -> list[Affix]:
    """All that every name of a list begins and ends with, the longest first."""
    texts = [tuple(word.text for word in parsed(name)) for name in names]
    if not texts:
        return []
    before, after = _alike(texts), _alike([one[::-1] for one in texts])[::-1]
    found = [
        Affix(before[:first], after[len(after) - last :])
        for first in range(len(before) + 1)
        for last in range(len(after) + 1)
        if first + last
    ]
    return sorted(found, key=lambda affix: -len(affix.words))


def cores_of(affix: Affix, names: Sequence[str]) -> tuple[str, ...] | None:
    """The names without an affix; None where one has it not, or two would be alike."""
    cores = [core for name in names if (core := affix.core(name)) is not None]
    return tuple(cores) if len(set(cores)) == len(names) else None


def is_clear(affix: Affix, names: Sequence[str], cores: Sequence[str]) -> bool:
    """Whether an affix is no part of the names' own words, by these names alone."""
    if not affix.after and all(is_namespace(affix, name) for name in names):
        return True
    facial = sum(part_of_face(core) != OTHER for core in cores)
    sure = len(names) >= _MANY or all(word in _KINDS or is_number(word) for word in affix.words)
    return sure and is_foreign(affix) and facial > _MOST_FACIAL * len(cores)


def is_namespace(affix: Affix, name: str) -> bool:
    """Whether a sign that no name has inside parts what a name begins with from the rest."""
    if not affix.before:
        return False
    found, count = parsed(name), len(affix.before)
    return any(
        sign in _STRONG for sign in composed(name)[found[count - 1].end : found[count].begin]
    )


def is_foreign(affix: Affix) -> bool:
    """Whether an affix shows neither a side nor a part of the face, as its own words would."""
    return not any(
        word in SIDES or (part_of(word) != OTHER and word not in _CARRIERS) for word in affix.words
    )


def _alike(texts: Sequence[tuple[str, ...]]) -> tuple[str, ...]:
    """The words that all begin with."""
    least, most = min(texts), max(texts)  # the two that differ first
    pairs = zip(least, most, strict=False)
    return tuple(one for one, _ in itertools.takewhile(lambda pair: pair[0] == pair[1], pairs))

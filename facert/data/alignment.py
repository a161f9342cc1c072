"""Which prefix or suffix stands between the names of two lists that mean the same things."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from facert.data.affixes import NONE, Affix, is_foreign, is_namespace, shared_affixes
from facert.data.spelling import SIDES, is_number, joined, words
from facert.errors import InputError

SHARED = 0.8
"""Share of a list's names that must have an affix for it to count as the list's own."""
NEARLY, MOST = 0.8, 0.5
"""Shares of the shorter list's names that must match: by an affix that only the other list shows,
and by one that its own list shows."""
_ENOUGH = 3
_MOST_WORDS = 24

Pairs = Mapping[int, frozenset[int]]


@dataclass(frozen=True, eq=False)
class Alignment:
    """What is to be removed from the wanted names, and from those among which they are looked for.

    `pairs` are the indices that meet then.
    """

    of_wanted: Affix
    of_among: Affix
    pairs: Pairs

    def text(self, wanted: Sequence[str], among: Sequence[str]) -> str:
        """A line for the log."""
        place, partners = next(iter(self.pairs.items()))
        one, other = wanted[place], among[min(partners)]
        removed = [
            f"the {what} {text!r}"
            for affix, name in ((self.of_wanted, one), (self.of_among, other))
            for what, text in zip(("prefix", "suffix"), affix.spelled(name), strict=True)
            if text
        ]
        more = f" (and {len(self.pairs) - 1} more)" if len(self.pairs) > 1 else ""
        return f"names matched without {' and '.join(removed)}: {one!r} is {other!r}{more}"


def find_alignment(
    wanted: Sequence[str], among: Sequence[str], field: str, halves: bool = False
) -> Alignment | None:
    """The affixes without which nearly all names of the shorter list match; None without such.

    With `halves`, a wanted name matches its left and right half, too.

    Raises `InputError` naming `field` where two affixes would do and mean different names, or some
    names match as they are and others mean the same: those of two subjects.
    """
    candidates = list(_candidates(wanted, among, halves))
    found = [one for one in candidates if _holds(one, wanted, among)]
    if not found:
        return None
    best = max(found, key=_merit)
    as_they_are = [one for one in candidates if not one.of_wanted.words + one.of_among.words]
    as_many = [one for one in found if len(one.pairs) >= NEARLY * len(best.pairs)]
    for other in (*as_many, *as_they_are):
        if _differ(best.pairs, other.pairs):
            raise _two_subjects(best, other, wanted, among, field)
    return best


def _candidates(wanted: Sequence[str], among: Sequence[str], halves: bool) -> Iterator[Alignment]:
    """Alignments with each affix that the one list shows by itself, and any of the other."""
    inside = _cores(among, halves)
    for affix in (NONE, *shared_affixes(wanted, SHARED)):
        whole = _without(affix, wanted)
        for other, pairs in _meeting(whole, inside).items():
            yield Alignment(affix, other, pairs)
    inside = _cores(wanted, halves=False)
    for affix in (NONE, *shared_affixes(among, SHARED)):
        whole = _without(affix, among)
        for other, turned in _meeting(whole, inside).items():
            yield Alignment(other, affix, _turned(turned))


def _turned(pairs: Pairs) -> Pairs:
    found: dict[int, frozenset[int]] = {}
    for place, partners in pairs.items():
        for partner in partners:
            found[partner] = found.get(partner, frozenset()) | {place}
    return found


def _cores(names: Sequence[str], halves: bool) -> dict[str, list[tuple[Affix, int]]]:
    """All parts of the names' words that follow each other, folded, with the rest as an affix."""
    found: dict[str, list[tuple[Affix, int]]] = defaultdict(list)
    for index, name in enumerate(names):
        own = words(name)
        if len(own) > _MOST_WORDS:
            continue
        for begin in range(len(own)):
            for end in range(begin + 1, len(own) + 1):
                after = own[end:]
                if halves and after and after[0] in SIDES:
                    after = after[1:]
                found[joined(own[begin:end])].append((Affix(own[:begin], after), index))
    return found


def _without(affix: Affix, names: Sequence[str]) -> dict[str, int]:
    """The names that have an affix, without it and folded; those that are alike are left out."""
    found: dict[str, int] = {}
    twice: set[str] = set()
    for index, name in enumerate(names):
        own = affix.own_words(name)
        if 0 < len(own) <= _MOST_WORDS:
            key = joined(own)
            twice |= {key} & found.keys()
            found[key] = index
    return {key: index for key, index in found.items() if key not in twice}


def _meeting(
    whole: Mapping[str, int], inside: Mapping[str, list[tuple[Affix, int]]]
) -> dict[Affix, dict[int, frozenset[int]]]:
    """By the affix of the one list, which of the other's names meet which of its own."""
    found: dict[Affix, dict[int, frozenset[int]]] = defaultdict(dict)
    for key, place in whole.items():
        for affix, index in inside.get(key, ()):
            pairs = found[affix]
            pairs[place] = pairs.get(place, frozenset()) | {index}
    return found


@dataclass(frozen=True)
class _Removed:
    """An affix that is removed from a list's names, and those of them that meet a name then."""

    affix: Affix
    names: Sequence[str]
    met: Sequence[str]

    @property
    def is_named(self) -> bool:
        """Whether it is a namespace or a path."""
        return not self.affix.after and all(is_namespace(self.affix, one) for one in self.met)

    @property
    def is_own(self) -> bool:
        """Whether the list shows it by itself."""
        if self.is_named:
            return True
        having = sum(self.affix.core(one) is not None for one in self.names)
        alone = len(self.names) == 1 and not self.affix.is_kind
        return having >= SHARED * len(self.names) and not alone

    @property
    def is_word(self) -> bool:
        """Whether it distinguishes names of one face, or what remains of one is but a number."""
        if self.is_named:
            return any(word in SIDES for word in self.affix.words)
        cores = filter(None, map(self.affix.core, self.met))
        return self.affix.tells_apart or all(map(_is_bare, cores))


def _holds(found: Alignment, wanted: Sequence[str], among: Sequence[str]) -> bool:
    """Whether an alignment is more than a coincidence."""
    first = [wanted[place] for place in found.pairs]
    second = [among[min(partners)] for partners in found.pairs.values()]
    both = _Removed(found.of_wanted, wanted, first), _Removed(found.of_among, among, second)
    removed = [one for one in both if one.affix.words]
    if not removed or any(one.is_word for one in removed):
        return False
    if len(removed) > 1 and not _are_exchanged(removed):
        return False
    own, count = all(one.is_own for one in removed), len(found.pairs)
    share = MOST if own else NEARLY
    return (own or count >= _ENOUGH) and count >= share * min(len(wanted), len(among))


def _are_exchanged(removed: Sequence[_Removed]) -> bool:
    """Whether affixes of the two lists say nothing of the face, so that they need not agree.

    Of two suffixes that is known of kinds only: ``.tx`` and ``.ty``, or ``_min`` and ``_max``,
    distinguish two controls.
    """
    suffixes = [Affix(after=one.affix.after) for one in removed if one.affix.after]
    if len(suffixes) > 1 and not all(suffix.is_kind for suffix in suffixes):
        return False
    return all(one.is_named or is_foreign(one.affix) for one in removed)


def _is_bare(core: str) -> bool:
    """Whether a name says nothing but numbers and sides."""
    return all(word in SIDES or is_number(word) for word in words(core))


def _merit(found: Alignment) -> tuple[int, int]:
    return len(found.pairs), -len(found.of_wanted.words + found.of_among.words)


def _differ(pairs: Pairs, others: Pairs) -> bool:
    """Whether a name has one partner by the one, and another by the other."""
    both = ((pairs, others), (_turned(pairs), _turned(others)))
    return any(
        one.get(place, partners) != partners
        for one, other in both
        for place, partners in other.items()
    )


def _two_subjects(
    one: Alignment, other: Alignment, wanted: Sequence[str], among: Sequence[str], field: str
) -> InputError:
    """An error that names both."""
    shared = sorted(one.pairs.keys() & other.pairs.keys())
    place = next((k for k in shared if one.pairs[k] != other.pairs[k]), None)
    if place is not None:
        examples = [among[min(found.pairs[place])] for found in (one, other)]
        affixes = [one.of_among, other.of_among]
    else:
        examples = [wanted[min(found.pairs)] for found in (one, other)]
        affixes = [one.of_wanted, other.of_wanted]
    first, second = (
        "*".join(affix.spelled(name)) if affix.words else name
        for affix, name in zip(affixes, examples, strict=True)
    )
    line = f'Take one: facert convert --map, with a line such as "{first}" = "*".'
    fix = line if all(affix.words for affix in affixes) else "Leave out one of them."
    return InputError(
        field, "the names of one subject", f"those of two, {first!r} and {second!r}", fix
    )

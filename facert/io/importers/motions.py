"""What drivers make of controls, and back: rotations, translations and properties of nodes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from facert.io.importers.shared import ScriptError

Sums = dict["Place", list[float]]
_SWEEPS = 50


class Place(NamedTuple):
    """What of a node moves: ``rotate`` or ``translate``, or a property by its name."""

    node: str
    kind: str
    name: str = ""


class Motion(NamedTuple):
    """What a control at 1 adds to a place: a vector, or a single number; and what a property is."""

    place: Place
    amount: tuple[float, ...]
    offset: float = 0.0


def read_drivers(path: str) -> dict[str, Any]:
    """The tables in a file ``drivers.toml``.

    Raises `ScriptError` when they cannot be read, or this Python is older than TOML in it.
    """
    try:
        import tomllib
    except ImportError:
        fix = "facert export-script --drivers drivers.toml makes a script that holds them"
        raise ScriptError(f"{path}: this program's Python reads no TOML: {fix}") from None
    try:
        with open(path, "rb") as file:
            tables = tomllib.load(file)
        motions_of(tables)
    except (OSError, ValueError, RecursionError) as error:
        raise ScriptError(f"{path}: expected drivers in TOML: {error}") from error
    return tables


def motions_of(drivers: Mapping[str, Any]) -> dict[str, list[Motion]]:
    """The motions of each control in tables as those of ``drivers.toml``.

    Raises `ScriptError` for tables that are none.
    """
    try:
        return {
            control: [motion for table in tables for motion in _motions(table)]
            for control, held in drivers.items()
            if (tables := held if isinstance(held, list) else [held])
        }
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        raise ScriptError(f'expected node = "eye_L", rotate = [0, 25, 0]: {error!r}') from error


def offsets_of(motions: Mapping[str, Sequence[Motion]], place: Place) -> list[float]:
    """What a place is when all controls are 0."""
    (first, *others) = [m for some in motions.values() for m in some if m.place == place]
    return [first.offset + sum(other.offset for other in others)] * len(first.amount)


def added(motions: Mapping[str, Sequence[Motion]], values: Mapping[str, float]) -> Sums:
    """What the places are, given the values of some controls; others are 0."""
    sums: Sums = {}
    for control, value in values.items():
        for motion in motions[control]:
            whole = sums.setdefault(motion.place, offsets_of(motions, motion.place))
            sums[motion.place] = [a + value * b for a, b in zip(whole, motion.amount)]
    return sums


def controls_at(
    motions: Mapping[str, Sequence[Motion]], places: Sums, known: Mapping[str, float]
) -> dict[str, float]:
    """The controls that bring places to where they are, as nearly as they can, beside known ones.

    Controls that pull a place to opposite sides, such as a look in and a look out, are positive.
    """
    there = {c: found for c in motions if (found := [m for m in motions[c] if m.place in places])}
    left = {p: [a - b for a, b in zip(v, offsets_of(motions, p))] for p, v in places.items()}
    values = {control: known.get(control, 0.0) for control in there}
    for control, value in values.items():
        _take_away(left, there[control], value)
    opposed = {c for c in there if any(_oppose(there[c], there[d]) for d in there)}
    for control in [c for c in there if c not in known] * _SWEEPS:
        found = there[control]
        pull = sum(a * b for m in found for a, b in zip(m.amount, left[m.place]))
        value = values[control] + pull / sum(a * a for m in found for a in m.amount)
        value = max(value, 0.0) if control in opposed else value
        _take_away(left, found, value - values[control])
        values[control] = value
    return values


def _motions(table: Mapping[str, Any]) -> list[Motion]:
    node = table["node"]
    vectors = [kind for kind in ("rotate", "translate") if any(table.get(kind, ()))]
    found = [Motion(Place(node, kind), _vector(table[kind])) for kind in vectors]
    if table.get("property"):
        place = Place(node, "property", table["property"])
        factor, offset = float(table.get("factor", 1.0)), float(table.get("offset", 0.0))
        if not factor:
            raise ValueError("a factor of 0")
        found.append(Motion(place, (factor,), offset))
    return found


def _vector(value: Any) -> tuple[float, ...]:
    x, y, z = map(float, value)
    return x, y, z


def _take_away(left: Sums, motions: Sequence[Motion], value: float) -> None:
    for motion in motions:
        left[motion.place] = [b - value * a for a, b in zip(motion.amount, left[motion.place])]


def _oppose(some: Sequence[Motion], others: Sequence[Motion]) -> bool:
    """Whether two controls pull places that they share to opposite sides."""
    pairs = [(a, b) for a in some for b in others if a.place == b.place]
    product = sum(x * y for a, b in pairs for x, y in zip(a.amount, b.amount))
    sizes = [sum(x * x for m in ms for x in m.amount) for ms in (some, others)]
    return bool(product < -0.9 * (sizes[0] * sizes[1]) ** 0.5)

"""Controls that are no shapes: they turn or shift nodes of the character, or set a property.

Bones and objects are nodes, each with axes of its own as it rests. A rotation is a vector: its
direction is the axis about which the node turns, its length the degrees at 1. Those of several
controls add up before the node turns, so that their order does not matter: an eye that looks up and
in turns about one axis between the two, as eyes do.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

from facert.data.names import NameIndex, nearest
from facert.errors import InputError

Vector = tuple[float, float, float]
NOWHERE: Vector = (0.0, 0.0, 0.0)
_KEYS = ("node", "rotate", "translate", "property", "factor", "offset")


@dataclass(frozen=True)
class Driver:
    """What one control does to one node; all is added to what the node is at rest.

    Raises `InputError` for text or numbers that are none, or a driver that does nothing.
    """

    control: str
    node: str
    rotate: Vector = NOWHERE
    """Axis of the node's own, as long as the degrees at 1."""
    translate: Vector = NOWHERE
    """Metres of the scene at 1, along the node's own axes."""
    property: str = ""
    """A custom property or an attribute of the node, for scripts: glTF has none to animate."""
    factor: float = 1.0
    """The property is offset + factor * control."""
    offset: float = 0.0

    def __post_init__(self) -> None:
        for key in ("control", "node"):
            if not isinstance(getattr(self, key), str) or not getattr(self, key):
                raise self._wrong(key, "a name", getattr(self, key))
        if not isinstance(self.property, str):
            raise self._wrong("property", "a name", self.property)
        for key in ("rotate", "translate"):
            object.__setattr__(self, key, self._vector(key, getattr(self, key)))
        for key in ("factor", "offset"):
            if not _is_number(getattr(self, key)):
                raise self._wrong(key, "a number", getattr(self, key))
        if self.property and not self.factor:
            raise self._wrong("factor", "a number other than 0", self.factor)
        if not self.moves() and not self.property:
            raise self._wrong(self.node, "rotate, translate or property", "none, or zeros")

    def moves(self) -> bool:
        """Whether it turns or shifts the node, which is more than to set a property."""
        return self.rotate != NOWHERE or self.translate != NOWHERE

    def _vector(self, key: str, value: Any) -> Vector:
        if not isinstance(value, (list, tuple)) or len(value) != 3:
            raise self._wrong(key, "three numbers", value)
        if not all(map(_is_number, value)):
            raise self._wrong(key, "three numbers", value)
        x, y, z = map(float, value)
        return x, y, z

    def _wrong(self, key: str, expected: str, found: Any) -> InputError:
        fix = 'Write it as in node = "eye_L", rotate = [0, 25, 0].'
        return InputError(f"[[{self.control}]] {key}", expected, f"{found!r}", fix)

    def table(self) -> dict[str, Any]:
        """The table that makes this driver, as plain values; what is as by default is left out."""
        held = {one.name: (getattr(self, one.name), one.default) for one in fields(self)[1:]}
        return {
            key: list(value) if isinstance(value, tuple) else value
            for key, (value, default) in held.items()
            if value != default
        }


@dataclass(frozen=True)
class Drivers:
    """All drivers of a character, in the order of their table."""

    entries: tuple[Driver, ...]

    @classmethod
    def of(cls, tables: Mapping[str, Any]) -> Drivers:
        """Drivers from tables as in a TOML file: by control, a list of tables, or a single one.

        Raises `InputError` for anything else, or none at all.
        """
        found = tuple(one for control, held in tables.items() for one in _of_control(control, held))
        if not found:
            fix = 'Write [[eyeLookInLeft]], and node = "eye_L" below.'
            raise InputError("drivers", "a control at least", "none", fix)
        return cls(found)

    @property
    def controls(self) -> tuple[str, ...]:
        """The names of the controls, each once."""
        return tuple(dict.fromkeys(one.control for one in self.entries))

    @property
    def nodes(self) -> tuple[str, ...]:
        """The names of the nodes that are turned or shifted, each once."""
        return tuple(dict.fromkeys(one.node for one in self.entries if one.moves()))

    @property
    def tables(self) -> dict[str, list[dict[str, Any]]]:
        """The tables that `of` takes, as plain values that JSON can hold."""
        found: dict[str, list[dict[str, Any]]] = {}
        for one in self.entries:
            found.setdefault(one.control, []).append(one.table())
        return found


def require_used(drivers: Sequence[str], controls: Sequence[str]) -> None:
    """Check that each control with a driver is one of a take's controls, in any spelling.

    Raises `InputError` for the first that is not, with the nearest one that is.
    """
    index = NameIndex.among(controls, drivers, "--drivers", halves=True, quiet=True)
    lost = next((one for one in drivers if not index.find_halves(one)), None)
    if lost is not None:
        near = nearest(lost, controls)
        hint = f"Did you mean {near!r}? " if near else ""
        fix = f"{hint}Correct the table, or leave it out."
        found = f"none among {len(controls)}"
        raise InputError("--drivers", f"a control {lost!r} in the take", found, fix)


def _of_control(control: str, held: Any) -> Iterator[Driver]:
    """Iterate over the drivers of a control."""
    for table in held if isinstance(held, list) else [held]:
        if not isinstance(table, Mapping):
            fix = f'Write [[{control}]], and node = "eye_L" below.'
            raise InputError(f"[[{control}]]", "a table", f"{table!r}", fix)
        unknown = [key for key in table if key not in _KEYS]
        if unknown or "node" not in table:
            field, found = f"[[{control}]]", repr(unknown[0]) if unknown else "no node"
            raise InputError(field, f"keys {', '.join(_KEYS)}", found, "Correct it.")
        yield Driver(control, **table)


def _is_number(value: Any) -> bool:
    plain = isinstance(value, (int, float)) and not isinstance(value, bool)
    return plain and abs(value) <= sys.float_info.max  # also of whole numbers, which have no end

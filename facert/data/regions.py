"""Regions of the face: which markers and which controls make one.

A model of the whole face takes whatever goes together in a few labels for a law: where every posed
smile has raised brows, each smile raises them. Regions are learned apart, so that the brows follow
the brows' markers alone. A control, or a marker, may belong to several.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Any

from facert.data.text import did_you_mean
from facert.errors import InputError

AUTO = "auto"
MOST = 6
"""Regions at most: a model file holds so many methods."""
_KEYS = ("markers", "controls")


@dataclass(frozen=True)
class Region:
    """A part of the face, with a model of its own.

    Raises `InputError` when it has no marker or no control, or one of them twice.
    """

    name: str
    markers: tuple[str, ...]
    """What it sees: names of the source's markers, or of its weights."""
    controls: tuple[str, ...]
    """What it moves."""

    def __post_init__(self) -> None:
        for key in _KEYS:
            names, field = getattr(self, key), f"regions.{self.name}.{key}"
            if not names:
                raise InputError(field, "at least one name", "none", "Add some, or drop it.")
            twice = next((name for name in names if names.count(name) > 1), None)
            if twice is not None:
                raise InputError(field, "each name once", f"{twice!r} twice", "Remove one.")


@dataclass(frozen=True)
class Regions:
    """All regions of a face, in the order of their names.

    Raises `InputError` when there are none, or more than `MOST`.
    """

    parts: tuple[Region, ...]

    def __post_init__(self) -> None:
        if not 1 <= len(self.parts) <= MOST:
            found, fix = f"{len(self.parts)}", "Merge some, or train without regions."
            raise InputError("regions", f"1 to {MOST} regions", found, fix)
        object.__setattr__(self, "parts", tuple(sorted(self.parts, key=lambda part: part.name)))

    @classmethod
    def of(cls, tables: Mapping[str, Any]) -> Regions:
        """Regions from tables as in a TOML file: ``{"brows": {"markers": [], "controls": []}}``.

        Raises `InputError` for anything else.
        """
        return cls(tuple(_region(name, table) for name, table in tables.items()))

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the regions."""
        return tuple(part.name for part in self.parts)

    @property
    def tables(self) -> dict[str, dict[str, list[str]]]:
        """The tables that `of` takes, as plain values."""
        return {
            part.name: {"markers": list(part.markers), "controls": list(part.controls)}
            for part in self.parts
        }

    def matched(self, markers: Sequence[str], controls: Sequence[str]) -> Regions:
        """The regions in the spelling of a take's markers and controls.

        A marker may be in no region.

        Raises `InputError` for a name that the take lacks, with the nearest one that it has; for a
        control that is in no region.
        """
        of_markers = self._spelled("markers", markers)
        of_controls = self._spelled("controls", controls)
        names = (part.name for part in self.parts)
        found = Regions(tuple(map(Region, names, of_markers, of_controls)))
        moved = {control for part in found.parts for control in part.controls}
        idle = [control for control in controls if control not in moved]
        if idle:
            also = f" and {len(idle) - 1} more" if len(idle) > 1 else ""
            fix = "Add it to one; to several if it belongs to them."
            raise InputError(
                "regions", "every control in a region", f"{idle[0]!r}{also} in none", fix
            )
        return found

    def _spelled(self, key: str, among: Sequence[str]) -> list[tuple[str, ...]]:
        """The markers or controls of each region, in the spelling of a take."""
        from facert.data.names import NameIndex  # NumPy, which settings and `--help` do without

        lists = [getattr(part, key) for part in self.parts]
        index = NameIndex.among(among, list(dict.fromkeys(chain(*lists))), f"regions: {key}")
        places = [
            index.places(names, f"regions.{part.name}.{key}")
            for part, names in zip(self.parts, lists, strict=True)
        ]
        return [tuple(among[place] for place in found) for found in places]

    def seen_by(self, markers: Sequence[str]) -> Regions:
        """The regions with only those of their markers that are among the given ones.

        Raises `InputError` when a region has none left.
        """
        return Regions(
            tuple(
                Region(part.name, tuple(m for m in part.markers if m in markers), part.controls)
                for part in self.parts
            )
        )


def _region(name: str, table: Any) -> Region:
    if not isinstance(table, Mapping):
        found = f"{type(table).__name__} {name!r}"
        raise InputError("regions", "a table a region", found, "Write [brows], markers, controls.")
    unknown = [key for key in table if key not in _KEYS]
    if unknown:
        known, fix = " and ".join(_KEYS), did_you_mean(unknown[0], _KEYS, "Remove or rename it.")
        raise InputError(f"regions.{name}", known, repr(unknown[0]), fix)
    return Region(name, *(_names(table.get(key, ()), f"regions.{name}.{key}") for key in _KEYS))


def _names(value: Any, field: str) -> tuple[str, ...]:
    plain = isinstance(value, Sequence) and not isinstance(value, str)
    if not plain or not all(isinstance(name, str) for name in value):
        raise InputError(field, "a list of names", f"{value!r}", 'Write it as ["one", "two"].')
    return tuple(value)

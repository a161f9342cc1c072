"""Arrays that were learned together, as a model file holds them: named, nested, of known shape."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, fields
from functools import cache
from typing import Annotated, Protocol, Self, TypeVar, get_origin, get_type_hints

from facert.data.arrays import FloatArray
from facert.errors import InputError

Array = TypeVar("Array")
DAMAGED = "The model file is damaged: train it again."


class Shaped(Protocol):
    """An array, or what a file declares of one."""

    @property
    def shape(self) -> tuple[int, ...]:
        """The size of each axis."""
        ...


@dataclass(frozen=True, eq=False)
class ArrayGroup:
    """Arrays that were learned together; a field may be a group of such arrays itself.

    The type of an array spells its shape, a letter an axis. A letter stands for one size in all of
    them ("x" for d_x, "y" for d_y), a digit for itself: ``weights: Annotated[FloatArray, "xy"]``.
    Where a file has another name for a field, it follows: ``Annotated[FloatArray, "y", "offset"]``.

    Raises `InputError` when the arrays do not fit together.
    """

    def __post_init__(self) -> None:
        check_axes(self.arrays, self.all_axes())

    @property
    def arrays(self) -> dict[str, FloatArray]:
        """Arrays by their names in files, those of a group as ``group.name``."""
        arrays, groups = self._spelled()
        own = {stored: getattr(self, name) for name, (_, stored) in arrays.items()}
        return own | {
            f"{group}.{name}": array
            for group in groups
            for name, array in getattr(self, group).arrays.items()
        }

    @classmethod
    def all_axes(cls) -> dict[str, str]:
        """The shape of every array, by the names of `arrays`."""
        arrays, groups = cls._spelled()
        return {stored: letters for letters, stored in arrays.values()} | {
            f"{name}.{inner}": letters
            for name, group in groups.items()
            for inner, letters in group.all_axes().items()
        }

    @classmethod
    def of(cls, arrays: Mapping[str, FloatArray], prefix: str = "") -> Self:
        """The group whose `arrays` these are, after a prefix."""
        own, groups = cls._spelled()
        return cls(
            **{name: arrays[prefix + stored] for name, (_, stored) in own.items()},
            **{name: group.of(arrays, f"{prefix}{name}.") for name, group in groups.items()},
        )

    @classmethod
    @cache
    def _spelled(cls) -> tuple[dict[str, tuple[str, str]], dict[str, type[ArrayGroup]]]:
        """Shape and stored name of each field that is an array, and the type of each group."""
        hints = get_type_hints(cls, include_extras=True)
        types = {field.name: hints[field.name] for field in fields(cls)}
        arrays = {
            name: (kind.__metadata__[0], kind.__metadata__[-1] if kind.__metadata__[1:] else name)
            for name, kind in types.items()
            if get_origin(kind) is Annotated
        }
        return arrays, {name: kind for name, kind in types.items() if name not in arrays}


def check_axes(arrays: Mapping[str, Shaped], axes: Mapping[str, str]) -> dict[str, int]:
    """The size that each letter stands for, found in the arrays; see `ArrayGroup`.

    Raises `InputError` when an array is absent or empty, or its shape is not as spelt.
    """
    sizes: dict[str, int] = {}
    for name, letters in axes.items():
        array = arrays.get(name)
        if array is None or len(array.shape) != len(letters) or 0 in array.shape:
            found = "nothing" if array is None else f"shape {array.shape}"
            raise InputError(name, f"an array of {len(letters)} dimensions", found, DAMAGED)
        for letter, size in zip(letters, array.shape, strict=True):
            expected = int(letter) if letter.isdigit() else sizes.setdefault(letter, size)
            if size != expected:
                raise InputError(name, f"{expected} for {letter}", f"shape {array.shape}", DAMAGED)
    return sizes


def require_known_arrays(arrays: Iterable[str], known: Collection[str]) -> None:
    """Refuse names of arrays that nobody would read, with an `InputError`."""
    unknown = next((name for name in arrays if name not in known), None)
    if unknown is not None:
        fix = "Install the facert that wrote it, or train it again."
        raise InputError(unknown, "no such array", "one", fix)


def part_of(arrays: Mapping[str, Array], prefix: str) -> dict[str, Array]:
    """The arrays whose names begin with a prefix, by the rest of their names."""
    return {n.removeprefix(prefix): a for n, a in arrays.items() if n.startswith(prefix)}

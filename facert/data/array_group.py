"""Arrays that were learned together, as a model file holds them: named, nested, of known shape."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

from facert.data.arrays import FloatArray
from facert.errors import InputError

DAMAGED = "The model file is damaged: train it again."


@dataclass(frozen=True, eq=False)
class ArrayGroup:
    """Arrays that were learned together; a field may be a group of such arrays itself.

    `axes` spells the shape of each array, a letter an axis. A letter stands for one size in all of
    them ("x" for d_x, "y" for d_y), a digit for itself: ``{"weights": "xy", "offset": "y"}``.
    `parts` has the type of each field that is a group.

    Raises
    ------
    InputError
        When the arrays do not fit together.
    """

    axes: ClassVar[Mapping[str, str]]
    parts: ClassVar[Mapping[str, type[ArrayGroup]]] = {}

    def __post_init__(self) -> None:
        check_axes(self.arrays, self.all_axes())

    @property
    def arrays(self) -> dict[str, FloatArray]:
        """Every array by its name, those of a part as ``part.name``."""
        own = {name: getattr(self, name) for name in self.axes}
        return own | {
            f"{part}.{name}": array
            for part in self.parts
            for name, array in getattr(self, part).arrays.items()
        }

    @classmethod
    def all_axes(cls) -> dict[str, str]:
        """The shape of every array."""
        return dict(cls.axes) | {
            f"{part}.{name}": letters
            for part, group in cls.parts.items()
            for name, letters in group.all_axes().items()
        }

    @classmethod
    def of(cls, arrays: Mapping[str, FloatArray], prefix: str = "") -> Self:
        """The group of these arrays, named as `arrays` names them."""
        own = {name: arrays[prefix + name] for name in cls.axes}
        groups = {name: part.of(arrays, f"{prefix}{name}.") for name, part in cls.parts.items()}
        return cls(**own, **groups)


def check_axes(arrays: Mapping[str, FloatArray], axes: Mapping[str, str]) -> dict[str, int]:
    """The size that each letter stands for, found in the arrays; see `ArrayGroup`.

    Raises
    ------
    InputError
        When an array is absent or empty, or its shape is not as spelt.
    """
    sizes: dict[str, int] = {}
    for name, letters in axes.items():
        array = arrays.get(name)
        if array is None or array.ndim != len(letters) or not array.size:
            found = "nothing" if array is None else f"shape {array.shape}"
            raise InputError(name, f"an array of {len(letters)} dimensions", found, DAMAGED)
        for letter, size in zip(letters, array.shape, strict=True):
            expected = int(letter) if letter.isdigit() else sizes.setdefault(letter, size)
            if size != expected:
                raise InputError(name, f"{expected} for {letter}", f"shape {array.shape}", DAMAGED)
    return sizes

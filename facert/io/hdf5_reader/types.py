"""What the elements of a dataset or an attribute are, and how many."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from facert.io.hdf5_reader.stored_bytes import DamagedError, Fields

_OTHERS = {
    2: "times", 4: "bit fields", 5: "opaque data", 6: "compounds", 7: "references",
    9: "sequences", 10: "arrays", 11: "complex numbers",
}  # fmt: skip
_INTEGER, _FLOAT, _TEXT, _BITS, _ENUMERATION, _VARIABLE = 0, 1, 3, 4, 8, 9
_PADDINGS = ("", "\0", " ")
_MOST_DIMENSIONS = 32
# Of IEEE 754: precision, then place and size of the exponent and the mantissa, and the bias.
_IEEE = {
    2: (16, 10, 5, 0, 10, 15),
    4: (32, 23, 8, 0, 23, 127),
    8: (64, 52, 11, 0, 52, 1023),
}


@dataclass(frozen=True)
class StoredType:
    """The type of an element."""

    name: str
    """For messages."""
    size: int
    """Bytes in the file."""
    numbers: np.dtype[Any] | None = None
    """Of integers, floats and flags; None for others."""
    flags: bool = False
    """Whether the integers stand for booleans."""
    text: Literal["", "fixed", "variable"] = ""
    """How text is stored; empty where there is none."""
    padding: str = ""
    """What fills up text of fixed length; empty where a zero ends it."""


_FLAGS = StoredType("bool", 1, np.dtype(np.uint8), flags=True)


@dataclass(frozen=True)
class Shape:
    """How many elements there are, and how many there may be once."""

    now: tuple[int, ...] | None
    """None where there is no room for any element."""
    most: tuple[int | None, ...]
    """None where there is no limit."""


def read_type(fields: Fields) -> StoredType:
    """Read a datatype message."""
    first = fields.number(1)
    kind, version = first & 15, first >> 4
    bits, size = fields.number(3), fields.number(4)
    if not 1 <= version <= 5 or not size:
        raise DamagedError(f"version {version} of a type of {size} bytes")
    if kind == _INTEGER:
        return _integer(fields, bits, size)
    if kind == _FLOAT:
        return _float(fields, bits, size)
    if kind == _TEXT:
        return _fixed_text(bits & 15, size)
    if kind == _BITS and size == 1:
        return _FLAGS  # as PyTables has booleans
    if kind == _ENUMERATION:
        return _enumeration(fields, bits & 0xFFFF, version)
    if kind == _VARIABLE and bits & 15 == 1:
        return StoredType("text", size, text="variable")
    if kind not in _OTHERS:
        raise DamagedError(f"an unknown type {kind}")
    return StoredType(_OTHERS[kind], size)


def read_shape(fields: Fields) -> Shape:
    """Read a dataspace message."""
    version, rank, flags = fields.version(1, 2), fields.number(1), fields.number(1)
    kind = fields.number(1)  # of version 1: reserved
    if rank > _MOST_DIMENSIONS:
        raise DamagedError(f"{rank} dimensions")
    if version == 1:
        fields.take(4)
    elif kind == 2:
        return Shape(None, ())
    now = tuple(fields.length() for _ in range(rank))
    if not flags & 1:
        return Shape(now, now)
    most = tuple(fields.address() for _ in range(rank))  # without a limit: as an undefined address
    return Shape(now, most)


def _fixed_text(padding: int, size: int) -> StoredType:
    if padding >= len(_PADDINGS):
        raise DamagedError(f"text with padding {padding}")
    return StoredType(f"text of {size} bytes", size, text="fixed", padding=_PADDINGS[padding])


def _order(bits: int) -> str:
    return ">" if bits & 1 else "<"


def _integer(fields: Fields, bits: int, size: int) -> StoredType:
    offset, precision = fields.number(2), fields.number(2)
    kind = "i" if bits & 8 else "u"
    if size not in (1, 2, 4, 8) or offset or precision != 8 * size:
        return StoredType(f"integers of {precision} bits in {size} bytes", size)
    return _numbers(np.dtype(f"{_order(bits)}{kind}{size}"))


def _float(fields: Fields, bits: int, size: int) -> StoredType:
    offset, precision = fields.number(2), fields.number(2)
    parts = tuple(fields.number(1) for _ in range(4))
    found = (precision, *parts, fields.number(4))
    if _IEEE.get(size) != found or offset or bits & 0x40:
        return StoredType(f"floats of {precision} bits in {size} bytes", size)
    return _numbers(np.dtype(f"{_order(bits)}f{size}"))


def _enumeration(fields: Fields, members: int, version: int) -> StoredType:
    """The type of what the members stand for; of FALSE and TRUE, as h5py has it, a boolean."""
    base = read_type(fields)
    if base.numbers is None or base.numbers.kind not in "iu":
        raise DamagedError(f"names of {base.name}")
    names = [_member(fields, version) for _ in range(members)]
    if sorted(names) == [b"FALSE", b"TRUE"] and base.size == 1:
        return _FLAGS
    return base


def _member(fields: Fields, version: int) -> bytes:
    before = fields.left
    name = fields.until_zero()
    if version < 3:
        fields.take((fields.left - before) % 8)
    return name


def _numbers(dtype: np.dtype[Any]) -> StoredType:
    return StoredType(dtype.name, dtype.itemsize, dtype)

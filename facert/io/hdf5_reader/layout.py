"""Where the elements of a dataset lie."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from facert.io.hdf5_reader.stored_bytes import DamagedError, Fields

_COMPACT, _CONTIGUOUS, _CHUNKED, _VIRTUAL = range(4)
_KINDS: tuple[Literal["compact", "contiguous", "chunked"], ...]
_KINDS = ("compact", "contiguous", "chunked")
Index = Literal["tree", "single", "implicit", "fixed array", "extensible array", "new tree"]
_INDICES: tuple[Index, ...]
_INDICES = ("single", "implicit", "fixed array", "extensible array", "new tree")


@dataclass(frozen=True)
class Layout:
    """What a layout message says."""

    kind: Literal["compact", "contiguous", "chunked", "virtual"]
    address: int | None = None
    content: bytes = b""
    """Of a compact dataset."""
    chunks: tuple[int, ...] = ()
    """Elements of a chunk in each dimension."""
    index: Index = "tree"
    """How the chunks are found."""
    parameters: tuple[int, ...] = ()
    """What the index has to know."""
    whole_edges: bool = False
    """Whether chunks at the edge that are not full are stored without filters."""


def read_layout(fields: Fields, rank: int) -> Layout:
    """Read a layout message of a dataset of some dimensions."""
    version = fields.version(1, 2, 3, 4, 5)
    if version < 3:
        return _old(fields, rank)
    kind = fields.number(1)
    if kind == _COMPACT:
        return Layout("compact", content=fields.take(fields.number(2)))
    if kind == _CONTIGUOUS:
        return Layout("contiguous", fields.address())
    if kind == _VIRTUAL:
        return Layout("virtual")
    if kind != _CHUNKED:
        raise DamagedError(f"a layout {kind}")
    if version == 3:
        dimensions, address = fields.number(1), fields.address()
        chunks = _sizes(fields, dimensions, 4, rank)
        return Layout("chunked", address, chunks=chunks)
    return _indexed(fields, rank)


def _old(fields: Fields, rank: int) -> Layout:
    dimensions, kind = fields.number(1), fields.number(1)
    fields.take(5)
    if kind > _CHUNKED:
        raise DamagedError(f"a layout {kind}")
    address = None if kind == _COMPACT else fields.address()
    if kind == _CHUNKED:
        return Layout("chunked", address, chunks=_sizes(fields, dimensions, 4, rank))
    fields.take(4 * dimensions)
    content = fields.take(fields.number(4)) if kind == _COMPACT else b""
    return Layout(_KINDS[kind], address, content)


def _indexed(fields: Fields, rank: int) -> Layout:
    """A layout whose chunks are found by one of five indices."""
    flags, dimensions, width = fields.number(1), fields.number(1), fields.number(1)
    chunks = _sizes(fields, dimensions, width, rank)
    kind = fields.number(1)
    if not 1 <= kind <= len(_INDICES):
        raise DamagedError(f"an index {kind}")
    index = _INDICES[kind - 1]
    parameters: tuple[int, ...] = ()
    if index == "single" and flags & 2:
        parameters = fields.length(), fields.number(4)
    elif index == "new tree":
        fields.take(6)
    elif index != "single":
        count = {"implicit": 0, "fixed array": 1, "extensible array": 5}[index]
        parameters = tuple(fields.number(1) for _ in range(count))
    return Layout("chunked", fields.address(), b"", chunks, index, parameters, bool(flags & 1))


def _sizes(fields: Fields, dimensions: int, width: int, rank: int) -> tuple[int, ...]:
    """Sizes of a chunk; the last one is that of an element."""
    if dimensions != rank + 1 or not rank:
        raise DamagedError(f"chunks of {dimensions - 1} dimensions in a dataset of {rank}")
    found = tuple(fields.number(width) for _ in range(dimensions))[:rank]
    if not all(found):
        raise DamagedError(f"chunks of shape {found}")
    return found

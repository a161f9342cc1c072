"""Chunks: which parts of a dataset are stored, and where.

An index is read as a whole into a table, which takes a few times what the index takes in the file.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from facert.data.arrays import IntArray
from facert.io.hdf5_reader.arrays_of_chunks import Blocks, extensible_array, fixed_array
from facert.io.hdf5_reader.layout import Index, Layout
from facert.io.hdf5_reader.stored_bytes import DamagedError, StoredBytes
from facert.io.hdf5_reader.trees import CHUNKS, new_records, old_leaves
from facert.io.hdf5_reader.types import Shape

_RECORDS, _FILTERED_RECORDS = 10, 11
_LARGEST = 2**62


@dataclass(frozen=True)
class ChunkTable:
    """The chunks of a dataset that are stored, a row each."""

    places: IntArray
    """(n, d): which chunk it is, counted along each dimension."""
    addresses: IntArray
    sizes: IntArray
    """Bytes in the file."""
    skipped: IntArray
    """A bit for each filter that was not applied."""

    def __len__(self) -> int:
        """How many chunks there are."""
        return len(self.addresses)


@dataclass(frozen=True)
class Chunked:
    """A dataset in chunks, as its header has it."""

    file: StoredBytes
    layout: Layout
    shape: Shape
    size: int
    """Bytes of a chunk."""
    filtered: bool

    def table(self) -> ChunkTable:
        """Find the chunks.

        Raises `DamagedError` where the index is damaged, names a chunk twice, or one beyond the
        dataset.
        """
        grid = self.grid(self.shape.now or (0,))
        if self.layout.address is None or not math.prod(grid):
            none = np.empty(0, np.int64)
            return ChunkTable(none.reshape(0, len(self.layout.chunks)), none, none, none)
        table = _READERS[self.layout.index](self, self.layout.address)
        if not ((table.places >= 0) & (table.places < np.array(grid))).all():
            raise DamagedError("a chunk beyond the dataset")
        numbers = np.ravel_multi_index(tuple(table.places.T), grid)
        if len(np.unique(numbers)) != len(table):
            raise DamagedError("a chunk that is there twice")
        return table

    def grid(self, shape: Iterable[int]) -> tuple[int, ...]:
        """Numbers of chunks along each dimension of a shape."""
        return tuple(-(-n // c) for n, c in zip(shape, self.layout.chunks, strict=True))

    def most(self) -> tuple[int, ...]:
        """Numbers of chunks along each dimension of the largest shape; 0 where it has no limit."""
        return self.grid(0 if n is None else n for n in self.shape.most)

    def rows(self, entries: bytes, places: IntArray | None, width: int = 8) -> ChunkTable:
        """The table of entries of an index.

        An entry is an address; with filters, a size in `width` bytes, and a mask; and without
        `places`, which chunk it is.
        """
        rank, offset = len(self.layout.chunks), self.file.offset_size
        packed = (width, 4) if self.filtered else ()
        columns = _columns(entries, (offset, *packed, *((8,) * rank if places is None else ())))
        if places is None:
            places = np.stack(columns[-rank:], axis=1)
        addresses = columns[0]
        full = np.full(len(addresses), self.size, np.int64)
        sizes, skipped = columns[1:3] if self.filtered else (full, np.zeros_like(full))
        stored = addresses != min(256**offset - 1, _LARGEST)
        return ChunkTable(places[stored], addresses[stored], sizes[stored], skipped[stored])


def _columns(content: bytes, widths: tuple[int, ...]) -> list[IntArray]:
    """The columns of a table of unsigned numbers in some bytes each, none above `_LARGEST`."""
    table = np.frombuffer(content, np.uint8).reshape(-1, sum(widths))
    found, at = [], 0
    for width in widths:
        column: NDArray[np.uint8] = np.zeros((len(table), 8), np.uint8)
        column[:, :width] = table[:, at : at + width]
        found.append(np.minimum(column.view("<u8")[:, 0], _LARGEST).astype(np.int64))
        at += width
    return found


def _tree(chunked: Chunked, address: int) -> ChunkTable:
    """Chunks by a B-tree of version 1: size, mask, where it begins (0 within elements), address."""
    rank, offset = len(chunked.layout.chunks), chunked.file.offset_size
    leaves = b"".join(old_leaves(chunked.file, address, CHUNKS, 16 + 8 * rank))
    columns = _columns(leaves, (4, 4, *(8,) * (rank + 1), offset))
    sizes, skipped = columns[:2]
    last, addresses = columns[-2:]
    begins = np.stack(columns[2:-2], axis=1)
    places, beside = np.divmod(begins, np.array(chunked.layout.chunks))
    if beside.any() or last.any():
        raise DamagedError("a chunk between others")
    if not chunked.filtered and (sizes != chunked.size).any():
        raise DamagedError("a chunk of another size")
    return ChunkTable(places, addresses, sizes, skipped)


def _single(chunked: Chunked, address: int) -> ChunkTable:
    size, skipped = chunked.layout.parameters or (chunked.size, 0)
    place = np.zeros((1, len(chunked.layout.chunks)), np.int64)
    rest = (np.array([min(n, _LARGEST)], np.int64) for n in (address, size, skipped))
    return ChunkTable(place, *rest)


def _implicit(chunked: Chunked, address: int) -> ChunkTable:
    """All chunks one after the other, also those that the dataset may have once."""
    most = chunked.most()
    if math.prod(most) * chunked.size > chunked.file.size:
        raise DamagedError("chunks beyond the end of the file")
    places = np.indices(chunked.grid(chunked.shape.now or ())).reshape(len(most), -1).T
    numbers: IntArray = np.asarray(np.ravel_multi_index(tuple(places.T), most))
    full = np.full(len(numbers), chunked.size, np.int64)
    return ChunkTable(places, address + numbers * chunked.size, full, np.zeros_like(full))


def _fixed(chunked: Chunked, address: int) -> ChunkTable:
    blocks = fixed_array(chunked.file, address, chunked.filtered)
    return _of_blocks(chunked, blocks, slowest=0)


def _extensible(chunked: Chunked, address: int) -> ChunkTable:
    blocks = extensible_array(chunked.file, address, chunked.filtered)
    return _of_blocks(chunked, blocks, slowest=chunked.most().index(0))


def _of_blocks(chunked: Chunked, blocks: Blocks, slowest: int) -> ChunkTable:
    """Chunks by their numbers, along the largest shape; one dimension is the slowest to change."""
    others = [n for i, n in enumerate(chunked.most()) if i != slowest]
    order = [slowest, *(i for i in range(len(others) + 1) if i != slowest)]
    width = blocks.entry - chunked.file.offset_size - 4
    tables = []
    for first, entries in blocks.contents:
        numbers = first + np.arange(len(entries) // blocks.entry)
        along, rest = np.divmod(numbers, math.prod(others))
        inner = np.unravel_index(rest, others) if others else ()
        places = np.stack([along, *inner], axis=1)[:, np.argsort(order)]
        tables.append(chunked.rows(entries, places, width))
    parts = zip(*((t.places, t.addresses, t.sizes, t.skipped) for t in tables), strict=True)
    return ChunkTable(*map(np.concatenate, parts))


def _new_tree(chunked: Chunked, address: int) -> ChunkTable:
    kind = _FILTERED_RECORDS if chunked.filtered else _RECORDS
    records = list(new_records(chunked.file, address, kind))
    rank, size = len(chunked.layout.chunks), len(records[0]) if records else 0
    width = size - chunked.file.offset_size - 4 - 8 * rank
    return chunked.rows(b"".join(records), None, width)


_READERS: Mapping[Index, Callable[[Chunked, int], ChunkTable]] = {
    "tree": _tree,
    "single": _single,
    "implicit": _implicit,
    "fixed array": _fixed,
    "extensible array": _extensible,
    "new tree": _new_tree,
}

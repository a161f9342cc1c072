"""Datasets: arrays of numbers, and lists of texts."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from facert.io.hdf5_reader.attributes import text_of
from facert.io.hdf5_reader.chunks import Chunked, ChunkTable
from facert.io.hdf5_reader.filters import KNOWN, OTHERS, read_filters, unpacked
from facert.io.hdf5_reader.heaps import GlobalHeap
from facert.io.hdf5_reader.layout import Layout, read_layout
from facert.io.hdf5_reader.objects import (
    DATASPACE,
    DATATYPE,
    EXTERNAL,
    FILL,
    FILTERS,
    LAYOUT,
    OLD_FILL,
    Messages,
)
from facert.io.hdf5_reader.stored_bytes import DamagedError, StoredBytes
from facert.io.hdf5_reader.types import read_shape, read_type


def is_dataset(messages: Messages) -> bool:
    """Whether an object is a dataset."""
    return messages.keys() >= {LAYOUT, DATASPACE, DATATYPE}


class Dataset:
    """A dataset, as its header declares it; its elements are read when they are asked for."""

    def __init__(self, file: StoredBytes, messages: Messages) -> None:
        self._file = file
        self.type = read_type(file.fields_of(messages[DATATYPE][0]))
        self._shape = read_shape(file.fields_of(messages[DATASPACE][0]))
        self.shape = self._shape.now
        """None for an empty dataspace."""
        self._filters = self._read_filters(messages)
        self._layout = self._read_layout(messages)
        self._fill = self._read_fill(messages)
        self.elsewhere = EXTERNAL in messages or self._layout.kind == "virtual"
        """Whether the elements are in other files."""

    def __str__(self) -> str:
        """Type and shape, for messages."""
        return f"{self.type.name} {self.shape}"

    @property
    def foreign_filter(self) -> str:
        """Name or number of a filter that is not known; empty if there is none."""
        foreign = (number for number in self._filters if number not in KNOWN)
        return next((OTHERS.get(number, str(number)) for number in foreign), "")

    @property
    def values_of_a_chunk(self) -> int:
        """How many elements are unpacked at once."""
        return math.prod(self._layout.chunks)

    def unpacked_size(self, start: int, stop: int) -> int:
        """Bytes of all chunks that hold some of these rows: what is made to read them."""
        if self._layout.kind != "chunked":
            return 0
        return len(self._chunks_of(start, stop)) * self._chunk_size

    def numbers(self, dtype: DTypeLike, start: int, stop: int) -> NDArray[Any]:
        """Read some rows of a dataset of numbers, as numbers of another type."""
        shape = (stop - start, *(self.shape or ())[1:])
        found = np.empty(shape, dtype)
        if found.size:
            self._read_into(found, start)
        return found

    def scalar(self, dtype: DTypeLike) -> NDArray[Any]:
        """Read the one number of a dataset without dimensions."""
        return np.array(self._elements(self._plain(0, self.type.size))[0], dtype)

    def texts(self) -> Iterator[bytes]:
        """Read a list of texts, one after the other."""
        stored = np.empty((self.shape or (0,))[0], np.dtype((np.void, self.type.size)))
        if stored.size:
            self._read_into(stored, 0)
        heap = GlobalHeap(self._file)
        for element in stored:
            yield text_of(self.type, element.tobytes(), heap)

    @property
    def _dtype(self) -> np.dtype[Any]:
        return self.type.numbers or np.dtype((np.void, self.type.size))

    @property
    def _chunk_size(self) -> int:
        return self.values_of_a_chunk * self.type.size

    @cached_property
    def _table(self) -> ChunkTable:
        filtered = bool(self._filters)
        return Chunked(self._file, self._layout, self._shape, self._chunk_size, filtered).table()

    def _chunks_of(self, start: int, stop: int) -> NDArray[np.int64]:
        """Which of the stored chunks have some of these rows."""
        first, length = self._table.places[:, 0], self._layout.chunks[0]
        return np.flatnonzero((first * length < stop) & ((first + 1) * length > start))

    def _read_into(self, found: NDArray[Any], start: int) -> None:
        """Read as many rows as there is room for."""
        if self._layout.kind == "chunked":
            self._read_chunks(found, start)
            return
        row = math.prod(found.shape[1:]) * self.type.size
        content = self._plain(start * row, len(found) * row)
        found[...] = self._elements(content).reshape(found.shape)

    def _plain(self, begin: int, count: int) -> bytes:
        """Bytes of a dataset that lies in one piece; as if filled where it was never written."""
        if self._layout.kind == "compact":
            content = self._layout.content[begin : begin + count]
        elif self._layout.address is None:
            content = self._fill * (count // self.type.size)
        else:
            content = self._file.read(self._layout.address + begin, count)
        if len(content) != count:
            raise DamagedError("fewer elements than there should be")
        return content

    def _elements(self, content: bytes | bytearray) -> NDArray[Any]:
        return np.frombuffer(content, self._dtype)

    def _read_chunks(self, found: NDArray[Any], start: int) -> None:
        """Read rows from `start` on, chunk by chunk."""
        chunks, chosen = np.array(self._layout.chunks), self._chunks_of(start, start + len(found))
        first, end = np.zeros_like(chunks), np.array(found.shape)
        first[0], end[0] = start, start + len(found)
        if len(chosen) < math.prod(-(-end // chunks) - first // chunks):
            found[...] = self._elements(self._fill)[0]
        begins = self._table.places[chosen] * chunks
        lows, highs = np.maximum(begins, first), np.minimum(begins + chunks, end)
        inside = np.stack([lows - begins, highs - begins], axis=2).tolist()
        outside = np.stack([lows - first, highs - first], axis=2).tolist()
        at_edge = (begins + chunks > np.array(self.shape)).any(axis=1)
        for chunk, edge, source, target in zip(chosen, at_edge, inside, outside, strict=True):
            values = self._unpacked(int(chunk), bool(edge)).reshape(self._layout.chunks)
            found[tuple(slice(*ends) for ends in target)] = values[
                tuple(slice(*ends) for ends in source)
            ]

    def _unpacked(self, chunk: int, at_edge: bool) -> NDArray[Any]:
        """The elements of one chunk."""
        table = self._table
        content = self._file.read(int(table.addresses[chunk]), int(table.sizes[chunk]))
        plain = at_edge and self._layout.whole_edges
        filters, skipped = () if plain else self._filters, int(table.skipped[chunk])
        sizes = self._chunk_size, self.type.size
        return self._elements(unpacked(content, filters, skipped, *sizes))

    def _read_filters(self, messages: Messages) -> tuple[int, ...]:
        found = messages.get(FILTERS)
        return read_filters(self._file.fields_of(found[0])) if found else ()

    def _read_layout(self, messages: Messages) -> Layout:
        fields = self._file.fields_of(messages[LAYOUT][0])
        return read_layout(fields, len(self.shape or ()))

    def _read_fill(self, messages: Messages) -> bytes:
        """The bytes of an element that was never written."""
        none = bytes(self.type.size)
        if FILL in messages:
            fields = self._file.fields_of(messages[FILL][0])
            version = fields.version(1, 2, 3)
            flags = fields.number(1) if version == 3 else fields.number(3) >> 16
            stated = flags & 0x20 if version == 3 else version == 1 or flags
        elif OLD_FILL in messages:
            fields, stated = self._file.fields_of(messages[OLD_FILL][0]), 1
        else:
            return none
        content = fields.take(fields.number(4)) if stated else b""
        if content and len(content) != self.type.size:
            raise DamagedError(f"an element of {len(content)} bytes for {self.type.size}")
        return content or none

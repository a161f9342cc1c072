"""Heaps: where names and texts of any length are kept."""

from __future__ import annotations

from functools import cached_property

from facert.io.hdf5_reader.stored_bytes import DamagedError, StoredBytes
from facert.io.hdf5_reader.trees import new_records

_HUGE_OBJECTS = 1


def local_heap(file: StoredBytes, address: int) -> bytes:
    """The names of a group of the old kind."""
    fields = file.fields(address, 8 + 2 * file.length_size + file.offset_size)
    fields.require(b"HEAP")
    fields.version(0)
    fields.take(3)
    size = fields.length()
    fields.length()
    return file.read(fields.defined(), size)


def name_at(heap: bytes, offset: int) -> bytes:
    """The name at an offset of a local heap."""
    end = heap.find(b"\0", offset)
    if not 0 <= offset < len(heap) or end < 0:
        raise DamagedError("a name beyond its heap")
    return heap[offset:end]


class GlobalHeap:
    """Texts of variable length; each collection is read once."""

    def __init__(self, file: StoredBytes) -> None:
        self._file = file
        self._collections: dict[int, dict[int, bytes]] = {}

    def text(self, element: bytes) -> bytes:
        """The text to which the element of an array refers."""
        fields = self._file.fields_of(element)
        size, address, index = fields.number(4), fields.address(), fields.number(4)
        if not size or not address:
            return b""
        if address not in self._collections:
            self._collections[address] = self._read(address)
        content = self._collections[address].get(index)
        if content is None or size > len(content):
            raise DamagedError("a text that is not in its heap")
        return content[:size]

    def _read(self, address: int) -> dict[int, bytes]:
        head = self._file.fields(address, 8 + self._file.length_size)
        head.require(b"GCOL")
        head.version(1)
        head.take(3)
        size = head.length()
        fields = self._file.fields(address, size)
        fields.take(8 + self._file.length_size)
        found: dict[int, bytes] = {}
        while fields.left >= 8 + self._file.length_size:
            index = fields.number(2)
            fields.take(6)
            length = fields.length()
            if not index:
                break  # the rest is free
            found[index] = fields.take(length)
            fields.take(min(-length % 8, fields.left))
        return found


class FractalHeap:
    """Links and attributes of an object that has many, in blocks that double in size."""

    def __init__(self, file: StoredBytes, address: int) -> None:
        self._file, self._address = file, address
        o, s = file.offset_size, file.length_size
        fields = file.checked(address, 26 + 3 * o + 12 * s, b"FRHP")
        fields.version(0)
        self.id_size, filters = fields.number(2), fields.number(2)
        self._guarded = bool(fields.number(1) & 2)
        largest = fields.number(4)
        fields.length()
        self._huge = fields.address()
        fields.take(o + 9 * s)
        self._width, self._first = fields.number(2), fields.length()
        self._largest_direct, bits = fields.length(), fields.number(2)
        fields.take(2)
        self._root, self._rows = fields.address(), fields.number(2)
        if filters or not self._width or not self._first or bits > 64:
            raise DamagedError("a heap that facert does not read")
        self._offset_size = (bits + 7) // 8
        block = (self._largest_direct.bit_length() - 1 + 7) // 8
        self._length_size = min(block, (largest.bit_length() - 1) // 8 + 1) if largest else block

    def content(self, identifier: bytes) -> bytes:
        """The bytes of one object."""
        fields = self._file.fields_of(identifier)
        first = fields.number(1)
        kind = first >> 4
        if kind == 0:
            offset = fields.number(self._offset_size)
            return self._managed(offset, fields.number(self._length_size))
        if kind == 2 and self.id_size <= 17:
            return fields.take((first & 15) + 1)
        if kind == 2:
            return fields.take(((first & 15) << 8 | fields.number(1)) + 1)
        if kind == 1 and self._huge is not None:
            return self._huge_content(fields.take(min(fields.left, self._file.length_size)))
        raise DamagedError(f"an object {kind} of a heap")

    @cached_property
    def _huge_records(self) -> list[bytes]:
        return list(new_records(self._file, self._huge or 0, _HUGE_OBJECTS))

    def _huge_content(self, key: bytes) -> bytes:
        for record in self._huge_records:
            fields = self._file.fields_of(record)
            address, length = fields.defined(), fields.length()
            if fields.take(fields.left)[: len(key)] == key:
                return self._file.read(address, length)
        raise DamagedError("an object that is not in its heap")

    def _managed(self, offset: int, length: int) -> bytes:
        at, begin, rows = self._root, 0, self._rows
        while at is not None and rows:
            at, begin, rows = self._descend(at, begin, rows, offset)
        if at is None or offset < begin:
            raise DamagedError("an object in a block that is not there")
        head = self._file.fields(at, 4)
        head.require(b"FHDB")
        return self._file.read(at + offset - begin, length)

    def _descend(self, at: int, begin: int, rows: int, offset: int) -> tuple[int | None, int, int]:
        """From an indirect block to the one below it that has an offset: address, begin, rows."""
        o = self._file.offset_size
        used = 9 + o + self._offset_size + rows * self._width * o
        fields = self._file.checked(at, used, b"FHIB")
        fields.version(0)
        fields.take(o + self._offset_size)
        for row in range(rows):
            size = self._first << max(row - 1, 0)
            if offset < begin + size * self._width:
                column = (offset - begin) // size
                fields.take(column * o)
                below = 0
                if size > self._largest_direct:
                    span = (size // (self._first * self._width)).bit_length()
                    below = max(span, 1)
                return fields.address(), begin + column * size, below
            begin += size * self._width
            fields.take(self._width * o)
        raise DamagedError("an object beyond its heap")

"""Two indices of chunks that are arrays of entries: of fixed length, and extensible."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from facert.io.hdf5_reader.stored_bytes import DamagedError, Fields, StoredBytes

_MOST_BITS = 64


class Blocks(NamedTuple):
    """The entries of chunks by their numbers."""

    entry: int
    """Bytes of an entry."""
    contents: list[tuple[int, bytes]]
    """The number of the first of some entries, and these."""


def fixed_array(file: StoredBytes, address: int, filtered: bool) -> Blocks:
    """Read all entries of a fixed array."""
    header = file.checked(address, 12 + file.length_size + file.offset_size, b"FAHD")
    entry = _entry(header, filtered)
    page = 1 << min(header.number(1), _MOST_BITS)
    count, at = header.length(), header.address()
    if at is None:
        return Blocks(entry, [(0, b"")])
    prefix = 6 + file.offset_size
    if count <= page:
        whole = file.checked(at, prefix + count * entry + 4, b"FADB")
        whole.take(prefix - 4)
        return Blocks(entry, [(0, whole.take(count * entry))])
    pages = -(-count // page)
    head = file.checked(at, prefix + (pages + 7) // 8 + 4, b"FADB")
    head.take(prefix - 4)
    there = _bits(head.take((pages + 7) // 8))
    begin = at + prefix + (pages + 7) // 8 + 4
    return Blocks(entry, _pages(file, begin, 0, count, page, entry, there))


def _bits(content: bytes) -> list[bool]:
    return [bool(byte & 0x80 >> bit) for byte in content for bit in range(8)]


def _pages(
    file: StoredBytes, at: int, first: int, count: int, page: int, entry: int, there: list[bool]
) -> list[tuple[int, bytes]]:
    """The pages of a block of entries that have been written, each with its checksum."""
    found = [(first, b"")]
    for index, number in enumerate(range(0, count, page)):
        size = min(page, count - number) * entry
        if there[index]:
            content = file.checked(at, size + 4, b"")
            found.append((first + number, content.take(size)))
        at += size + 4
    return found


class _Extensible(NamedTuple):
    """What the header of an extensible array says."""

    file: StoredBytes
    entry: int
    prefix: int
    """Bytes before the content of a block: signature, version, kind, and the header's address."""
    offset: int
    """Bytes of a block's place in the array."""
    page: int
    """Entries of a page."""


def extensible_array(file: StoredBytes, address: int, filtered: bool) -> Blocks:
    """Read all entries of an extensible array.

    The first ones stand in its index block; then come blocks of entries, which double in size
    after every other super block: the addresses of the first of these blocks stand in the index
    block as well, all others in super blocks of their own.
    """
    header = file.checked(address, 16 + 6 * file.length_size + file.offset_size, b"EAHD")
    entry = _entry(header, filtered)
    bits, in_index, least, pointers, page_bits = (header.number(1) for _ in range(5))
    header.take(6 * file.length_size)
    at = header.address()
    if at is None:
        return Blocks(entry, [(0, b"")])
    if bits > _MOST_BITS or page_bits > bits or not _is_power(least) or not _is_power(pointers):
        raise DamagedError("an array of chunks without sense")
    prefix = 6 + file.offset_size
    array = _Extensible(file, entry, prefix, (bits + 7) // 8, 1 << page_bits)
    supers = 1 + bits - (least.bit_length() - 1)
    direct = min(2 * (pointers.bit_length() - 1), supers)
    blocks, o = 2 * (pointers - 1), file.offset_size
    used = prefix + in_index * entry + (blocks + supers - direct) * o + 4
    index = file.checked(at, used, b"EAIB")
    index.take(prefix - 4)
    contents = [(0, index.take(in_index * entry))]
    first = in_index
    for number in range(supers):
        count, size = 1 << number // 2, least << (number + 1) // 2
        if number < direct:
            addresses = [index.address() for _ in range(count)]
            contents += _data_blocks(array, addresses, first, size, None)
        else:
            block = index.address()
            if block is not None:
                contents += _super_block(array, block, first, count, size)
        first += count * size
    return Blocks(entry, contents)


def _super_block(
    array: _Extensible, at: int, first: int, count: int, size: int
) -> Iterator[tuple[int, bytes]]:
    file = array.file
    pages = size // array.page if size > array.page else 0
    marks = (pages + 7) // 8
    used = array.prefix + array.offset + count * (marks + file.offset_size) + 4
    fields = file.checked(at, used, b"EASB")
    fields.take(array.prefix - 4 + array.offset)
    bits = _bits(fields.take(count * marks))  # those of all blocks one after the other
    there = [bits[block * pages : (block + 1) * pages] for block in range(count)]
    addresses = [fields.address() for _ in range(count)]
    yield from _data_blocks(array, addresses, first, size, there)


def _data_blocks(
    array: _Extensible,
    addresses: list[int | None],
    first: int,
    size: int,
    there: list[list[bool]] | None,
) -> Iterator[tuple[int, bytes]]:
    """The entries of blocks of some size; those in pages have marks of which pages are there."""
    head = array.prefix + array.offset
    for number, at in enumerate(addresses):
        begin = first + number * size
        if at is None:
            continue
        if size <= array.page:
            fields = array.file.checked(at, head + size * array.entry + 4, b"EADB")
            fields.take(head - 4)
            yield begin, fields.take(size * array.entry)
        elif there is not None:
            array.file.checked(at, head + 4, b"EADB")
            pages = at + head + 4
            yield from _pages(
                array.file, pages, begin, size, array.page, array.entry, there[number]
            )


def _entry(header: Fields, filtered: bool) -> int:
    """The size of an entry, from the header of an array."""
    header.version(0)
    kind, entry = header.number(1), header.number(1)
    if kind != int(filtered) or not 1 <= entry <= 32:
        raise DamagedError(f"entries {kind} of {entry} bytes")
    return entry


def _is_power(number: int) -> bool:
    return number.bit_count() == 1

"""Objects of a file: groups and datasets are headers, and a header is a list of messages."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence

from facert.io.hdf5_reader.stored_bytes import DamagedError, Fields, StoredBytes

SIGNATURE = b"\x89HDF\r\n\x1a\n"
DATASPACE, LINK_INFO, DATATYPE, OLD_FILL, FILL, LINK, EXTERNAL = 1, 2, 3, 4, 5, 6, 7
LAYOUT, FILTERS, ATTRIBUTE, CONTINUED, SYMBOLS, ATTRIBUTE_INFO = 8, 11, 12, 16, 17, 21
"""The kinds of messages."""
_SHARED, _COMMITTED = 2, 2
_PREFIX = 16

Messages = Mapping[int, Sequence[bytes]]
"""Contents of an object's messages, by kind."""


def read_superblock(file: StoredBytes) -> int:
    """Read what the file begins with, and return the address of the root group."""
    begin = superblock_at(file)
    if begin is None:
        raise DamagedError("no signature of HDF5")
    fields = file.fields_of(file.up_to(begin, 128))
    fields.require(SIGNATURE)
    if fields.version(0, 1, 2, 3) < 2:
        return _old_superblock(file, begin)
    sizes = fields.number(1), fields.number(1)
    _set_sizes(file, *sizes)
    fields = file.checked(begin, 16 + 4 * file.offset_size, SIGNATURE[:4])
    fields.take(8)
    return _root(file, begin, fields, between=1)


def superblock_at(file: StoredBytes) -> int | None:
    """Where the superblock begins, as a block of the user's may stand before it."""
    at = 0
    while at + len(SIGNATURE) <= file.size:
        if file.read(at, len(SIGNATURE)) == SIGNATURE:
            return at
        at = 2 * at or 512
    return None


def _old_superblock(file: StoredBytes, begin: int) -> int:
    fields = file.fields_of(file.up_to(begin, 128))
    fields.take(8)
    version = fields.number(1)
    fields.take(4)
    sizes = fields.number(1), fields.number(1)
    fields.take(9 if version == 0 else 13)
    _set_sizes(file, *sizes)
    rest = file.fields_of(fields.take(fields.left))
    return _root(file, begin, rest, between=1, entry=True)


def _set_sizes(file: StoredBytes, offsets: int, lengths: int) -> None:
    if {offsets, lengths} - {2, 4, 8}:
        raise DamagedError(f"addresses of {offsets} and lengths of {lengths} bytes")
    file.offset_size, file.length_size = offsets, lengths


def _root(file: StoredBytes, begin: int, fields: Fields, between: int, entry: bool = False) -> int:
    """The root group's address; `between` other addresses stand before that of the end."""
    base = fields.defined()
    for _ in range(between):
        fields.address()
    end = fields.defined()
    if base not in (0, begin) or end > file.size:
        raise DamagedError(f"{file.size} bytes of a file of {end}")
    file.base = base
    if entry:  # the root's entry in a symbol table
        fields.address()
        fields.address()
    return fields.defined()


def read_messages(file: StoredBytes, address: int) -> Messages:
    """Read an object's messages; those that are shared are read where they are."""
    messages: dict[int, list[bytes]] = defaultdict(list)
    for kind, flags, content in _messages(file, address):
        messages[kind].append(_shared(file, kind, content) if flags & _SHARED else content)
    return dict(messages)


def shared_message(file: StoredBytes, fields: Fields, kind: int) -> bytes:
    """The content of a message that another object has, such as a type with a name."""
    version = fields.version(1, 2, 3)
    where = fields.number(1)
    if version == 1:
        fields.take(6 + file.length_size)
    elif version == 3 and where != _COMMITTED:
        raise DamagedError("a message in a heap of shared ones, which facert does not read")
    for found, flags, content in _messages(file, fields.defined()):
        if found == kind and not flags & _SHARED:
            return content
    raise DamagedError("a shared message that is not there")


def _shared(file: StoredBytes, kind: int, content: bytes) -> bytes:
    return shared_message(file, file.fields_of(content), kind)


def _messages(file: StoredBytes, address: int) -> list[tuple[int, int, bytes]]:
    """Kind, flags and content of all messages of a header."""
    head = file.up_to(address, 4)
    return _new_header(file, address) if head == b"OHDR" else _old_header(file, address)


def _old_header(file: StoredBytes, address: int) -> list[tuple[int, int, bytes]]:
    fields = file.fields(address, _PREFIX)
    fields.version(1)
    fields.take(1)
    count = fields.number(2)
    fields.take(4)
    blocks = [file.fields(address + _PREFIX, fields.number(4))]
    found: list[tuple[int, int, bytes]] = []
    for block in blocks:  # which grow as continuations are met
        while block.left >= 8 and len(found) < count:
            kind, size, flags = block.number(2), block.number(2), block.number(1)
            block.take(3)
            found.append((kind, flags, block.take(size)))
            if kind == CONTINUED:
                rest = file.fields_of(found[-1][2])
                blocks.append(file.fields(_next(file, rest), rest.length()))
    if len(found) != count:
        raise DamagedError(f"{len(found)} of {count} messages")
    return found


def _next(file: StoredBytes, continuation: Fields) -> int:
    """The address of a header's next block."""
    address = continuation.defined()
    file.visit(address)
    return address


def _new_header(file: StoredBytes, address: int) -> list[tuple[int, int, bytes]]:
    fields = file.fields_of(file.up_to(address, 64))
    fields.require(b"OHDR")
    fields.version(2)
    flags = fields.number(1)
    optional = (16 if flags & 0x20 else 0) + (4 if flags & 0x10 else 0)
    fields.take(optional)
    width = 1 << (flags & 3)
    head = 6 + optional + width
    first = file.checked(address, head + fields.number(width) + 4, b"OHDR")
    first.take(head - 4)
    blocks = [first]
    found: list[tuple[int, int, bytes]] = []
    before = 6 if flags & 4 else 4
    for block in blocks:
        while block.left >= before:  # else a gap
            kind, length, marks = block.number(1), block.number(2), block.number(1)
            block.take(before - 4)
            found.append((kind, marks, block.take(length)))
            if kind == CONTINUED:
                rest = file.fields_of(found[-1][2])
                blocks.append(file.checked(_next(file, rest), rest.length(), b"OCHK"))
    return found

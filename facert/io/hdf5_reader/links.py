"""Links: what is in a group, by name."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from facert.io.hdf5_reader.heaps import FractalHeap, local_heap, name_at
from facert.io.hdf5_reader.objects import LINK, LINK_INFO, SYMBOLS, Messages
from facert.io.hdf5_reader.stored_bytes import DamagedError, Fields, StoredBytes
from facert.io.hdf5_reader.trees import GROUP, new_records, old_leaves

Links = Mapping[bytes, int | None]
"""Addresses of objects by their names; None for a link to a name, in this file or another."""
_BY_NAME = 5
_HARD, _TO_NAME = 0, 2


def is_group(messages: Messages) -> bool:
    """Whether an object is a group."""
    return bool({LINK, LINK_INFO, SYMBOLS} & messages.keys())


def read_links(file: StoredBytes, messages: Messages) -> Links:
    """Read all links of a group."""
    found: dict[bytes, int | None] = {}
    for name, address in _links(file, messages):
        if name in found:
            raise DamagedError(f"two links of the name {name!r}")
        found[name] = address
    return found


def _links(file: StoredBytes, messages: Messages) -> Iterator[tuple[bytes, int | None]]:
    for content in messages.get(SYMBOLS, ()):
        fields = file.fields_of(content)
        yield from _symbols(file, fields.defined(), fields.defined())
    for content in messages.get(LINK, ()):
        yield _link(file.fields_of(content))
    for content in messages.get(LINK_INFO, ()):
        fields = file.fields_of(content)
        fields.version(0)
        fields.take(8 if fields.number(1) & 1 else 0)
        heap, tree = fields.address(), fields.address()
        if heap is not None and tree is not None:
            yield from _many(file, heap, tree)


def _symbols(file: StoredBytes, tree: int, heap: int) -> Iterator[tuple[bytes, int | None]]:
    """The links of a group of the old kind."""
    names = local_heap(file, heap)
    for leaf in old_leaves(file, tree, GROUP, file.length_size):
        nodes = file.fields_of(leaf)
        while nodes.left:
            nodes.length()
            at = nodes.defined()
            file.visit(at)
            head = file.fields(at, 8)
            head.require(b"SNOD")
            head.version(1)
            head.take(1)
            count = head.number(2)
            entry = 2 * file.offset_size + 24
            symbols = file.fields(at + 8, count * entry)
            for _ in range(count):
                name, address = symbols.defined(), symbols.address()
                kind = symbols.number(4)
                symbols.take(20)
                yield name_at(names, name), None if kind == _TO_NAME else address


def _many(file: StoredBytes, heap: int, tree: int) -> Iterator[tuple[bytes, int | None]]:
    objects = FractalHeap(file, heap)
    for record in new_records(file, tree, _BY_NAME):
        yield _link(file.fields_of(objects.content(record[4 : 4 + objects.id_size])))


def _link(fields: Fields) -> tuple[bytes, int | None]:
    fields.version(1)
    flags = fields.number(1)
    kind = fields.number(1) if flags & 8 else _HARD
    fields.take((8 if flags & 4 else 0) + (1 if flags & 16 else 0))
    name = fields.take(fields.number(1 << (flags & 3)))
    return name, fields.defined() if kind == _HARD else None

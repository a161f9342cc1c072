"""B-trees, of both versions, from which all is taken in order."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from facert.io.hdf5_reader.stored_bytes import DamagedError, StoredBytes

GROUP, CHUNKS = 0, 1
"""Kinds of trees of version 1."""
_PREFIX = 10


def old_leaves(file: StoredBytes, address: int, kind: int, key_size: int) -> Iterator[bytes]:
    """The leaves of a tree of version 1: each is keys with addresses after them, and no last key.

    A child is one level below its parent, so that no path leads back.
    """
    waiting: list[tuple[int, int | None]] = [(address, None)]
    entry = key_size + file.offset_size
    prefix = 8 + 2 * file.offset_size
    while waiting:
        at, expected = waiting.pop()
        file.visit(at)
        fields = file.fields(at, prefix)
        fields.require(b"TREE")
        found, level, count = fields.number(1), fields.number(1), fields.number(2)
        if found != kind or expected not in (None, level):
            raise DamagedError(f"a node {found} of level {level} in a tree {kind}")
        entries = file.read(at + prefix, count * entry)
        if level == 0:
            yield entries
            continue
        children = file.fields_of(entries)
        below = []
        for _ in range(count):
            children.take(key_size)
            below.append((children.defined(), level - 1))
        waiting += reversed(below)


class _Tree(NamedTuple):
    """What the header of a tree of version 2 says."""

    kind: int
    node_size: int
    record_size: int
    count_sizes: tuple[int, ...]
    """Bytes of the number of records in all nodes below one, by its level; 0 for a leaf."""
    leaf_count_size: int
    """Bytes of the number of records in one node."""


def new_records(file: StoredBytes, address: int, kind: int) -> Iterator[bytes]:
    """The records of a tree of version 2."""
    fields = file.checked(address, 22 + file.offset_size + file.length_size, b"BTHD")
    fields.version(0)
    found, node_size, record_size = fields.number(1), fields.number(4), fields.number(2)
    depth = fields.number(2)
    fields.take(2)
    root, count = fields.address(), fields.number(2)
    if found != kind or not record_size or node_size < _PREFIX + record_size:
        raise DamagedError(f"a tree {found} of nodes of {node_size} bytes")
    sizes, of_leaf = _count_sizes(file, node_size, record_size, depth)
    tree = _Tree(kind, node_size, record_size, sizes, of_leaf)
    if root is not None and count:
        yield from _below(file, tree, root, count, depth)


def _below(file: StoredBytes, tree: _Tree, at: int, count: int, level: int) -> Iterator[bytes]:
    """The records of a node and of all below it, by a stack: depth is what the file says."""
    waiting = [(at, count, level)]
    while waiting:
        at, count, level = waiting.pop()
        file.visit(at)
        size = tree.record_size
        pointer = file.offset_size + tree.leaf_count_size + tree.count_sizes[max(level - 1, 0)]
        used = _PREFIX + count * size + (pointer * (count + 1) if level else 0)
        if used > tree.node_size:
            raise DamagedError(f"{count} records in a node of {tree.node_size} bytes")
        fields = file.checked(at, used, b"BTIN" if level else b"BTLF")
        fields.version(0)
        if fields.number(1) != tree.kind:
            raise DamagedError("a node of another tree")
        yield from [fields.take(size) for _ in range(count)]
        for _ in range(count + 1 if level else 0):
            child, records = fields.defined(), fields.number(tree.leaf_count_size)
            fields.take(tree.count_sizes[level - 1])
            waiting.append((child, records, level - 1))


def _count_sizes(
    file: StoredBytes, node_size: int, record_size: int, depth: int
) -> tuple[tuple[int, ...], int]:
    """How many bytes the numbers of records take, which depend on how many there may be."""
    if depth > 32:
        raise DamagedError(f"a tree of depth {depth}")
    room = (node_size - _PREFIX) // record_size
    of_leaf, all_below, sizes = _encoded(room), room, [0]
    for _ in range(depth):
        pointer = file.offset_size + of_leaf + sizes[-1]
        here = (node_size - _PREFIX - pointer) // (record_size + pointer)
        all_below = (here + 1) * all_below + here
        sizes.append(_encoded(max(all_below, 1)))
    return tuple(sizes), of_leaf


def _encoded(most: int) -> int:
    """Bytes that a number up to `most` takes."""
    return (most.bit_length() - 1) // 8 + 1

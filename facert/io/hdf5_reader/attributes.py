"""Attributes: single numbers and texts beside the arrays."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from facert.io.hdf5_reader.heaps import FractalHeap, GlobalHeap
from facert.io.hdf5_reader.objects import (
    ATTRIBUTE,
    ATTRIBUTE_INFO,
    DATASPACE,
    DATATYPE,
    Messages,
    shared_message,
)
from facert.io.hdf5_reader.stored_bytes import DamagedError, StoredBytes
from facert.io.hdf5_reader.trees import new_records
from facert.io.hdf5_reader.types import StoredType, read_shape, read_type

_BY_NAME = 8


class Attribute(NamedTuple):
    """An attribute of one element."""

    type: StoredType
    content: bytes

    def value(self, file: StoredBytes) -> float | int | bool | bytes | None:
        """The number or text; None for anything else."""
        if self.type.text:
            return text_of(self.type, self.content, GlobalHeap(file))
        if self.type.numbers is None:
            return None
        found: float | int = np.frombuffer(self.content, self.type.numbers, 1)[0].item()
        return bool(found) if self.type.flags else found


def text_of(type_: StoredType, element: bytes, heap: GlobalHeap) -> bytes:
    """The text that one element is, or refers to."""
    if type_.text == "variable":
        return heap.text(element).partition(b"\0")[0]
    return element.partition(b"\0")[0] if type_.ends_at_zero else element.rstrip(b"\0")


def find_attribute(file: StoredBytes, messages: Messages, name: bytes) -> Attribute | None:
    """Find an attribute; None where there is none.

    Raises `DamagedError` also for one of several elements, or of none.
    """
    for content in _attributes(file, messages):
        fields = file.fields_of(content)
        version, flags = fields.version(1, 2, 3), fields.number(1)
        sizes = [fields.number(2) for _ in range(3)]
        fields.take(1 if version == 3 else 0)
        padding = 8 if version == 1 else 1
        parts = []
        for size in sizes:
            parts.append(fields.take(size))
            fields.take(-size % padding)
        if parts[0].partition(b"\0")[0] != name:
            continue
        shared = flags if version > 1 else 0
        for part, bit, kind in ((1, 1, DATATYPE), (2, 2, DATASPACE)):
            if shared & bit:
                parts[part] = shared_message(file, file.fields_of(parts[part]), kind)
        type_ = read_type(file.fields_of(parts[1]))
        shape = read_shape(file.fields_of(parts[2])).now
        if shape is None or math.prod(shape) != 1:
            raise DamagedError(f"an array of shape {shape}")
        return Attribute(type_, fields.take(type_.size))
    return None


def _attributes(file: StoredBytes, messages: Messages) -> Iterator[bytes]:
    """The contents of all attributes."""
    yield from messages.get(ATTRIBUTE, ())
    for content in messages.get(ATTRIBUTE_INFO, ()):
        fields = file.fields_of(content)
        fields.version(0)
        fields.take(2 if fields.number(1) & 1 else 0)
        heap, tree = fields.address(), fields.address()
        if heap is not None and tree is not None:
            objects = FractalHeap(file, heap)
            for record in new_records(file, tree, _BY_NAME):
                yield objects.content(record[: objects.id_size])

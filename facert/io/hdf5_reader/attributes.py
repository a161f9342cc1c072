"""Attributes: single numbers and texts beside the arrays."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
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
from facert.io.hdf5_reader.stored_bytes import DamagedError, Fields, StoredBytes
from facert.io.hdf5_reader.trees import new_records
from facert.io.hdf5_reader.types import StoredType, read_shape, read_type

_BY_NAME = 8


class Attribute(NamedTuple):
    """An attribute as it is stored."""

    type: bytes
    shape: bytes
    shared: int
    """Bits for a type and a shape that another object has."""
    content: bytes

    def value(self, file: StoredBytes) -> float | int | bool | bytes:
        """The number or text; raises `DamagedError` also for anything else, or for several."""
        type_ = read_type(self._part(file, self.type, 1, DATATYPE))
        shape = read_shape(self._part(file, self.shape, 2, DATASPACE)).now
        if shape is None and type_.text:
            return b""  # as PyTables has empty text
        if shape is None or math.prod(shape) != 1:
            raise DamagedError(f"an array of shape {shape}")
        content = file.fields_of(self.content).take(type_.size)
        if type_.text:
            return text_of(type_, content, GlobalHeap(file))
        if type_.numbers is None:
            raise DamagedError(type_.name)
        found: float | int = np.frombuffer(content, type_.numbers)[0].item()
        return bool(found) if type_.flags else found

    def _part(self, file: StoredBytes, content: bytes, bit: int, kind: int) -> Fields:
        fields = file.fields_of(content)
        if self.shared & bit:
            return file.fields_of(shared_message(file, fields, kind))
        return fields


def text_of(type_: StoredType, element: bytes, heap: GlobalHeap) -> bytes:
    """The text that one element is, or refers to."""
    if type_.text == "variable":
        return heap.text(element).partition(b"\0")[0]
    if not type_.padding:
        return element.partition(b"\0")[0]
    return element.rstrip(type_.padding.encode())


def read_attributes(file: StoredBytes, messages: Messages) -> Mapping[bytes, Attribute]:
    """Read all attributes of an object; what they hold is looked at when it is asked for."""
    found = (_attribute(file.fields_of(one)) for one in _attributes(file, messages))
    return dict(found)


def _attribute(fields: Fields) -> tuple[bytes, Attribute]:
    version, flags = fields.version(1, 2, 3), fields.number(1)
    sizes = [fields.number(2) for _ in range(3)]
    fields.take(1 if version == 3 else 0)
    parts = []
    for size in sizes:
        parts.append(fields.take(size))
        fields.take(-size % (8 if version == 1 else 1))
    shared = flags if version > 1 else 0
    name = parts[0].partition(b"\0")[0]
    return name, Attribute(parts[1], parts[2], shared, fields.take(fields.left))


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

"""An HDF5 file that is open: its objects, and what is in its groups."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import BinaryIO

from facert.io.hdf5_reader.attributes import Attribute, read_attributes
from facert.io.hdf5_reader.dataset import Dataset, is_dataset
from facert.io.hdf5_reader.links import Links, is_group, read_links
from facert.io.hdf5_reader.objects import (
    Messages,
    read_messages,
    read_superblock,
    superblock_at,
)
from facert.io.hdf5_reader.stored_bytes import StoredBytes


def is_hdf5(file: BinaryIO, size: int) -> bool:
    """Whether an open file has the signature of HDF5 in one of the places for it."""
    return superblock_at(StoredBytes(file, size)) is not None


class StoredFile:
    """Reading access to an open file, whose objects are known by their addresses.

    Whatever is wrong in it raises some exception, mostly `DamagedError`; and no question takes
    longer than it takes to read the file a few times. Ask each one after `renew`.
    """

    def __init__(self, file: BinaryIO, size: int) -> None:
        self._bytes = StoredBytes(file, size)
        self.root = read_superblock(self._bytes)
        self._objects: dict[int, Messages] = {}
        self._links: dict[int, Links] = {}

    def renew(self) -> None:
        """Begin with a new question."""
        self._bytes.renew()

    def links(self, address: int) -> Links | None:
        """The links of a group; None for an object that is none."""
        if address not in self._links:
            messages = self._messages(address)
            if not is_group(messages):
                return None
            self._links[address] = read_links(self._bytes, messages)
        return self._links[address]

    def dataset(self, address: int) -> Dataset | None:
        """A dataset; None for an object that is none."""
        messages = self._messages(address)
        return Dataset(self._bytes, messages) if is_dataset(messages) else None

    def attribute(self, name: str) -> float | int | bool | bytes | None:
        """A number or text of the root; None where there is none."""
        found = self._attributes.get(name.encode())
        return None if found is None else found.value(self._bytes)

    @cached_property
    def _attributes(self) -> Mapping[bytes, Attribute]:
        """The attributes of the root."""
        return read_attributes(self._bytes, self._messages(self.root))

    def _messages(self, address: int) -> Messages:
        if address not in self._objects:
            self._objects[address] = read_messages(self._bytes, address)
        return self._objects[address]

"""The bytes of a file, the fields in them, and how many are looked at."""

from __future__ import annotations

from typing import BinaryIO

_REPEATS = 8
_SLACK, _FOR_EACH = 2**18, 64
_LARGEST = 2**24  # bytes of one structure
_MOST_CHECKED = 2**22  # bytes of a file whose checksums are computed: a second


class DamagedError(ValueError):
    """The bytes do not mean anything, or refer to each other without an end."""


class StoredBytes:
    """The bytes of an open file, at addresses as its own structures give them.

    Each byte of a sound file is needed once or twice to answer one question, such as for an array.
    So there is an allowance in proportion to the file, and whoever is led in circles, or to the
    same place again and again, uses it up. A file may be large, as holes take no room on a disk:
    so nodes, which lead to others, are visited once, and structures are of moderate size. Checksums
    are for accidents, as whatever passes them is checked all the same: the first are computed.
    """

    def __init__(self, file: BinaryIO, size: int) -> None:
        self._file, self.size = file, size
        self.base = 0
        self.offset_size = self.length_size = 8
        self._unchecked = _MOST_CHECKED
        self.renew()

    def renew(self) -> None:
        """Give the whole allowance, for the next question."""
        self._left = _REPEATS * self.size + _SLACK
        self._visited: set[int] = set()

    def visit(self, address: int) -> None:
        """Come to a node of a tree or a list; raises `DamagedError` the second time."""
        if address in self._visited:
            raise DamagedError("structures that refer to each other without an end")
        self._visited.add(address)

    def read(self, address: int, count: int) -> bytes:
        """Read `count` bytes; raises `DamagedError` for those beyond the file's end."""
        begin = self.base + address
        if count < 0 or not 0 <= begin <= self.size - count:
            raise DamagedError("an address beyond the end of the file")
        self._left -= count + _FOR_EACH
        if self._left < 0:
            raise DamagedError("structures that refer to each other without an end")
        self._file.seek(begin)
        found = self._file.read(count)
        if len(found) != count:
            raise DamagedError("the file became shorter while it was read")
        return found

    def up_to(self, address: int, count: int) -> bytes:
        """Read `count` bytes, or fewer at the file's end."""
        return self.read(address, min(count, max(0, self.size - self.base - address)))

    def fields(self, address: int, count: int) -> Fields:
        """The fields in `count` bytes."""
        return self.fields_of(self.read(address, count))

    def checked(self, address: int, count: int, signature: bytes) -> Fields:
        """The fields in `count` bytes, which a signature begins and a checksum ends."""
        if count > _LARGEST:
            raise DamagedError(f"{count} bytes of {signature.decode()}")
        found = self.read(address, count)
        fields = self.fields_of(found[:-4])
        fields.require(signature)
        self._unchecked -= count
        if self._unchecked >= 0 and checksum(found[:-4]) != int.from_bytes(found[-4:], "little"):
            raise DamagedError(f"a wrong checksum of {signature.decode()}")
        return fields

    def fields_of(self, content: bytes) -> Fields:
        """The fields in some content of this file, for its sizes of addresses and lengths."""
        return Fields(content, self.offset_size, self.length_size)


class Fields:
    """The fields of one structure, taken from its bytes one after the other."""

    def __init__(self, content: bytes, offset_size: int, length_size: int) -> None:
        self._content, self._at = content, 0
        self._offset_size, self._length_size = offset_size, length_size

    @property
    def left(self) -> int:
        """How many bytes have not been taken."""
        return len(self._content) - self._at

    def take(self, count: int) -> bytes:
        """Take some bytes; raises `DamagedError` when there are fewer."""
        if not 0 <= count <= self.left:
            raise DamagedError("a structure that is cut short")
        self._at += count
        return self._content[self._at - count : self._at]

    def number(self, size: int) -> int:
        """Take an unsigned number of some bytes."""
        return int.from_bytes(self.take(size), "little")

    def address(self) -> int | None:
        """Take an address; None where it is undefined."""
        found = self.take(self._offset_size)
        return None if found == b"\xff" * self._offset_size else int.from_bytes(found, "little")

    def defined(self) -> int:
        """Take an address that has to be there."""
        found = self.address()
        if found is None:
            raise DamagedError("an address that is not defined")
        return found

    def length(self) -> int:
        """Take a length."""
        return self.number(self._length_size)

    def until_zero(self) -> bytes:
        """Take a text up to the zero that ends it."""
        end = self._content.find(b"\0", self._at)
        text = self.take(end - self._at)  # refuses -1
        self._at += 1
        return text

    def require(self, signature: bytes) -> None:
        """Take a signature; raises `DamagedError` for another one."""
        found = self.take(len(signature))
        if found != signature:
            raise DamagedError(f"{found!r} where {signature!r} should be")

    def version(self, *known: int) -> int:
        """Take the version of a structure; raises `DamagedError` for an unknown one."""
        found = self.number(1)
        if found not in known:
            raise DamagedError(f"version {found} of a structure that has {known}")
        return found


def checksum(content: bytes) -> int:
    """Bob Jenkins' lookup3 ("hashlittle"), with which HDF5 guards its newer structures."""
    whole = 0xFFFFFFFF
    a = b = c = (0xDEADBEEF + len(content)) & whole
    if not content:
        return c
    padded = content + bytes(-len(content) % 12)
    words = [int.from_bytes(padded[i : i + 4], "little") for i in range(0, len(padded), 4)]
    for i in range(0, len(words), 3):
        if i:
            a, b, c = _mixed(a, b, c)
        a, b, c = (a + words[i]) & whole, (b + words[i + 1]) & whole, (c + words[i + 2]) & whole
    for turn in (14, 11, 25, 16, 4, 14, 24):
        # Each step of lookup3's "final" is this one, with the three in turn.
        c = ((c ^ b) - _turned(b, turn)) & whole
        a, b, c = b, c, a
    return b


def _mixed(a: int, b: int, c: int) -> tuple[int, int, int]:
    """One "mix" of lookup3."""
    whole = 0xFFFFFFFF
    for turn in (4, 6, 8, 16, 19, 4):
        a = ((a - c) & whole) ^ _turned(c, turn)
        c = (c + b) & whole
        a, b, c = b, c, a
    return a, b, c


def _turned(number: int, by: int) -> int:
    return (number << by | number >> 32 - by) & 0xFFFFFFFF

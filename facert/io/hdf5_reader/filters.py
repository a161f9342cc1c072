"""Filters: how the bytes of a chunk are packed."""

from __future__ import annotations

import zlib
from collections.abc import Sequence

import numpy as np

from facert.io.hdf5_reader.stored_bytes import DamagedError, Fields

GZIP, SHUFFLE, FLETCHER32, LZF = 1, 2, 3, 32000
KNOWN = frozenset((GZIP, SHUFFLE, FLETCHER32, LZF))
OTHERS = {
    4: "szip", 5: "nbit", 6: "scaleoffset", 305: "lzo", 307: "bzip2", 32001: "blosc", 32004: "lz4",
    32008: "bitshuffle", 32013: "zfp", 32015: "zstd", 32026: "blosc2",
}  # fmt: skip
"""Some that programs use, for messages."""


def read_filters(fields: Fields) -> tuple[int, ...]:
    """The numbers of the filters that packed each chunk, in that order."""
    version, count = fields.version(1, 2), fields.number(1)
    fields.take(6 if version == 1 else 0)
    return tuple(_filter(fields, version) for _ in range(count))


def _filter(fields: Fields, version: int) -> int:
    found = fields.number(2)
    named = version == 1 or found >= 256
    length = fields.number(2) if named else 0
    fields.take(2)
    values = fields.number(2)
    fields.take(length + (-length % 8 if version == 1 else 0))
    fields.take(4 * (values + (values % 2 if version == 1 else 0)))
    return found


def unpacked(
    content: bytes, filters: Sequence[int], skipped: int, size: int, element: int
) -> bytes:
    """The `size` bytes of a chunk of elements of some bytes; no more than twice that is made.

    `skipped` has a bit for each filter that was not applied to this chunk.
    """
    most = 2 * size + 1024  # two filters may have packed it one after the other
    for index in reversed(range(len(filters))):
        if skipped >> index & 1:
            continue
        if filters[index] == GZIP:
            content = _inflated(content, most)
        elif filters[index] == LZF:
            content = _from_lzf(content, most)
        elif filters[index] == SHUFFLE:
            content = _unshuffled(content, element)
        else:
            content = _checked(content)
    if len(content) != size:
        raise DamagedError(f"a chunk of {len(content)} bytes where {size} should be")
    return content


def _inflated(content: bytes, most: int) -> bytes:
    stream = zlib.decompressobj()
    found = stream.decompress(content, most)
    if not stream.eof:
        raise DamagedError("a packed chunk without its end, or of more than it should hold")
    return found


def _unshuffled(content: bytes, element: int) -> bytes:
    """First all first bytes of the elements, then all second ones... and what is left over."""
    count = len(content) // element
    if element == 1 or count < 2:
        return content
    planes = np.frombuffer(content, np.uint8, count * element).reshape(element, count)
    elements = np.empty((count, element), np.uint8)
    for place in range(element):  # twice as fast as to copy the transposed array
        elements[:, place] = planes[place]
    rest = content[count * element :]
    return elements.tobytes() + rest if rest else elements.tobytes()


def _checked(content: bytes) -> bytes:
    """What stands before Fletcher's checksum, which some versions of HDF5 wrote in other order."""
    body, stated = content[:-4], int.from_bytes(content[-4:], "little")
    words = np.frombuffer(body + bytes(len(body) % 2), ">u2").astype(np.uint64)
    ones = int(words.sum()) % 65535
    weights = np.arange(len(words), 0, -1, dtype=np.uint64)
    twos = int((words * weights % np.uint64(65535)).sum()) % 65535
    low, high = stated & 0xFFFF, stated >> 16
    swapped = [(number >> 8 | number << 8) & 0xFFFF for number in (low, high)]
    if all((a % 65535, b % 65535) != (ones, twos) for a, b in ((low, high), swapped)):
        raise DamagedError("a wrong checksum of a chunk")
    return body


def _from_lzf(content: bytes, most: int) -> bytes:
    """Unpack what Marc Lehmann's LibLZF packed: runs of bytes, and references to bytes before."""
    found, at, end = bytearray(), 0, len(content)
    try:
        while at < end:
            control = content[at]
            at += 1
            if control < 32:
                found += content[at : at + control + 1]
                at += control + 1
                continue
            length = control >> 5
            if length == 7:
                length += content[at]
                at += 1
            begin = len(found) - ((control & 31) << 8 | content[at]) - 1
            at += 1
            length += 2
            run = found[begin : begin + length]
            if begin < 0 or len(found) > most:
                raise DamagedError("a reference to before the beginning, or too much")
            found += run if len(run) == length else (run * (length // len(run) + 1))[:length]
    except IndexError as error:
        raise DamagedError("a packed chunk without its end") from error
    if at != end:
        raise DamagedError("a packed chunk without its end")
    return bytes(found)

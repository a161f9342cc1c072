"""Random changes of a valid input, for the short run without atheris."""

from __future__ import annotations

import random
import re

_NUMBER = re.compile(rb"-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
HOSTILE = (
    *(b"-1", b"0", b"1e999", b"-1e308", b"nan", b"inf", b"4294967295", b"99999999999999999999"),
    *(b"[", b"]", b"{", b"}", b'"', b"\\", b"null", b"true", b",", b"\n", b"\t", b"\x00", b"\xff"),
    *(b"\xed\xa0\x80", b"[" * 2000, b"9" * 5000),
)
"""What readers may stumble over."""


def mutated(seed: bytes, chance: random.Random) -> bytes:
    """An input with one to four random changes."""
    data = bytearray(seed)
    for _ in range(chance.randint(1, 4)):
        chance.choice(_CHANGES)(data, chance)
    return bytes(data)


def _flip(data: bytearray, chance: random.Random) -> None:
    if data:
        data[chance.randrange(len(data))] ^= 1 << chance.randrange(8)


def _put(data: bytearray, chance: random.Random) -> None:
    place = chance.randrange(len(data) + 1)
    data[place:place] = chance.choice(HOSTILE)


def _cut(data: bytearray, chance: random.Random) -> None:
    begin = chance.randrange(len(data) + 1)
    del data[begin : begin + chance.randint(1, max(1, len(data) // 8))]


def _repeat(data: bytearray, chance: random.Random) -> None:
    begin = chance.randrange(len(data) + 1)
    data[begin:begin] = data[begin : begin + chance.randint(1, 64)]


def _truncate(data: bytearray, chance: random.Random) -> None:
    del data[chance.randrange(len(data) + 1) :]


def _number(data: bytearray, chance: random.Random) -> None:
    """Another number in the place of one that is written out."""
    begin = chance.randrange(len(data) + 1)
    found = _NUMBER.search(data, begin, begin + 2000)
    if found:
        data[found.start() : found.end()] = chance.choice(HOSTILE)


_CHANGES = (_flip, _put, _cut, _repeat, _truncate, _number, _number)

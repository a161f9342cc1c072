"""Ranges of whole numbers as text: ``10..40``, ``0..200:50``, ``10,15,20``."""

from __future__ import annotations

import math
import re

from facert.errors import InputError

_RANGE = re.compile(r"(\d{1,9})\.\.(\d{1,9})(?::(\d{1,9}))?")
INTERVALS = 3  # a range without a step is cut into about so many
MOST = 1000


def parse_range(text: str, option: str) -> tuple[int, ...]:
    """The numbers of a range ``a..b`` or ``a..b:step``, or of a list, rising.

    Both ends of a range belong to it, whatever the step. Without a step, it is a third of the
    range, rounded to 1, 2 or 5 times a power of ten: ``10..40`` goes by tens, ``0..200`` by
    fifties.

    Parameters
    ----------
    text : str
        Such as ``"10..40"``, ``"0..200:50"`` or ``"10,15,20"``; both may be mixed.
    option : str
        For the message, e.g. ``"--labels"``.

    Raises
    ------
    InputError
        For anything else.
    """
    numbers: set[int] = set()
    for part in text.split(","):
        found = _RANGE.fullmatch(part.strip())
        if found is not None:
            numbers |= _span(text, option, *(int(group or -1) for group in found.groups()))
        elif part.strip().isdecimal() and len(part.strip()) < 10:
            numbers.add(int(part))
        else:
            raise _bad(text, option)
    return tuple(sorted(numbers))


def parse_frames(text: str, option: str) -> tuple[int, ...]:
    """The frames of ``a..b``, all of them, or of a list such as ``0,12,30``, rising.

    Raises
    ------
    InputError
        For anything else.
    """
    parts = [part if ":" in part or ".." not in part else f"{part}:1" for part in text.split(",")]
    return parse_range(",".join(parts), option)


def default_step(low: int, high: int) -> int:
    """About a third of the range: 1, 2 or 5 times a power of ten, at least 1."""
    third = max((high - low) / INTERVALS, 1.0)
    power = int(10 ** math.floor(math.log10(third)))
    candidates = (power, 2 * power, 5 * power, 10 * power)
    return min(candidates, key=lambda step: abs(math.log(step / third)))


def _span(text: str, option: str, low: int, high: int, step: int) -> set[int]:
    if low > high or step == 0:
        raise _bad(text, option)
    steps = range(low, high, default_step(low, high) if step < 0 else step)
    if len(steps) > MOST:
        raise InputError(option, f"at most {MOST} numbers", f"{len(steps)}", "Take larger steps.")
    return {*steps, high}


def _bad(text: str, option: str) -> InputError:
    expected = "a..b with a <= b, a..b:step, or numbers with commas"
    return InputError(option, expected, repr(text), "For instance 10..40:5.", "the options")

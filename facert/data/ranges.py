"""Ranges of whole numbers as text: ``10..40``, ``0..200:50``, ``10,15,20``."""

from __future__ import annotations

import math
import re
from collections.abc import Callable

from facert.errors import InputError

_RANGE = re.compile(r"(\d{1,9})\.\.(\d{1,9})(?::(\d{1,9}))?")
INTERVALS = 3  # a range without a step is cut into about so many
MOST = 1000


def parse_range(text: str, option: str) -> tuple[int, ...]:
    """The numbers of a range ``a..b`` or ``a..b:step``, or of a list, rising.

    Both ends of a range belong to it, whatever the step. Without a step, it is a third of the
    range, rounded to 1, 2 or 5 times a power of ten: ``10..40`` goes by tens, ``0..200`` by
    fifties. Ranges and lists may be mixed: ``"10..40,50"``.

    Raises `InputError` naming `option`, for anything else.
    """
    expected = "a..b with a <= b, a..b:step, or numbers with commas"
    bad = InputError(option, expected, repr(text), "For instance 10..40:5.", "the options")
    return _numbers(text, option, bad, default_step)


def parse_frames(text: str, option: str) -> tuple[int, ...]:
    """The frames of ``a..b``, all of them, or of a list such as ``0,12,30``, rising.

    As `parse_range`, but a range without a step has step 1.

    Raises `InputError` for anything else.
    """
    expected = "frames a..b with a <= b, or numbers with commas"
    bad = InputError(option, expected, repr(text), "For instance 0..20, or 12.", "the options")
    return _numbers(text, option, bad, lambda *_ends: 1)


def default_step(low: int, high: int) -> int:
    """About a third of the range: 1, 2 or 5 times a power of ten, at least 1."""
    third = max((high - low) / INTERVALS, 1.0)
    power = int(10 ** math.floor(math.log10(third)))
    candidates = (power, 2 * power, 5 * power, 10 * power)
    return min(candidates, key=lambda step: abs(math.log(step / third)))


def _numbers(
    text: str, option: str, bad: InputError, step_of: Callable[[int, int], int]
) -> tuple[int, ...]:
    """The numbers, rising; `step_of` gives the step of a range without one."""
    numbers: set[int] = set()
    for part in map(str.strip, text.split(",")):
        found = _RANGE.fullmatch(part)
        if found is not None:
            low, high = int(found[1]), int(found[2])
            step = step_of(low, high) if found[3] is None else int(found[3])
            if low > high or step == 0:
                raise bad
            numbers |= _span(range(low, high, step), high, option)
        elif part.isdecimal() and len(part) < 10:
            numbers.add(int(part))
        else:
            raise bad
    return tuple(sorted(numbers))


def _span(steps: range, high: int, option: str) -> set[int]:
    """Multiples of the step from the lower end, and the upper end."""
    if len(steps) > MOST:
        raise InputError(option, f"at most {MOST} numbers", f"{len(steps)}", "Take larger steps.")
    return {*steps, high}

"""Words of messages."""

from __future__ import annotations

from collections.abc import Sequence

from facert.errors import escaped


def plural(count: int, noun: str, nouns: str = "") -> str:
    """A number with its noun.

    >>> plural(1, "frame"), plural(0, "frame"), plural(3, "vertex", "vertices")
    ('1 frame', '0 frames', '3 vertices')
    """
    return f"{count} {noun if count == 1 else nouns or noun + 's'}"


def printable(text: str, most: int = 60) -> str:
    """Foreign text for a line of the log: short, with escapes for what would upset a terminal."""
    return escaped(text if len(text) <= most else f"{text[:most]}[...]")


def listed(names: Sequence[str], most: int = 5) -> str:
    """The first few of some names, each as `printable`, and how many more there are.

    >>> listed(["a", "b", "c"]), listed(["a", "b", "c"], 2)
    ('a, b, c', 'a, b and 1 more')
    """
    more = len(names) - most
    first = ", ".join(map(printable, names[:most]))
    return f"{first} and {more} more" if more > 0 else first

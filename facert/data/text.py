"""Words of messages."""

from __future__ import annotations


def plural(count: int, noun: str, nouns: str = "") -> str:
    """A number with its noun.

    >>> plural(1, "frame"), plural(0, "frame"), plural(3, "vertex", "vertices")
    ('1 frame', '0 frames', '3 vertices')
    """
    return f"{count} {noun if count == 1 else nouns or noun + 's'}"


def printable(text: str, most: int = 60) -> str:
    """Foreign text for a line of the log: short, with escapes for what would upset a terminal."""
    shown = text if len(text) <= most else f"{text[:most]}[...]"
    return "".join(sign if sign.isprintable() else repr(sign)[1:-1] for sign in shown)

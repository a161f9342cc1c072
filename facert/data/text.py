"""Words of messages."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Sequence

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


def did_you_mean(name: str, among: Iterable[str], otherwise: str = "Choose one of these.") -> str:
    """The fix for a word that is none of some: the one that is spelled most like it.

    >>> did_you_mean("ssgrp", ["ssgpr", "ridge"]), did_you_mean("x", ["ssgpr"], "Remove it.")
    ("Did you mean 'ssgpr'?", 'Remove it.')
    """
    near = difflib.get_close_matches(name, list(among), n=1)
    return f"Did you mean {near[0]!r}?" if near else otherwise


def listed(names: Sequence[str], most: int = 5) -> str:
    """The first few of some names, each as `printable`, and how many more there are.

    >>> listed(["a", "b", "c"]), listed(["a", "b", "c"], 2)
    ('a, b, c', 'a, b and 1 more')
    """
    more = len(names) - most
    first = ", ".join(map(printable, names[:most]))
    return f"{first} and {more} more" if more > 0 else first

"""What Tab offers for the values of options; tables of names are loaded when they are asked for."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from importlib import import_module

Completion = Callable[[str], list[str]]
"""From the part of a value that was typed to the values that begin so."""


def words(*known: str) -> Completion:
    """Offer these words."""

    def complete(incomplete: str) -> list[str]:
        return [word for word in known if word.startswith(incomplete)]

    return complete


def names_in(table: str) -> Completion:
    """Offer the names in a table, given as ``"facert.module.TABLE"``."""

    def complete(incomplete: str) -> list[str]:
        return words(*_table(table))(incomplete)

    return complete


def lists_of(table: str, *more: str) -> Completion:
    """Offer one more name of a table, or one word alone, after the commas of a list."""

    def complete(incomplete: str) -> list[str]:
        before, comma, last = incomplete.rpartition(",")
        free = [name for name in _table(table) if name not in before.split(",")]
        known = free if comma else [*more, *free]
        return [f"{before}{comma}{name}" for name in words(*known)(last)]

    return complete


def result_endings(incomplete: str) -> list[str]:
    """Offer the endings of files that takes are written to."""
    from facert.io.registry import endings

    return words(*endings("write", "take"))(incomplete)


def _table(place: str) -> Iterable[str]:
    module, _, name = place.rpartition(".")
    found: Iterable[str] = getattr(import_module(module), name)
    return found

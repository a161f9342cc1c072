"""Values that a file holds, checked against the types of a dataclass before anyone uses them.

Settings, the metadata of models and checkpoints, entries of a journal, rows of a report: each is a
dataclass whose annotations say what a field may be. Depth and length of what is checked are those
of the types, whatever the file holds. Knows nothing of files.
"""

from __future__ import annotations

import math
import types
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, Field, fields, is_dataclass
from functools import cache
from typing import (
    Annotated,
    Any,
    Literal,
    TypeVar,
    Union,
    cast,
    get_args,
    get_origin,
    get_type_hints,
)

from facert.data.text import did_you_mean
from facert.errors import InputError

LARGEST = 2**63 - 1
"""Of a whole number: NumPy's indices go no farther."""

T = TypeVar("T")


def typed(kind: type[T], value: object, field: str, fix: str) -> T:
    """A dataclass made of the mapping that a file holds, each field of its type.

    Unknown names are refused; fields that have a default may be absent. A list becomes a tuple.

    Parameters
    ----------
    kind : type
        The dataclass.
    value : object
        Anything.
    field : str
        What the errors call it; the path of what is at fault follows.
    fix : str
        The fix of the errors.

    Raises
    ------
    InputError
        When the value is of another type.
    """
    return _Check(fix).made(kind, value, field)


def require_type(hint: Any, value: object, field: str, fix: str) -> Any:
    """The value, checked against a type: plain, literal, union, tuple, table or dataclass.

    Raises
    ------
    InputError
        When it is of another type; for numbers that are not finite; for text that no file holds.
    """
    return _Check(fix)(hint, value, field)


def choices(hint: Any) -> tuple[str, ...]:
    """The words that a type allows; none where it is no literal."""
    return get_args(hint) if get_origin(hint) is Literal else ()


class _Check:
    """Checks values; all errors name the same fix."""

    def __init__(self, fix: str) -> None:
        self._fix = fix

    def __call__(self, hint: Any, value: object, field: str) -> Any:
        outer, inner = _parts(hint)
        if outer is Any:  # whoever takes it looks at it
            return value
        if outer is Literal:
            return self._word(inner, value, field)
        if outer is Union:
            hint = next((one for one in inner if _is_a(value, one)), None)
            if hint is None:
                raise self._wrong(field, _named(inner), value)
            return self(hint, value, field)
        if not _is_a(value, outer):
            raise self._wrong(field, _named([outer]), value)
        if is_dataclass(outer):
            return self.made(outer, value, field)  # type: ignore[arg-type]  # a type
        if isinstance(value, (list, tuple)):
            return tuple(self(inner[0], one, f"{field}/{n}") for n, one in enumerate(value))
        if isinstance(value, Mapping):
            return {
                self(str, n, field): self(inner[1], v, f"{field}/{n}") for n, v in value.items()
            }
        return self._plain(value, field)

    def made(self, kind: type[T], value: object, field: str) -> T:
        if isinstance(value, kind):
            return value
        known = _fields(cast(Any, kind))
        if not isinstance(value, Mapping):
            raise self._wrong(field, _named([kind]), value)
        unknown = next((name for name in value if name not in known), None)
        if unknown is not None:
            fix = did_you_mean(str(unknown), known, "Update facert, if a newer one wrote it.")
            raise InputError(f"{field}/{unknown}", "a known name", "another", fix)
        missing = next((name for name in known if name not in value and _is_due(known[name])), None)
        if missing is not None:
            raise InputError(f"{field}/{missing}", "a value", "nothing", self._fix)
        hints = _hints(cast(Any, kind))
        return kind(**{n: self(hints[n], one, f"{field}/{n}") for n, one in value.items()})

    def _word(self, words: Sequence[str], value: object, field: str) -> object:
        if not isinstance(value, str) or value not in words:
            fix = did_you_mean(value, words, self._fix) if isinstance(value, str) else self._fix
            raise InputError(field, "one of " + ", ".join(words), _shown(value), fix)
        return value

    def _plain(self, value: object, field: str) -> object:
        if isinstance(value, float) and not math.isfinite(value):
            raise self._wrong(field, "a finite number", value)
        if type(value) is int and abs(value) > LARGEST:
            raise self._wrong(field, "a smaller number", value)
        if isinstance(value, str) and any("\ud800" <= sign <= "\udfff" for sign in value):
            raise self._wrong(field, "text", value)
        return value

    def _wrong(self, field: str, expected: str, value: object) -> InputError:
        return InputError(field, expected, _shown(value), self._fix)


def _parts(hint: Any) -> tuple[Any, Sequence[Any]]:
    """What a type is at its outside, and the types inside it."""
    outer, inner = get_origin(hint), get_args(hint)
    if outer is Annotated:
        return _parts(inner[0])
    return (Union if outer is types.UnionType else outer or hint), inner


def _is_a(value: object, hint: Any) -> bool:
    """Whether a value is of a type at its outside; a whole number is a number, True is none."""
    outer, _ = _parts(hint)
    if outer in (Literal, Union):
        return True
    if isinstance(value, bool):
        return outer is bool
    if is_dataclass(outer) or issubclass(outer, Mapping):
        return isinstance(value, (outer, Mapping))
    also: dict[Any, type] = {float: int, tuple: list}
    return isinstance(value, (outer, also.get(outer, outer)))


def _named(kinds: Sequence[Any]) -> str:
    """Types for a message."""
    plain = (_parts(kind)[0] for kind in kinds if kind is not types.NoneType)
    words = {tuple: "a list", Mapping: "a table", dict: "a table"}
    return " or ".join(
        "a table" if is_dataclass(kind) else words.get(kind, getattr(kind, "__name__", str(kind)))
        for kind in plain
    )


def _shown(value: object) -> str:
    """A value for a message: what holds others may be as deep and long as a file."""
    if isinstance(value, int) and abs(value) > LARGEST:
        return "a large number"
    if value is None or isinstance(value, (bool, int, float, str)):
        return repr(value)
    return f"a {type(value).__name__}"


@cache
def _hints(kind: Any) -> dict[str, Any]:
    return get_type_hints(kind, include_extras=True)


@cache
def _fields(kind: Any) -> dict[str, Field[Any]]:
    return {field.name: field for field in fields(kind) if field.init}


def _is_due(field: Field[Any]) -> bool:
    return field.default is MISSING and field.default_factory is MISSING

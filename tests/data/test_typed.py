"""What a file holds is checked against a dataclass, to any depth, before anyone uses it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from facert.data.typed import typed
from facert.errors import InputError


@dataclass(frozen=True)
class Part:
    """A part of the whole."""

    name: str
    share: float = 1.0


@dataclass(frozen=True)
class Whole:
    """Every kind of field there is."""

    count: Annotated[int, "of something"]
    kind: Literal["markers", "weights"]
    names: tuple[str, ...]
    parts: tuple[Part, ...] = ()
    first: Part | None = None
    error: float | None = None
    shown: bool = False
    notes: Mapping[str, str | float] = field(default_factory=dict)


GOOD: dict[str, Any] = {"count": 3, "kind": "markers", "names": ["a", "é"]}
DEEP: list[Any] = []
for _ in range(100_000):
    DEEP = [DEEP]


def made(**changes: Any) -> Whole:
    return typed(Whole, GOOD | changes, "the file", "Write it again.")


def test_values_of_the_right_types_make_the_dataclass():
    parts = [{"name": "jaw"}, {"name": "brow", "share": 0}]
    found = made(parts=parts, first={"name": "lid"}, error=2, notes={"a": "b", "c": 1.5})
    assert found == Whole(
        3, "markers", ("a", "é"), (Part("jaw"), Part("brow", 0)), Part("lid"), 2, False,
        {"a": "b", "c": 1.5},
    )  # fmt: skip


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"count": True}, "the file.count: expected int, found True"),
        ({"count": 2.0}, "the file.count: expected int, found 2.0"),
        ({"count": 10**400}, "the file.count: expected a smaller number, found a large number"),
        ({"count": [1]}, "the file.count: expected int, found a list"),
        ({"count": DEEP}, "the file.count: expected int, found a list"),
        ({"kind": "marker"}, "the file.kind: .*Did you mean 'markers'"),
        ({"kind": ["markers"]}, "the file.kind: expected one of markers, weights, found a list"),
        ({"names": "ab"}, "the file.names: expected a list, found 'ab'"),
        ({"names": ["a", 3]}, "the file.names.1: expected str, found 3"),
        ({"names": ["\ud800"]}, "the file.names.0: expected text"),
        (
            {"parts": [{"name": "jaw"}, {}]},
            "the file.parts.1.name: expected a value",
        ),
        ({"parts": [{"nam": "jaw"}]}, "the file.parts.0.nam: .*Did you mean 'name'"),
        ({"first": "jaw"}, "the file.first: expected a table, found 'jaw'"),
        ({"error": float("nan")}, "the file.error: expected a finite number, found nan"),
        ({"error": "2"}, "the file.error: expected float, found '2'"),
        ({"notes": {"a": DEEP}}, "the file.notes.a: expected str or float, found a list"),
        ({"notes": [1]}, "the file.notes: expected a table, found a list"),
        ({"shown": 1}, "the file.shown: expected bool, found 1"),
        ({"more": 1}, "the file.more: expected a known name.*newer"),
    ],
)
def test_anything_else_is_refused_by_the_name_of_its_field(changes, message):
    with pytest.raises(InputError, match=message):
        made(**changes)


@settings(max_examples=60)
@given(
    st.recursive(
        st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
        lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
        max_leaves=5,
    ),
    st.sampled_from([*GOOD, "parts", "first", "error", "shown", "notes", ""]),
)
def test_whatever_a_file_holds_ends_in_the_dataclass_or_in_an_input_error(value, name):
    try:
        found = typed(Whole, GOOD | {name: value} if name else value, "the file", "Write it again.")
    except InputError:
        return
    assert isinstance(found, Whole)

"""JSON that facert wrote itself, read as if anybody had: metadata, journals, results."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any


def parse_json(text: str) -> Any:
    """The value in a text of JSON, to be checked by `facert.data.typed`.

    Raises
    ------
    ValueError
        For anything else: also when an object has a name twice, or is nested too deep.
    """
    try:
        return json.loads(text, object_pairs_hook=_object)
    except RecursionError:
        raise ValueError("brackets in brackets, too deep") from None


def _object(pairs: Sequence[tuple[str, Any]]) -> dict[str, Any]:
    made = dict(pairs)
    if len(made) < len(pairs):
        raise ValueError("a name twice in one object")
    return made

"""A cache of a few results, for what is asked of the same takes again and again.

One take is cleaned for training, again for retargeting, and after every label that an animator
adds, though no label changes its frames; and so are a few that are learned from together. Cleaning
takes longer than training and mapping together.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import wraps
from threading import Lock
from typing import ParamSpec, TypeVar

Given = ParamSpec("Given")
Result = TypeVar("Result")


KEPT, MOST_BYTES = 4, 2**26
"""Results that are kept: as many takes are cleaned once, however often they are learned from. Of
arrays that are larger together, fewer; the last one always."""


def keep_last(function: Callable[Given, Result]) -> Callable[Given, Result]:
    """The function with a cache of its last results, for equal arguments and contents of arrays.

    Arrays of the result should not be writeable.
    """
    kept: dict[str, tuple[Result, int]] = {}
    guard = Lock()

    @wraps(function)
    def wrapper(*args: Given.args, **kwargs: Given.kwargs) -> Result:
        from joblib import hash as digest_of  # takes its time to import

        digest = str(digest_of((args, kwargs), hash_name="sha1"))
        with guard:
            known = kept.pop(digest, None)
        found = known or (function(*args, **kwargs), sum(map(_size, args)))
        with guard:
            kept[digest] = found  # the latest comes last
            while len(kept) > 1 and (len(kept) > KEPT or _total(kept) > MOST_BYTES):
                del kept[next(iter(kept))]
        return found[0]

    return wrapper


def _size(argument: object) -> int:
    """Bytes of an array, or of that which a source holds."""
    return int(getattr(getattr(argument, "values", argument), "nbytes", 0))


def _total(kept: Mapping[str, tuple[object, int]]) -> int:
    return sum(size for _, size in kept.values())

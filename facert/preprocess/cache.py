"""A cache of one result, for what is asked of the same take again and again.

One take is cleaned for training, again for retargeting, and after every label that an animator
adds, though no label changes its frames. Cleaning takes longer than training and mapping together.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

Given = ParamSpec("Given")
Result = TypeVar("Result")


def keep_last(function: Callable[Given, Result]) -> Callable[Given, Result]:
    """The function with a cache of its last result, for equal arguments and contents of arrays.

    Arrays of the result should not be writeable.
    """
    last: tuple[str, Result] | None = None

    @wraps(function)
    def wrapper(*args: Given.args, **kwargs: Given.kwargs) -> Result:
        from joblib import hash as digest_of  # takes its time to import

        nonlocal last
        digest, known = str(digest_of((args, kwargs))), last  # another thread may replace it
        if known is None or known[0] != digest:
            known = last = digest, function(*args, **kwargs)
        return known[1]

    return wrapper

"""One execution of a target, and what is wrong with it."""

from __future__ import annotations

import logging
import resource
import time
import traceback
import warnings
from dataclasses import dataclass
from pathlib import Path

from experiments.fuzz.targets import Target

SLOW = 2.0
"""Seconds of processor time that no small input may take."""
LARGE = 500 * 2**20
"""Bytes that no small input may add to the memory in use."""
_PACKAGE = Path(__file__).parents[2] / "facert"


@dataclass(frozen=True)
class Problem:
    """What is wrong with an input; two of one `place` are taken for the same."""

    place: str
    text: str


def execute(target: Target, data: bytes) -> Problem | None:
    """Give an input to its target; None when all is well."""
    logging.getLogger("facert").setLevel(logging.CRITICAL)
    began, before = time.process_time(), _most_memory()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            target.run(data)
    except Exception as error:
        return Problem(_place(error), "".join(traceback.format_exception(error)))
    seconds, more = time.process_time() - began, _most_memory() - before
    if seconds > SLOW:
        return Problem("slow", f"{seconds:.1f} s of processor time")
    if more > LARGE:
        return Problem("large", f"{more / 2**20:.0f} MiB")
    return None


def _most_memory() -> int:
    """The most bytes that this process has held."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def _place(error: Exception) -> str:
    """The kind of an error, and the innermost line of facert on its way."""
    frames = traceback.extract_tb(error.__traceback__)
    own = [one for one in frames if str(_PACKAGE) in one.filename]
    where = f"{Path(own[-1].filename).name}:{own[-1].name}" if own else "elsewhere"
    return f"{type(error).__name__} in {where}"

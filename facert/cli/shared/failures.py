"""One line for whatever made a command fail, and the exit status that goes with it."""

from __future__ import annotations

import traceback
from pathlib import Path

from facert.errors import FacertError, escaped

REPORT = "please report it with the command and its files; facert -v shows where"
MEMORY = "the memory of this machine is not enough: give less at once, or fewer --jobs"


def exit_status(error: BaseException) -> int:
    """The exit status that stands for an exception."""
    return error.exit_code if isinstance(error, FacertError) else 1


def described(error: BaseException) -> str:
    """One line about an exception, for the person who gave the command."""
    if isinstance(error, FacertError):
        return str(error)
    text = _of_kind(error)
    return escaped(" ".join(text.split()))


def is_unexpected(error: BaseException) -> bool:
    """Whether an exception is none of those that have a meaning for a person."""
    return not isinstance(
        error, (FacertError, OSError, MemoryError, RecursionError, ImportError)
    ) and not _lacks_memory(error)


def trace(error: BaseException) -> str:
    """Where an exception was raised, without what would upset a terminal."""
    return "\n".join(map(escaped, "".join(traceback.format_exception(error)).splitlines()))


def _of_kind(error: BaseException) -> str:
    if _lacks_memory(error):
        return MEMORY
    if isinstance(error, OSError):
        return (f"{error.filename}: " if error.filename else "input or output: ") + (
            error.strerror or str(error)
        )
    if isinstance(error, RecursionError):
        return "a file is nested too deeply"
    if isinstance(error, ImportError):
        return f"a library cannot be loaded: {error}. Install {error.name or 'it'} again."
    return f"unexpected {type(error).__name__}: {error} ({_place(error)}); {REPORT}"


def _lacks_memory(error: BaseException) -> bool:
    # Torch has an error of its own on a GPU, and none on the CPU.
    text = str(error) if isinstance(error, RuntimeError) else ""
    return isinstance(error, MemoryError) or "allocate memory" in text or "out of memory" in text


def _place(error: BaseException) -> str:
    """File and line where it was raised."""
    frames = traceback.extract_tb(error.__traceback__)
    return f"{Path(frames[-1].filename).name}, line {frames[-1].lineno}" if frames else "nowhere"

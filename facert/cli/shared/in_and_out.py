"""Inputs and outputs of a command: refused in time, inputs first; arguments that look swapped."""

from __future__ import annotations

from pathlib import Path

from facert.cli.shared.files import require_other_file
from facert.errors import InputError, OutputExistsError, OutputKeptError
from facert.io.guarded import existing_file
from facert.io.registry import (
    OWN_ENDINGS,
    Kind,
    format_of,
    is_foreign,
    output_format,
    require_replaceable,
)

SWAPPED = "Are the arguments swapped?"


def require_inputs(*paths: Path | None) -> None:
    """Refuse inputs that are missing, before it matters whether an output is there.

    Raises `InputError` for the first of them.
    """
    for path in paths:
        if path is not None and not path.exists():
            existing_file(path)


def require_in_and_out(
    source: Path, output: Path, overwrite: bool, *kinds: Kind, in_place: bool = False
) -> None:
    """Refuse what cannot be read or written, before any work is done.

    Where IN is missing or a result, and OUT a recording, the error asks whether the two arguments
    are swapped.

    Parameters
    ----------
    source, output : Path
        IN and OUT.
    overwrite : bool
        Allow to replace an OUT that facert wrote; but not a recording by what a result becomes.
    *kinds : Kind
        One of these is to be written.
    in_place : bool
        Leave it to the caller whether OUT may be IN.

    Raises
    ------
    InputError
        When IN is missing, OUT has an ending to which none of the `kinds` is written, or both are
        the same file.
    OutputExistsError
        When OUT exists and may not be replaced.
    """
    swapped = _look_swapped(source, output)
    try:
        output_format(output, *kinds)
        require_inputs(source)
        if not in_place:
            require_other_file(source, output, "IN")
        require_replaceable(output, overwrite or swapped)
        if swapped:
            raise OutputKeptError(output, "the file is a recording, and IN a result")
    except (InputError, OutputExistsError) as error:
        if swapped:
            error.fix = f"{error.fix} {SWAPPED}"
        raise


def _look_swapped(source: Path, output: Path) -> bool:
    """Whether OUT is a recording, and IN what may have been meant to come from it."""
    if not output.is_file() or not _is_recording(output):
        return False
    return not source.exists() or _is_result(source)


def _is_recording(path: Path) -> bool:
    """Whether a file is somebody's, or a take with frames that have no pose."""
    from facert.io.take import holds_recording

    own = path.suffix.lower() in OWN_ENDINGS
    return is_foreign(path) or (own and holds_recording(path))


def _is_result(path: Path) -> bool:
    """Whether a file holds predicted poses, or is an export of facert's."""
    from facert.io.take import holds_result

    if path.suffix.lower() in OWN_ENDINGS:
        return holds_result(path)
    return format_of(path, "write", "take", "morphs") is not None and not is_foreign(path)

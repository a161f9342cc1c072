"""Corrections that survive retargeting anew."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from facert.cli.shared import console
from facert.data.text import listed, plural
from facert.errors import reading
from facert.io.registry import OWN_ENDINGS

if TYPE_CHECKING:
    from facert.data.take import Take


def with_kept(result: Take, source: Path, take: Take, output: Path) -> Take:
    """The result with the corrections of the take that it is of, and of the file that it replaces.

    Of one frame those of the file count.

    Raises
    ------
    InputError
        Naming the file whose corrections are for other frames or controls.
    """
    from facert.data.carried_corrections import carried
    from facert.data.corrections import merged, put_in

    kept = None
    for path, earlier in ((source, take), (output, _replaced(output))):
        if earlier is None or earlier.corrections is None:
            continue
        with reading(path):
            found = carried(earlier, result)
        if found is not None:
            frames = listed(list(map(str, found.frames.tolist())))
            what = plural(len(found.frames), "correction")
            text = "%s of %s put in again, at frame %s; --drop-corrections leaves them out"
            console.log.info(text, what, path.name, frames)
            kept = merged(kept, found)
    return result if kept is None else put_in(result, kept)


def _replaced(output: Path) -> Take | None:
    """The result that is to be replaced, where it holds corrections."""
    from facert.io.take import holds_corrections, read_take

    if output.suffix.lower() not in OWN_ENDINGS or not output.is_file():
        return None
    return read_take(output) if holds_corrections(output) else None

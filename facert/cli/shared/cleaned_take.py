"""Reading takes with bad markers, and writing what cleaning tells beside a take."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from facert.cli.shared import console

if TYPE_CHECKING:
    from facert.data.take import Take


def read_observed(path: Path, target: str | None, no_detect: bool) -> Take:
    """Read a take, without its bad markers unless they are to be believed."""
    from facert.errors import reading
    from facert.io.formats import read_source_file
    from facert.preprocess.faults import without_faults

    take = read_source_file(path, target)
    with reading(path):
        return take if no_detect else without_faults(take)


def write_beside(
    take: Take, output: Path, overwrite: bool, beside: Mapping[str, NDArray[Any]]
) -> None:
    """Write a take, and beside it what only HDF5 can hold."""
    from facert.io.formats import write_take_file
    from facert.io.registry import OWN_ENDINGS
    from facert.io.take import write_take

    if output.suffix.lower() in OWN_ENDINGS:
        write_take(take, output, overwrite, beside)
        return
    write_take_file(take, output, overwrite)
    console.log.info("only a .h5 file would hold %s as well", " and ".join(beside))

"""How `render` and `plot` save what they drew."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from facert.errors import InputError, OutputExistsError
from facert.io.atomic import replacing

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ENDINGS = (".png", ".pdf", ".svg")


def require_picture_name(path: Path, overwrite: bool, endings: tuple[str, ...] = ENDINGS) -> None:
    """Refuse a name that cannot be written to, before any work is done."""
    if path.suffix.lower() not in endings:
        raise InputError(
            "output",
            f"a name that ends in {', '.join(endings)}",
            f"{path.suffix!r}",
            "Give another name.",
            where=str(path),
        )
    if path.exists() and not overwrite:
        raise OutputExistsError(path)


def save_picture(figure: Figure, path: Path, overwrite: bool) -> None:
    """Write a figure in the format of the file's ending."""
    with replacing(path, overwrite) as temporary:
        figure.savefig(temporary)

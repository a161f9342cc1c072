"""What a person writes in a TOML file."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

from facert.errors import InputError, reading
from facert.io.text import read_text


def read_toml(path: Path, example: str = "name = value") -> dict[str, Any]:
    """The table in a TOML file; whoever takes it checks its names and values.

    Parameters
    ----------
    path : Path
    example : str
        Of what such a file holds, for the message.

    Raises
    ------
    InputError
        When the file is missing, too large, or not TOML.
    """
    with reading(path):
        try:
            return tomllib.loads(read_text(path))
        except (ValueError, RecursionError) as error:
            raise InputError(
                "file", f"TOML such as {example}", f"{error}", "Correct the file."
            ) from error

"""What a URI in a glTF document names: bytes in itself, or a file in the document's folder."""

from __future__ import annotations

import base64
import binascii
from pathlib import Path, PurePosixPath
from urllib.parse import unquote

from facert.errors import InputError

_EMBEDDED = ";base64,"
_FOREIGN = ("\\", ":", "\0")
"""Signs of another system's paths, of drives and of addresses."""


def data_of(uri: str) -> bytes | None:
    """The bytes in a data URI; None for another one."""
    if not uri.startswith("data:") or _EMBEDDED not in uri:
        return None
    try:
        return base64.b64decode(uri.partition(_EMBEDDED)[2], validate=True)
    except binascii.Error as error:
        raise ValueError(f"a buffer: {error}") from error


def file_of(uri: object, document: Path, field: str) -> Path:
    """The file that a URI names, in the document's folder or below, links resolved.

    The folder is that in which the document itself lies, also when it was reached by a link.

    Raises `InputError` for an address, an absolute path, one that goes up, and a link that leads
    out of the folder.
    """
    name = unquote(uri) if isinstance(uri, str) else ""
    parts = PurePosixPath(name).parts
    if not name or name.startswith("/") or ".." in parts or any(sign in name for sign in _FOREIGN):
        raise _outside(field, f"{uri!r}")
    folder = document.resolve().parent
    try:
        found = (folder / name).resolve()
    except (OSError, RuntimeError) as error:  # links in a circle
        raise _outside(field, f"{uri!r}, {error}") from None
    if not found.is_relative_to(folder) or found == folder:
        raise _outside(field, f"{uri!r}, which leads to {found}")
    return found


def _outside(field: str, found: str) -> InputError:
    expected = "data in the file or beside it"
    return InputError(field, expected, found, "Export it as one .glb file.")

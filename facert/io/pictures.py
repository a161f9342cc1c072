"""The mark of pictures, clips and pages that facert wrote, by which it knows its own."""

from __future__ import annotations

from pathlib import Path

from facert.data.version import CREATED_BY, MARK
from facert.io.guarded import existing_file

_OWN = MARK.encode()
_MARKS = {
    ".png": b"Software\0" + _OWN,
    ".svg": b"<dc:title>" + _OWN,
    ".pdf": b"/Creator (" + _OWN,
    ".gif": b"\x21\xfe" + bytes([len(CREATED_BY)]) + _OWN,
    ".mp4": _OWN,
    ".html": b'<meta name="generator" content="' + _OWN,
}
METADATA = {".png": {"Software": CREATED_BY}, ".svg": {"Creator": CREATED_BY},
            ".pdf": {"Creator": CREATED_BY}}  # fmt: skip
"""What Matplotlib is to write into a picture of each kind."""
_LOOKED_AT = 2**16


def may_bear_mark(path: Path) -> bool:
    """Whether a file of facert's by that name would bear its mark."""
    return path.suffix.lower() in _MARKS


def bears_mark(path: Path) -> bool:
    """Whether facert wrote a picture, a clip or a page: it says so at its beginning or its end."""
    mark = _MARKS[path.suffix.lower()]
    with existing_file(path).open("rb") as file:
        beginning = file.read(_LOOKED_AT)
        file.seek(max(0, path.stat().st_size - _LOOKED_AT))
        return mark in beginning or mark in file.read()

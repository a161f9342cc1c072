"""A journal of finished work: one JSON object a line, kept so that an interrupted run continues."""

from __future__ import annotations

import hashlib
import json
import logging
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from facert.errors import reading
from facert.io.atomic import Appended, write_text
from facert.io.guarded import read_old_text
from facert.io.plain_json import parse_json

log = logging.getLogger(__name__)


class Journal:
    """A file to which finished work is added line by line.

    Its first line has the `fingerprint` of the work it belongs to: what must be the same for its
    entries to be of use. A journal of other work is begun anew; a last line that was cut off is
    passed over. Nothing is written before `begin`.
    """

    def __init__(self, path: Path, fingerprint: str) -> None:
        self.path, self._fingerprint = path, fingerprint

    def begin(self) -> list[dict[str, Any]]:
        """The entries that are there, of the same work; the file is ready for more.

        Raises `InputError` when the file cannot be read or written.
        """
        entries = self._entries()
        header = {"fingerprint": self._fingerprint}
        text = "".join(json.dumps(line) + "\n" for line in (header, *entries))
        write_text(text, self.path, overwrite=True)
        return entries

    def add(self, entry: Mapping[str, Any]) -> None:
        """Append one entry to the file, which then outlives a kill, and a power cut.

        Raises `InputError` when it cannot be written; the entries before stay as they are.
        """
        with Appended(self.path) as file:
            file.add(json.dumps(entry, allow_nan=False).encode() + b"\n", sync=True)

    def remove(self) -> None:
        """Delete the file: the work is complete."""
        self.path.unlink(missing_ok=True)

    def _entries(self) -> list[dict[str, Any]]:
        if not self.path.exists():
            return []
        with reading(self.path):
            lines = read_old_text(
                self.path
            ).splitlines()  # one byte that is no UTF-8 costs one line
        header, *entries = [_parse(line) for line in lines] or [None]
        if header != {"fingerprint": self._fingerprint}:
            log.warning("%s is of other work: begun anew", self.path)
            return []
        return [entry for entry in entries if entry is not None]


def source_digest(folder: Path) -> str:
    """A digest of all Python files below a folder: work of other code is other work."""
    digest = hashlib.sha256()
    for path in sorted(folder.rglob("*.py")):
        digest.update(str(path.relative_to(folder)).encode() + path.read_bytes())
    return digest.hexdigest()


def _parse(line: str) -> dict[str, Any] | None:
    """The object in a line; None for anything else."""
    try:
        value = parse_json(line)
    except ValueError:
        return None
    return value if isinstance(value, dict) else None

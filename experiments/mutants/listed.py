"""The lists of changes: one TOML file for each part of the mathematics.

A change replaces a text that occurs once in a file of the package:

    [[file]]
    path = "models/optim/scg.py"
    tests = ["models/optim/test_moller.py"]

    [[file.change]]
    what = "Fletcher-Reeves in place of Møller's beta"
    old = "trial_gradient @ (trial_gradient - gradient)"
    new = "trial_gradient @ trial_gradient"

The tests that should notice are few and quick; a change may have others than its file has. One that
no test can notice, as nothing that anybody sees depends on it, has a `reason`.
"""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
LISTS = sorted(Path(__file__).parent.glob("*.toml"))


@dataclass(frozen=True)
class Change:
    """A change of one place in the package."""

    what: str
    file: str  # In the folder facert
    # Texts, the first of which occurs once in the file
    old: str
    new: str
    tests: Sequence[str]  # Files in the folder tests, or file::test
    reason: str | None = None  # Why no test can notice

    @property
    def room(self) -> str:
        """The part of the package that the file belongs to."""
        return self.file.split("/", 1)[0]

    def applied(self, text: str) -> str:
        """The file's text with the change.

        Raises
        ------
        ValueError
            When what is to be replaced does not occur exactly once, or is replaced by itself.
        """
        count = text.count(self.old)
        if count != 1:
            raise ValueError(f"{self.file}: {count} times, not once: {self.old!r}")
        if self.new == self.old:
            raise ValueError(f"{self.file}: no change of {self.old!r}")
        return text.replace(self.old, self.new)


def changes() -> list[Change]:
    """All changes of the lists."""
    lists = [tomllib.loads(path.read_text(encoding="utf-8")) for path in LISTS]
    return [
        Change(file=file["path"], **{"tests": file["tests"], **entry})
        for files in lists
        for file in files["file"]
        for entry in file["change"]
    ]

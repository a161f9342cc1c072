"""Results as files: tables for people, and tidy ones for programs."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from facert.evaluation.paired import MeanWithError
from facert.io.atomic import replacing


def markdown(header: Sequence[str], rows: Sequence[Sequence[str]], texts: int = 1) -> str:
    """A table whose first columns are text and whose others are numbers."""
    rules = ["---"] * texts + ["---:"] * (len(header) - texts)
    return "\n".join(f"| {' | '.join(row)} |" for row in (header, rules, *rows)) + "\n"


def with_error(found: MeanWithError) -> str:
    """A number with its standard error."""
    return f"{found.value:.3f} ± {found.se:.3f}"


def mean_with_error(found: Sequence[MeanWithError]) -> str:
    """The mean of some numbers and its standard error from theirs; empty for no numbers."""
    if not found:
        return ""
    se = float(np.sqrt(np.sum([one.se**2 for one in found]))) / len(found)
    return with_error(MeanWithError(float(np.mean([one.value for one in found])), se))


def write_text(path: Path, parts: Sequence[str]) -> None:
    """Paragraphs and tables, with a line between them."""
    with replacing(path, overwrite=True) as temporary:
        temporary.write_text("\n".join(f"{part.strip()}\n" for part in parts), encoding="utf-8")


def write_csv(path: Path, rows: Sequence[Mapping[str, object]]) -> None:
    """One row a line, the names of the columns first."""
    path.unlink(missing_ok=True)  # it bears no mark of facert, which would keep it
    with replacing(path, overwrite=True) as temporary, temporary.open("w", newline="") as file:
        writer = csv.DictWriter(file, fieldnames=list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows({name: _plain(value) for name, value in row.items()} for row in rows)


def _plain(value: object) -> object:
    """Numbers with six digits: more than are known."""
    return f"{value:.6g}" if isinstance(value, float) else value

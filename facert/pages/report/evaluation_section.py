"""A section from what `facert eval --json` wrote."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from facert.data.text import plural, printable
from facert.data.typed import typed
from facert.errors import InputError, reading
from facert.evaluation.figures import INK, LETTERS, plot_errors
from facert.evaluation.table import EvaluationRow, columns_of, sections_of
from facert.io.guarded import existing_file, read_text
from facert.io.plain_json import parse_json
from facert.pages.report.embedding import embedded
from facert.pages.report.sections import Picture, Section, Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FIX = "Give what facert eval --json wrote."
MAX_BYTES = 2**26
MAX_ROWS = 20_000
MOST_CONTROLS = 80  # that a picture names
SHOWN = ("take", "target", "across", "rig", "split", "noise", "missing", "seed", "repeats")


def read_evaluation(path: Path) -> Section:
    """Read the figures of an evaluation.

    Raises
    ------
    InputError
        When the file is missing, too large, or not what ``facert eval --json`` writes.
    """
    with reading(path):
        size = existing_file(path).stat().st_size
        if size > MAX_BYTES:
            raise _unexpected("file", f"at most {MAX_BYTES} bytes", f"{size}")
        try:
            content = parse_json(read_text(path))
        except ValueError as error:
            raise _unexpected("file", "JSON", str(error)) from None
        return _section(path.name, *_checked(content))


def _section(name: str, settings: Mapping[str, Any], rows: list[EvaluationRow]) -> Section:
    drawn = [row for row in rows if row.rms is not None]
    pictures: list[Picture] = []
    if drawn:
        pictures.append(embedded(plot_errors(drawn), "Error of each method", "svg"))
        controls = [
            printable(str(control), LETTERS) for control in _sequence(settings.get("controls"))
        ]
        most = max(row.labels for row in drawn)
        picture = _per_control([row for row in drawn if row.labels == most], controls)
        if picture is not None:
            caption = f"RMS of each control, with {plural(most, 'label')}"
            pictures.append(embedded(picture, caption, "svg"))
    known = {key: settings[key] for key in SHOWN if settings.get(key) not in (None, "")}
    versions = settings.get("versions")
    if isinstance(versions, Mapping):
        known |= versions
    facts = {str(key): _text(value) for key, value in known.items()}
    failures = sorted({f"{row.method}: {row.failure}" for row in rows if row.failure})
    title, text = f"Evaluation: {name}", " ".join(failures)
    return Section(title, text, tuple(pictures), tuple(_tables(rows)), facts)


def _tables(rows: Sequence[EvaluationRow]) -> Iterator[Table]:
    """Tables, one for each number of labels and of unlabelled data; the best method is marked."""
    columns = columns_of(rows)
    for section, least in sections_of(rows):
        caption = f"{plural(section[0].labels, 'label')}, {section[0].unlabelled} unlabelled"
        titles = tuple(column.title for column in columns)
        cells = tuple(tuple(column.text(row) for column in columns) for row in section)
        chosen = frozenset(index for index, row in enumerate(section) if row is least)
        yield Table(caption, titles, cells, chosen)


def _per_control(rows: Sequence[EvaluationRow], controls: Sequence[str]) -> Figure | None:
    """Colours for the RMS of each method and control."""
    from matplotlib.figure import Figure

    rows = [row for row in rows if len(row.per_control) == len(controls)]
    if not rows or not 1 < len(controls) <= MOST_CONTROLS:
        return None
    methods = list(dict.fromkeys(row.method for row in rows))
    errors = [
        np.mean([row.per_control for row in rows if row.method == method], axis=0)
        for method in methods
    ]
    names = [printable(method, LETTERS) for method in methods]
    left, below = _inches(names, 0.07), _inches(controls, 0.065)
    size = (left + 0.17 * len(controls), below + 0.24 * len(methods))
    figure = Figure(figsize=size, layout="constrained")
    axes = figure.subplots()
    image = axes.imshow(np.array(errors), cmap="YlOrRd", vmin=0.0, aspect="auto")
    axes.set_xticks(range(len(controls)), controls, rotation=90, fontsize=7, color=INK)
    axes.set_yticks(range(len(methods)), names, fontsize=8, color=INK)
    axes.spines[:].set_visible(False)
    axes.tick_params(length=0)
    figure.colorbar(image, ax=axes, shrink=0.9, pad=0.01).ax.tick_params(labelsize=7)
    return figure


def _inches(names: Sequence[str], letter: float) -> float:
    """Room for names beside a picture, and for what else stands there."""
    return 1.0 + letter * max(12, *map(len, names))


def _checked(content: object) -> tuple[Mapping[str, Any], list[EvaluationRow]]:
    """The settings and rows of a file that may hold anything."""
    if not isinstance(content, dict) or not isinstance(content.get("settings"), dict):
        raise _unexpected("file", "settings and rows", "something else")
    entries = content.get("rows")
    if not isinstance(entries, list) or not 0 < len(entries) <= MAX_ROWS:
        raise _unexpected("rows", f"1 to {MAX_ROWS} of them", "none, more, or no list")
    rows = (typed(EvaluationRow, e, f"rows/{index}", FIX) for index, e in enumerate(entries))
    return content["settings"], list(rows)


def _sequence(value: object) -> Sequence[Any]:
    return value if isinstance(value, (list, tuple)) else ()


def _text(value: object) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def _unexpected(field: str, expected: str, found: str) -> InputError:
    return InputError(field, expected, found, FIX)

"""Tables in memory: named columns of numbers or of text, as CSV and JSON files of trackers hold."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from facert.data.arrays import FloatArray, IntArray
from facert.errors import InputError
from facert.io.lines import Line, check_width, require_few, to_numbers

_TRUTHS = {
    **{"true": "1", "false": "0", "yes": "1", "no": "0", "": "nan"},
    **dict.fromkeys(("na", "n/a", "#n/a", "null", "none", "-", "--"), "nan"),
    **dict.fromkeys(("#num!", "#value!", "#div/0!", "1.#qnan", "-1.#ind", "-1.#qnan"), "nan"),
}
# No number, whatever the language: it has a letter, or the parts of a time of day or a date.
_TEXT = re.compile(r".*([^\W\d_]|:|\d;\d).*|\d{4}-\d\d?-\d\d?|\d{1,4}/\d{1,2}/\d{1,4}", re.DOTALL)


@dataclass(frozen=True, eq=False)
class Table:
    """Rows of named columns."""

    names: tuple[str, ...]
    """The C columns."""
    numbers: FloatArray
    """(T, C); NaN where a cell is blank, and in columns of text."""
    texts: Mapping[int, Sequence[str]]
    """The T cells of each column of text."""
    place: Callable[[int], str]
    """A row's place in the file, for messages."""

    def __post_init__(self) -> None:
        require_few(len(self.names))

    def __len__(self) -> int:
        """Number of rows T."""
        return len(self.numbers)

    def rows(self, kept: IntArray) -> Table:
        """A table of some of the rows."""
        texts = {column: [cells[row] for row in kept] for column, cells in self.texts.items()}
        place = self.place
        return Table(self.names, self.numbers[kept], texts, lambda row: place(int(kept[row])))

    def error(self, row: int, column: int, expected: str, found: str) -> InputError:
        """The error for a cell."""
        where = f"{self.place(row)}, column {self.names[column]}"
        return InputError(where, expected, found, "Mend or remove it.")


def table_of_lines(header: Sequence[str], rows: Sequence[Line]) -> Table:
    """The table of the lines of a text file.

    A column is text when every cell of it that is not blank is; yes and no, true and false are 1
    and 0, and NA, null and none are blank.

    Raises `InputError` naming the line and the column of the first cell that is no number among
    numbers.
    """
    require_few(len(header))
    check_width(rows, header)
    columns = range(len(header))
    texts: dict[int, Sequence[str]] = {}
    try:
        numbers = to_numbers(rows, header, columns)
    except InputError:
        numbers = np.full((len(rows), len(header)), np.nan)
        for column in columns:
            cells = [row.cells[column].strip() for row in rows]
            if _are_texts(cells):
                texts[column] = cells
            else:
                numbers[:, column] = _numbers(cells, rows, header, column)
    return Table(tuple(header), numbers, texts, lambda row: f"line {rows[row].number}")


def _are_texts(cells: Sequence[str]) -> bool:
    """Whether no cell is a number or a truth, but for blank ones."""
    filled = [cell for cell in cells if cell]
    return bool(filled) and all(map(is_text, filled))


def is_text(cell: str) -> bool:
    """Whether a cell is no number, truth or blank, in whatever language."""
    plain = _TEXT.fullmatch(cell) and cell.lower() not in _TRUTHS
    return bool(plain) and not is_number(cell)


def is_number(cell: str) -> bool:
    """Whether a cell is a number."""
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _numbers(
    cells: Sequence[str], rows: Sequence[Line], header: Sequence[str], column: int
) -> FloatArray:
    truths = [_TRUTHS.get(cell.lower(), cell) for cell in cells]
    try:
        return np.array(truths, dtype=np.float64)
    except ValueError:
        return to_numbers(rows, header, [column])[:, 0]  # its error names the cell

"""Words of messages, and foreign text on its way out: to a terminal, a page, a picture, a table.

Names, units, figures and the names of files come from elsewhere. Whatever they hold is shown as
text: `printable` and `printable_lines` for a terminal or a picture, `for_html` and `for_svg` for a
page, `for_mathtext` for a label of matplotlib, `for_json` for JSON that people read, `for_shell`
for a command to copy, and `for_csv` for a cell of a table, from which `from_csv` brings it back.
"""

from __future__ import annotations

import difflib
import html
import json
import math
import re
import shlex
from collections.abc import Iterable, Mapping, Sequence

from facert.errors import escaped

_UNPRINTABLE = re.compile(r"[^\n\x20-\x7e]")
_FORMULA = re.compile(r"'*(?:\s*[=+\-@\uff1d\uff0b\uff0d\uff20]|[\t\r\n])")
_QUOTED = re.compile(r'[",;|\t\r\n]|^\s|\s$')


def plural(count: int, noun: str, nouns: str = "") -> str:
    """A number with its noun.

    >>> plural(1, "frame"), plural(0, "frame"), plural(3, "vertex", "vertices")
    ('1 frame', '0 frames', '3 vertices')
    """
    return f"{count} {noun if count == 1 else nouns or noun + 's'}"


def printable(text: str, most: int = 60) -> str:
    """Foreign text for a line of the log: short, with escapes for what would upset a terminal."""
    shown = escaped(text[: most + 1])
    return shown if len(shown) <= most else f"{shown[:most]}[...]"


def printable_lines(text: str) -> str:
    r"""Text of several lines, with escapes for all else that would upset a terminal or a picture.

    >>> printable_lines("one\ntwo\x1b[2J")
    'one\ntwo\\x1b[2J'
    """
    return "\n".join(map(escaped, text.split("\n")))


def for_html(text: str) -> str:
    """Text for an HTML page: between elements, or in an attribute in quotes.

    >>> for_html('<b title="x">')
    '&lt;b title=&quot;x&quot;&gt;'
    """
    return html.escape(printable_lines(text))


def for_svg(text: str) -> str:
    """Text for an SVG or any XML, which knows no control characters, not even escaped."""
    return for_html(text).replace("&#x27;", "&apos;")


def for_mathtext(text: str) -> str:
    r"""Text for a label of matplotlib, of which no part is taken for mathematics.

    >>> for_mathtext("$x$")
    '\\$x\\$'
    """
    return printable_lines(text).replace("$", r"\$")


def for_json(value: object) -> str:
    """JSON in lines for people to read; what would upset a terminal is escaped as JSON does it.

    NaN and infinity, which JSON does not have, are null.
    """
    text = json.dumps(_finite(value), indent=2, ensure_ascii=False, allow_nan=False)
    return _UNPRINTABLE.sub(
        lambda found: found[0] if found[0].isprintable() else json.dumps(found[0])[1:-1], text
    )


def _finite(value: object) -> object:
    if isinstance(value, Mapping):
        return {key: _finite(part) for key, part in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(part) for part in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def for_csv(text: str) -> str:
    """A cell of a table in CSV: no spreadsheet takes it for a formula, none cuts it in two.

    What begins as a formula has an apostrophe before it, as spreadsheets themselves mark text; so
    has what begins with apostrophes and then as a formula. `from_csv` takes one off again.

    >>> for_csv("jaw"), for_csv("=1+1"), for_csv("a;b")
    ('jaw', "'=1+1", '"a;b"')
    """
    cell = f"'{text}" if _FORMULA.match(text) else text
    return '"' + cell.replace('"', '""') + '"' if _QUOTED.search(cell) else cell


def from_csv(cell: str) -> str:
    """The text of a cell, which has been freed of its quotes.

    >>> from_csv("'=1+1"), from_csv("'quoted'")
    ('=1+1', "'quoted'")
    """
    return cell[1:] if cell.startswith("'") and _FORMULA.match(cell) else cell


def for_shell(name: str) -> str:
    """The name of a file as a shell takes it, for commands to copy; never taken for an option.

    >>> for_shell("my take.h5"), for_shell("-o.h5")
    ("'my take.h5'", './-o.h5')
    """
    return shlex.quote(f"./{name}" if name.startswith("-") else name)


def did_you_mean(name: str, among: Iterable[str], otherwise: str = "Choose one of these.") -> str:
    """The fix for a word that is none of some: the one that is spelled most like it.

    >>> did_you_mean("ssgrp", ["ssgpr", "ridge"]), did_you_mean("x", ["ssgpr"], "Remove it.")
    ("Did you mean 'ssgpr'?", 'Remove it.')
    """
    near = difflib.get_close_matches(name, list(among), n=1)
    return f"Did you mean {near[0]!r}?" if near else otherwise


def listed(names: Sequence[str], most: int = 5) -> str:
    """The first few of some names, each as `printable`, and how many more there are.

    >>> listed(["a", "b", "c"]), listed(["a", "b", "c"], 2)
    ('a, b, c', 'a, b and 1 more')
    """
    more = len(names) - most
    first = ", ".join(map(printable, names[:most]))
    return f"{first} and {more} more" if more > 0 else first

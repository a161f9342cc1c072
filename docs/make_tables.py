"""Writes the tables of settings and formats into the pages that have their marks: `make docs`."""

from __future__ import annotations

import json
import re
from pathlib import Path

from facert.data.typed import choices
from facert.io.registry import table_rows
from facert.settings import DEFAULTS, DESCRIBED, default_text

DOCS = Path(__file__).parent
_TABLE = re.compile(r"<!-- (\w+): made by make docs -->\n.*?<!-- end of \1 -->", re.DOTALL)


def settings() -> str:
    """The settings as Markdown: name, default, meaning."""
    rows = [f"| `{name}` | {_default(name)} | {_meaning(name)} |" for name in DESCRIBED]
    return "\n".join(["| name | default | meaning |", "|---|---|---|", *rows])


def formats() -> str:
    """The formats as Markdown: ending, what is read, what is written."""
    return "\n".join(["| ending | read | written |", "|---|---|---|", *table_rows()])


TABLES = {"settings": settings, "formats": formats}


def tables_of(text: str) -> list[str]:
    """The names of the tables that a page has."""
    return _TABLE.findall(text)


def with_tables(text: str) -> str:
    """A page with its tables as they should be."""

    def made(found: re.Match[str]) -> str:
        begin, _, _ = found[0].partition("\n")
        return f"{begin}\n{TABLES[found[1]]()}\n<!-- end of {found[1]} -->"

    return _TABLE.sub(made, text)


def _default(name: str) -> str:
    default = getattr(DEFAULTS, name)
    return default_text(name) if default is None else f"`{json.dumps(default)}`"


def _meaning(name: str) -> str:
    kind, about = DESCRIBED[name]
    words = ", ".join(f"`{json.dumps(word)}`" for word in choices(kind))
    return f"{about.help} One of {words}." if words else about.help


if __name__ == "__main__":
    for page in sorted(DOCS.glob("*.md")):
        before = page.read_text(encoding="utf-8")
        if tables_of(before):
            page.write_text(with_tables(before), encoding="utf-8")
            print(page.name)

"""Writes the table of settings from their fields, into the page that has its marks: `make docs`."""

from __future__ import annotations

import json
from pathlib import Path

from facert.settings import DEFAULTS, DESCRIBED, choices, default_text

DOCS = Path(__file__).parent
BEGIN, END = "<!-- settings: made by make docs -->", "<!-- end of settings -->"


def table() -> str:
    """The settings as Markdown: name, default, meaning."""
    rows = [f"| `{name}` | {_default(name)} | {_meaning(name)} |" for name in DESCRIBED]
    return "\n".join(["| name | default | meaning |", "|---|---|---|", *rows])


def pages() -> list[Path]:
    """The pages that have the table."""
    candidates = [DOCS.parent / "README.md", *sorted(DOCS.glob("*.md"))]
    return [page for page in candidates if BEGIN in page.read_text(encoding="utf-8")]


def with_table(text: str) -> str:
    """A page with the table as it should be."""
    before, _, rest = text.partition(BEGIN)
    return f"{before}{BEGIN}\n{table()}\n{END}{rest.partition(END)[2]}"


def _default(name: str) -> str:
    default = getattr(DEFAULTS, name)
    return default_text(name) if default is None else f"`{json.dumps(default)}`"


def _meaning(name: str) -> str:
    kind, about = DESCRIBED[name]
    words = ", ".join(f"`{json.dumps(word)}`" for word in choices(kind))
    return f"{about.help} One of {words}." if words else about.help


if __name__ == "__main__":
    for page in pages():
        page.write_text(with_table(page.read_text(encoding="utf-8")), encoding="utf-8")
        print(page.name)

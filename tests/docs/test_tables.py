"""The tables of settings, formats and methods hold what the code declares."""

from __future__ import annotations

import re
import runpy

from following import DOCS

from facert.methods.registry import REGISTRY

MAKE = runpy.run_path(str(DOCS / "make_tables.py"))


def test_each_table_stands_once_and_is_up_to_date() -> None:
    found = []
    for page in sorted(DOCS.glob("*.md")):
        text = page.read_text(encoding="utf-8")
        found += MAKE["tables_of"](text)
        assert text == MAKE["with_tables"](text), "run make docs"
    assert sorted(found) == sorted(MAKE["TABLES"])


def test_every_method_is_in_the_table() -> None:
    text = (DOCS / "settings.md").read_text(encoding="utf-8")
    table = text.split("| method | what it learns")[1].split("\n\n")[0]
    assert re.findall(r"^\| `([\w-]+)` \|", table, re.MULTILINE) == list(REGISTRY)

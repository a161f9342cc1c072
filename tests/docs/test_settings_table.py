"""The tables of settings and of methods say what the code says."""

from __future__ import annotations

import re
import runpy

from following import DOCS

from facert.methods.registry import REGISTRY

MAKE = runpy.run_path(str(DOCS / "make_settings.py"))


def test_the_table_is_up_to_date() -> None:
    (page,) = MAKE["pages"]()
    text = page.read_text(encoding="utf-8")
    assert text == MAKE["with_table"](text), "run make docs"


def test_every_method_is_in_the_table() -> None:
    text = (DOCS / "settings.md").read_text(encoding="utf-8")
    table = text.split("| method | what it learns")[1].split("\n\n")[0]
    assert re.findall(r"^\| `([\w-]+)` \|", table, re.MULTILINE) == list(REGISTRY)

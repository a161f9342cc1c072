"""The table of settings says what their fields say."""

from __future__ import annotations

import runpy

from following import DOCS

MAKE = runpy.run_path(str(DOCS / "make_settings.py"))


def test_the_table_is_up_to_date() -> None:
    (page,) = MAKE["pages"]()
    text = page.read_text(encoding="utf-8")
    assert text == MAKE["with_table"](text), "run make docs"

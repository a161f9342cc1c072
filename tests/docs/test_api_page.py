"""The API page is that of the docstrings."""

from __future__ import annotations

import runpy

import pytest
from following import DOCS

import facert

MAKE = runpy.run_path(str(DOCS / "make_api.py"))


def test_the_page_is_up_to_date() -> None:
    assert (DOCS / "api.md").read_text(encoding="utf-8") == MAKE["page"](), "run make docs"


@pytest.mark.parametrize("name", facert.__all__)
def test_every_public_name_has_its_heading(name: str) -> None:
    assert f"\n## `facert.{name}`\n" in MAKE["page"]()


def test_a_numpydoc_section_becomes_a_list() -> None:
    docstring = "Do it.\n\nParameters\n----------\na, b : int\n    Two\n    numbers.\nc : str"
    text, title, items = MAKE["_body"](docstring)
    assert (text, title) == ("Do it.\n", "**Parameters**\n")
    assert items == "* `a`, `b` (int): Two numbers.\n* `c` (str)\n"

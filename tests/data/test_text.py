"""Numbers in messages agree with their nouns; foreign text leaves as text."""

import csv
import io
import json
from io import BytesIO
from xml.etree.ElementTree import fromstring

import pytest
from matplotlib.figure import Figure

from facert.data.text import (
    did_you_mean,
    for_csv,
    for_html,
    for_json,
    for_mathtext,
    for_svg,
    from_csv,
    plural,
    printable_lines,
)


@pytest.mark.parametrize(
    ("count", "text"), [(0, "0 vertices"), (1, "1 vertex"), (2, "2 vertices"), (10, "10 vertices")]
)
def test_one_is_singular_and_all_others_are_plural(count: int, text: str) -> None:
    assert plural(count, "vertex", "vertices") == text
    assert plural(count, "frame") == f"{count} frame{'' if count == 1 else 's'}"


def test_a_slip_of_the_pen_is_answered_with_the_word() -> None:
    assert did_you_mean("ssgrp", ("ssgpr", "ridge")) == "Did you mean 'ssgpr'?"
    assert did_you_mean("forest", ("ssgpr", "ridge")) == "Choose one of these."


HOSTILE = [
    "\x1b[31mred",
    "a\nb",
    "‮txt.exe",
    "\ud800",
    "[/bold]",
    "$\\frac{$",
    "<b>&\"'",
    "\x9b2J",
    "\x00",
]


@pytest.mark.parametrize("name", HOSTILE)
def test_foreign_text_leaves_as_text(name: str) -> None:
    shown = printable_lines(name)
    assert all(part.isprintable() for part in shown.split("\n"))
    assert fromstring(f'<a b="{for_svg(name)}">{for_svg(name)}</a>').get("b") is not None
    assert not set("<>\"'") & set(for_html(name))
    assert json.loads(for_json([name])) == [name]
    assert all(sign.isprintable() for sign in for_json([name]).replace("\n", ""))
    figure = Figure()
    figure.text(0, 0, for_mathtext(name))
    figure.savefig(BytesIO(), format="svg")


@pytest.mark.parametrize("sign", [*"=+-@\t\r\n＝＋－＠", " =", "'=", "''+", "' -"])
def test_a_cell_is_no_formula_and_comes_back(sign: str) -> None:
    name = f"{sign}cmd|' /C calc'!A0;=1\t=2"
    (cells,) = csv.reader(io.StringIO(f"time,{for_csv(name)}\n", newline=""))
    assert cells[1].startswith("'")
    assert from_csv(cells[1]) == name
    assert for_csv("it's") == from_csv("it's") == "it's"

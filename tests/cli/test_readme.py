"""The README is short, and lists every command, as the page of commands does."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
README, COMMANDS = ROOT / "README.md", ROOT / "docs" / "commands.md"


@pytest.mark.parametrize("page", [README, COMMANDS], ids=lambda page: page.name)
def test_every_command_is_listed_in_the_order_of_the_help(page, facert):
    rows = re.findall(r"^\| `facert ([\w-]+)", page.read_text(encoding="utf-8"), re.MULTILINE)
    offered = re.findall(r"^│ ([a-z][\w-]*) ", facert("--help").out, re.MULTILINE)

    assert rows == offered


def test_it_is_short_enough_to_be_read_to_its_end():
    assert len(README.read_text(encoding="utf-8").splitlines()) <= 220

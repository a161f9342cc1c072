"""Whatever the pages and the docstrings name of the package exists."""

from __future__ import annotations

import importlib
import re
from pathlib import Path

import pytest
from following import DOCS, ROOT

NAMED = re.compile(r"`(facert(?:\.[A-Za-z_]\w*)+)`")
TEXTS = [*ROOT.glob("*.md"), *DOCS.glob("*.md"), *(ROOT / "facert").rglob("*.py")]


def exists(name: str) -> bool:
    """Whether a dotted name is a module, or something in one."""
    module, _, attribute = name.rpartition(".")
    try:
        importlib.import_module(name)
    except ModuleNotFoundError:
        if not module or not exists(module):
            return False
        home = find(module)
        return hasattr(home, attribute) or attribute in getattr(home, "__annotations__", {})
    return True


def find(name: str) -> object:
    """What a dotted name that exists stands for."""
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError:
        module, _, attribute = name.rpartition(".")
        return getattr(find(module), attribute)


@pytest.mark.parametrize("path", TEXTS, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_what_a_text_names_exists(path: Path) -> None:
    names = set(NAMED.findall(path.read_text(encoding="utf-8")))
    assert not [name for name in sorted(names) if not exists(name)]


def test_what_does_not_exist_is_found() -> None:
    assert exists("facert.data.take.Take.labels")
    assert not exists("facert.data.take.Take.lables")
    assert not exists("facert.handling.Handling")

"""What a file names is not opened: material libraries of OBJ, layers of USD."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from facert.errors import InputError
from facert.io.formats import read_any, read_mesh

OPENED: list[str] | None = None


def note(event: str, arguments: tuple[object, ...]) -> None:
    if OPENED is not None and event == "open":
        OPENED.append(str(arguments[0]))


sys.addaudithook(note)  # for good: it does nothing but while OPENED is a list

CASES: dict[str, tuple[str, str, Callable[[Path], object], str]] = {
    "a material library": (
        "face.obj",
        "mtllib ../secret.mtl\nmtllib SECRET\nusemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
        read_mesh,
        "",
    ),
    "layers": (
        "face.usda",
        "#usda 1.0\n(\n    subLayers = [@../secret.mtl@, @SECRET@]\n)\n"
        'def Mesh "a" (\n    prepend references = @SECRET@\n)\n{\n}\n',
        read_any,
        "facert only writes USD",
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_no_file_is_opened_but_the_one_that_was_given(tmp_path: Path, name: str) -> None:
    global OPENED
    file, text, read, refused = CASES[name]
    secret = tmp_path / "secret.mtl"
    secret.write_text("newmtl a\nmap_Kd secret.png\n")
    path = tmp_path / "given" / file
    path.parent.mkdir()
    path.write_text(text.replace("SECRET", str(secret)))
    OPENED = []
    try:
        if refused:
            with pytest.raises(InputError, match=refused):
                read(path)
        else:
            read(path)
        there = {one for one in OPENED if str(tmp_path) in one}
    finally:
        OPENED = None
    assert there <= {str(path)}
    assert there or refused

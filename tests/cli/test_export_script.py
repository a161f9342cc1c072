"""Scripts for other programs are printed or written."""

from __future__ import annotations

import pytest

from facert.io.importers import PROGRAMS, script


@pytest.mark.parametrize("program", PROGRAMS)
def test_a_script_is_printed_as_it_is(facert, program):
    assert facert("export-script", program).out == script(program)


def test_a_script_is_written_but_over_nothing(facert, tmp_path):
    path = tmp_path / "import_curves.py"
    assert facert("export-script", "maya", "-o", path).code == 0
    assert path.read_text() == script("maya")
    assert facert("export-script", "blender", "-o", path).code == 2
    assert path.read_text() == script("maya")
    assert facert("export-script", "blender", "-o", path, "--overwrite").code == 0


def test_another_program_is_wrong_usage(facert):
    refused = facert("export-script", "houdini")
    assert refused.code == 2
    assert "blender" in refused.err

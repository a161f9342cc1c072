"""Scripts for other programs are printed or written."""

from __future__ import annotations

import ast

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


@pytest.mark.parametrize("name", ["script.txt", "script.csv", "script.json", "script.py"])
def test_a_script_of_any_name_is_replaced_by_another(facert, tmp_path, name):
    path = tmp_path / name
    assert facert("export-script", "maya", "-o", path).code == 0
    assert facert("export-script", "blender", "--addon", "-o", path).code == 2
    assert facert("export-script", "blender", "--addon", "-o", path, "--overwrite").code == 0
    assert path.read_text() == script("blender", addon=True)


def test_what_only_looks_like_a_script_is_kept(facert, tmp_path):
    path = tmp_path / "phone.txt"
    path.write_text('"""Of somebody."""\n\n# facert\nimport facert\n')
    assert facert("export-script", "maya", "-o", path, "--overwrite").code == 3
    assert "somebody" in path.read_text()


def test_drivers_are_held_in_the_script(facert, tmp_path):
    drivers = tmp_path / "drivers.toml"
    drivers.write_text('["it\'s \\"odd\\""]\nnode = "jaw"\nrotate = [15, 0, 0]\n')
    for program in PROGRAMS:
        text = facert("export-script", program, "--drivers", drivers).out
        (held,) = [
            node.value
            for node in ast.parse(text).body
            if isinstance(node, ast.AnnAssign) and node.target.id == "DRIVERS"
        ]
        table = {"node": "jaw", "rotate": [15.0, 0.0, 0.0]}
        assert ast.literal_eval(held) == {'it\'s "odd"': [table]}


def test_drivers_that_are_none_are_named(facert, tmp_path):
    drivers = tmp_path / "drivers.toml"
    assert facert("export-script", "maya", "--drivers", drivers).code == 3
    drivers.write_text("[jaw]\nturn = 3\n")
    refused = facert("export-script", "maya", "--drivers", drivers)
    assert refused.code == 3
    assert "drivers.toml: [[jaw]]" in refused.err


def test_an_add_on_is_for_blender(facert):
    assert facert("export-script", "maya", "--addon").code == 2


def test_another_program_is_wrong_usage(facert):
    refused = facert("export-script", "houdini")
    assert refused.code == 2
    assert "blender" in refused.err

"""The registry of formats: what it declares is there; a library is loaded with its first file."""

from __future__ import annotations

import subprocess
import sys

import pytest

from facert.io import registry
from facert.io.formats import read_take_file
from facert.io.registry import FORMATS, Format, endings, function, listed, table_rows


@pytest.mark.parametrize("one", FORMATS, ids=lambda one: one.endings[0])
def test_every_function_of_a_format_is_there(one) -> None:
    names = [*one.read.values(), *one.write.values(), one.kind_of, one.targets]
    assert all(callable(function(name)) for name in names if name)


def test_endings_are_those_of_a_kind() -> None:
    tables = (".livelink.csv", ".curvetable.csv", ".curvetable.json", ".csv", ".json")
    assert endings("write", "take") == (".h5", ".hdf5", *tables)
    assert endings("read", "mesh") == (".glb", ".gltf", ".obj", ".ply")
    assert ".csv of Live Link Face, another tracker or plain, .json of" in listed("read", "take")


def test_one_declaration_brings_a_format_into_all_lists(tmp_path, monkeypatch) -> None:
    new = Format(
        (".dat",), {"take": "tables.csv_table.read_table"}, about=" of a test", reads="a test"
    )
    monkeypatch.setattr(registry, "FORMATS", (*FORMATS, new))
    path = tmp_path / "a.dat"
    path.write_text("time,a\n0,1\n0.02,1\n")
    assert read_take_file(path).source.names == ("a",)
    assert ".dat" in str(registry.unknown_input(tmp_path / "a.xyz"))
    assert listed("read", "take").endswith(".dat of a test")
    assert table_rows()[-1] == "| `.dat` | a test | |"


@pytest.mark.parametrize(
    ("run", "absent"),
    [
        ("from facert.cli.app import app", ("numpy", "torch")),
        ("from facert import read_take; read_take(sys.argv[1])", ("h5py", "c3d", "pxr", "torch")),
    ],
)
def test_a_format_is_loaded_with_its_first_file(tmp_path, run, absent) -> None:
    path = tmp_path / "a.csv"
    path.write_text("time,a\n0,1\n0.02,1\n")
    check = f"import sys; {run}; print([name for name in {absent} if name in sys.modules])"
    command = [sys.executable, "-c", check, str(path)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"

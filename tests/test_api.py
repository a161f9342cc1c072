"""The public names, and what importing them costs."""

import subprocess
import sys

import pytest

import facert


@pytest.mark.parametrize("name", facert.__all__)
def test_every_public_name_is_there(name):
    assert getattr(facert, name).__doc__
    assert name in dir(facert)


def test_other_names_are_not():
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = facert.nothing


def run(code: str) -> str:
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return done.stdout


def test_the_bare_import_is_light():
    heavy = "{'torch', 'scipy', 'h5py', 'matplotlib', 'numpy'}"
    assert run(f"import sys, facert; print(sorted({heavy} & set(sys.modules)))") == "[]\n"


def test_the_help_is_light():
    code = """
import sys
HEAVY = {"torch", "numpy", "scipy", "h5py", "matplotlib"}
from facert.cli.app import main
sys.argv = ["facert", "--help"]
try:
    main()
except SystemExit as stop:
    print("exit", stop.code, sorted(HEAVY & set(sys.modules)))
"""
    assert run(code).endswith("exit 0 []\n")


def test_the_example_of_the_package_works(make_take, tmp_path):
    facert.write_take(make_take(), tmp_path / "take.h5")
    facert.write_take(make_take(posed=0, animation=0, seed=1), tmp_path / "new.h5")

    take = facert.read_take(tmp_path / "take.h5")
    retargeter = facert.train(take, facert.Settings(max_iterations=20))
    retargeter.save(tmp_path / "model.safetensors")
    new = facert.read_take(tmp_path / "new.h5")
    result = facert.load(tmp_path / "model.safetensors").retarget(new)
    facert.write_take(result, tmp_path / "result.h5")

    assert facert.read_take(tmp_path / "result.h5").params.shape == (60, 4)

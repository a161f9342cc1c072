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


def test_what_needs_no_torch_never_imports_it(make_take, tmp_path):
    take, model = tmp_path / "take.h5", tmp_path / "model.safetensors"
    facert.write_take(make_take(), take)
    facert.train(make_take(), facert.Settings(method="nearest")).save(model)
    commands = {
        "retarget": (take, tmp_path / "made.h5", "--model", model),
        "inspect": (model,),
        "clean": (take, tmp_path / "clean.h5"),
        "convert": (take, tmp_path / "take.csv"),
        "eval": (take, "--methods", "nearest", "--labels", 4, "--repeats", 1),
    }
    code = f"""
import sys
from facert.cli.app import main
from facert.methods.registry import REGISTRY, method_class
for words in {[[name, *map(str, words)] for name, words in commands.items()]}:
    sys.argv = ["facert", *words]
    try:
        main()
    except SystemExit as stop:
        assert not stop.code, (words, stop.code)
    assert "torch" not in sys.modules, words
for name in REGISTRY.keys() - {{"ssgplvm", "sgplvm", "svr"}}:
    method_class(name)
    assert "torch" not in sys.modules, name
print("without torch")
"""
    assert run(code).endswith("without torch\n")


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

"""Tries a release in the environment that its wheel was installed into, which has nothing else.

build/clean/bin/python -I .ci/wheel.py dist/facert-*.tar.gz dist/facert-*.whl
"""

import importlib
import pkgutil
import subprocess
import sys
import tarfile
import tempfile
import zipfile
from pathlib import Path

import facert

ROOT = Path(__file__).resolve().parents[1]
EXTRAS = {"viser", "websockets", "msgspec", "pxr"}  # of facert[view] and facert[usd]
IN_OTHER_PROGRAMS = "facert.io.importers."
COMMANDS = """
--version
demo demo
train demo/training.h5 -o model.safetensors
retarget demo/performance.h5 result.csv -m model.safetensors
render demo/performance.h5 faces.png --rig demo/character.h5 --frames 0..1
convert demo/performance.h5 shot.glb --rig demo/character.h5
report result.csv -o report.html
"""


def tracked(*folders: str) -> set[str]:
    """The files that git knows."""
    command = ["git", "ls-files", *folders]
    listed = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    return set(listed.stdout.splitlines())


def require_same(held: set[str], expected: set[str]) -> None:
    """Nothing is missing and nothing is there besides."""
    assert held == expected, f"missing {expected - held}, besides {held - expected}"


def check_source(archive: Path) -> None:
    """It holds every file of the repository and no other."""
    with tarfile.open(archive) as opened:
        held = {member.name.partition("/")[2] for member in opened if member.isfile()}
    require_same(held, tracked() | {"PKG-INFO"})


def check_wheel(archive: Path) -> None:
    """It holds every file of the package and no other, but for what it says of itself."""
    with zipfile.ZipFile(archive) as opened:
        held = {name for name in opened.namelist() if ".dist-info/" not in name}
    require_same(held, tracked("facert"))
    assert "facert/py.typed" in held


def check_imports() -> None:
    """Every module loads with what the wheel asks for."""
    assert "site-packages" in facert.__file__
    for module in pkgutil.walk_packages(facert.__path__, "facert."):
        if not module.name.startswith(IN_OTHER_PROGRAMS):
            try:
                importlib.import_module(module.name)
            except ModuleNotFoundError as error:
                if error.name not in EXTRAS:
                    raise


def check_commands() -> None:
    """A take goes the whole way."""
    program = Path(sys.executable).with_name("facert")
    with tempfile.TemporaryDirectory() as folder:
        for line in COMMANDS.strip().splitlines():
            command = [program, "-q", *line.split()]
            subprocess.run(command, cwd=folder, check=True, stdout=subprocess.DEVNULL)
        made = {path.name for path in Path(folder).iterdir()}
    assert made >= {"result.csv", "faces.png", "shot.glb", "report.html"}, made


if __name__ == "__main__":
    check_source(Path(sys.argv[1]))
    check_wheel(Path(sys.argv[2]))
    check_imports()
    check_commands()
    print(f"{Path(sys.argv[2]).name}: 4 passed, 0 failed")

"""The layout of the package: imports point downwards, and few things lie at the root."""

from __future__ import annotations

import ast
from graphlib import TopologicalSorter
from pathlib import Path

import facert

ROOT = Path(facert.__file__).parent
# From the top down, as CONTRIBUTING draws it: a package imports from those below it alone.
FLOORS = (
    "cli", "live", "pages", "evaluation", "demo", "render", "posing", "retarget", "regions",
    "methods", "topology", "preprocess", "models", "io", "mesh", "settings", "data", "errors",
)  # fmt: skip
# The mathematics knows nothing of files or terminals.
WITHOUT_FILES = ("models", "methods", "regions", "topology", "preprocess", "mesh", "data")


def module_name(path: Path) -> str:
    parts = path.relative_to(ROOT.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {
    module_name(path): ast.parse(path.read_text(encoding="utf-8")) for path in ROOT.rglob("*.py")
}


def imported(tree: ast.Module) -> set[str]:
    """The modules of facert that a module imports, anywhere in it."""
    names: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module is not None:
            each = [f"{node.module}.{alias.name}" for alias in node.names]
            names |= {name if name in MODULES else node.module for name in each}
        elif isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
    return {name for name in names if name in MODULES}


IMPORTS = {name: imported(tree) for name, tree in MODULES.items()}


def floor(module: str) -> int:
    """The index of a module's package in FLOORS; the root package itself is above all."""
    parts = module.split(".")
    return FLOORS.index(parts[1]) if len(parts) > 1 else -1


def test_no_import_runs_upwards() -> None:
    upwards = [
        f"{module} -> {other}"
        for module, others in IMPORTS.items()
        for other in others
        if other != "facert" and floor(other) < floor(module)
    ]
    assert not upwards


def test_no_files_import_each_other_in_a_circle() -> None:
    TopologicalSorter(IMPORTS).prepare()  # its error names the circle


def test_the_mathematics_knows_nothing_of_files() -> None:
    reading = [
        f"{module} -> {other}"
        for module, others in IMPORTS.items()
        if module.split(".")[1:2] and module.split(".")[1] in WITHOUT_FILES
        for other in others
        if other.startswith("facert.io")
    ]
    assert not reading


def test_few_things_lie_at_the_root() -> None:
    entries = [path for path in ROOT.iterdir() if path.name != "__pycache__"]
    assert len(entries) <= 20
    assert {path.stem for path in entries} == {*FLOORS, "__init__", "py"}


def test_no_two_files_of_tests_have_one_name() -> None:
    names = [path.name for path in Path(__file__).parent.rglob("test_*.py")]
    twice = sorted({name for name in names if names.count(name) > 1})
    assert not twice, "pytest imports them by their names"

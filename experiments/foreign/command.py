"""The command: trials of every program that is here, as a table."""

from __future__ import annotations

import argparse
import importlib.util
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

from experiments.foreign import arrays, blender, documents, markers, meshes, node, tables
from experiments.foreign.trial import Outcome, Trial, carried_out
from experiments.report import markdown

MODULES = {"usd-core": "pxr"}
"""What a library is imported as, where its name is another."""
HEADER = ("program", "file", "compared", "largest difference")


def library_trials() -> list[Trial]:
    """Trials of the libraries that can be imported."""
    makers: tuple[Callable[[], list[Trial]], ...] = (
        markers.trials,
        tables.trials,
        arrays.trials,
        meshes.trials,
        documents.trials,
    )
    return [one for make in makers for one in make() if _importable(one.program)]


def program_trials(npm: str, bpy: str) -> list[Trial]:
    """Trials of programs that are started."""
    commands = blender.commands() | ({"bpy": [bpy]} if bpy else {})
    started = [one for name, command in commands.items() for one in blender.trials(name, command)]
    there = {name: node.present(name, npm) for name in (node.PACK, node.TRANSFORM, node.VALIDATOR)}
    return started + [one for one in node.trials(npm) if there[one.program]]


def _importable(library: str) -> bool:
    return importlib.util.find_spec(MODULES.get(library, library)) is not None


def main() -> int:
    """Carry the trials out, print the table; the status is 1 where one is not as it should be."""
    asked = _arguments()
    trials = library_trials() + program_trials(asked.npm, asked.bpy)
    there = {one.program for one in trials}
    chosen = [one for one in trials if one.program in (asked.programs or there)]
    with TemporaryDirectory() as folder:
        outcomes = [
            carried_out(one, Path(folder) / f"{number:03d}") for number, one in enumerate(chosen)
        ]
    print(markdown(HEADER, [one.row() for one in outcomes], texts=3))
    absent = [name for name in PROGRAMS if name not in there]
    print(f"absent: {', '.join(absent) or 'none'}")
    if asked.v:
        _show_messages(outcomes)
    bad = sum(not one.good for one in outcomes)
    print(f"{len(outcomes) - bad} of {len(outcomes)} as they should be")
    return int(bad > 0)


PROGRAMS = (
    markers.PROGRAM,
    tables.PROGRAM,
    arrays.NUMPY,
    arrays.HDF5,
    meshes.TRIMESH,
    meshes.USD,
    documents.PROGRAM,
    "Blender",
    "bpy",
    node.PACK,
    node.TRANSFORM,
    node.VALIDATOR,
)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("programs", nargs="*", metavar="PROGRAM", help="only these")
    parser.add_argument("--npm", default="", help="a folder into which npm has installed programs")
    parser.add_argument("--bpy", default="", help="a Python that has bpy")
    parser.add_argument("-v", action="store_true", help="what facert logs about each file")
    return parser.parse_args()


def _show_messages(outcomes: list[Outcome]) -> None:
    for one in outcomes:
        for line in one.messages:
            print(f"{one.trial.program}, {one.trial.file}, {one.trial.compared}: {line}")

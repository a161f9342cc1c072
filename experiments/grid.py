"""Evaluations on all real tracks, whose finished cells are kept in a journal.

A kept cell is used again as long as the code that computed it is the same: the evaluation, its
method, and whatever of facert these import. After a change in one method, only that one is
evaluated anew.
"""

from __future__ import annotations

import argparse
import ast
import hashlib
import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Literal

import facert
from experiments.tracks import read_track
from facert.evaluation.cells import Outcome
from facert.evaluation.protocol import Problem, Protocol, make_problem
from facert.evaluation.run import Grid, fingerprint, run
from facert.io.journal import Journal
from facert.methods.registry import REGISTRY

log = logging.getLogger(__name__)

Split = Literal["random", "block", "across"]

ROOT = Path(__file__).resolve().parents[1]
KEPT = ROOT / "build" / "cells"
RESULTS = ROOT / "experiments" / "results"

DEFAULT = "auto"
SPEECH, OPTICAL = ("rom", "utterance_a", "utterance_b"), ("optical_cheeks", "optical_eyebrows")
TARGETS = {
    **dict.fromkeys(SPEECH, ("arkit", "units")),
    **dict.fromkeys(OPTICAL, ("solved",)),
}
ACROSS = {"utterance_a": "utterance_b", "utterance_b": "utterance_a"}


@dataclass(frozen=True)
class Case:
    """A problem: a track with one of its targets, tested in one way.

    Parameters
    ----------
    track, target : str
    split : {"random", "block", "across"}
        ``"across"`` tests on the other take of the same actor.
    noise : float
        As in `facert.evaluation.protocol.Protocol`.
    test_frames : int, optional
        The same.
    """

    track: str
    target: str
    split: Split = "random"
    noise: float = 0.0
    test_frames: int | None = None

    @property
    def name(self) -> str:
        """Name for people."""
        noise = f", noise {self.noise:g}" if self.noise else ""
        return f"{self.track}, {self.target}{noise}"

    @property
    def path(self) -> Path:
        """Where finished cells are kept."""
        parts = (self.track, self.target, self.split, f"{self.noise:g}", self.test_frames or "all")
        return KEPT / f"{'-'.join(map(str, parts))}.jsonl"

    def problem(self) -> Problem:
        """The data of the problem."""
        across = self.split == "across"
        return make_problem(
            read_track(self.track, self.target),
            self.protocol,
            read_track(ACROSS[self.track], self.target) if across else None,
        )

    @property
    def protocol(self) -> Protocol:
        """How the data of a repeat is drawn."""
        return Protocol(
            "block" if self.split == "block" else "random",
            self.noise,
            test_frames=self.test_frames,
        )


class CellJournal(Journal):
    """A journal whose entries serve as long as the code of their method is the same."""

    def begin(self) -> list[dict[str, Any]]:
        """The entries of the code as it is; the others stay in the file."""
        return [
            {name: value for name, value in entry.items() if name != "code"}
            for entry in super().begin()
            if entry.get("code") == code_of(entry["cell"]["method"])
        ]

    def add(self, entry: Mapping[str, Any]) -> None:
        """Write one more."""
        super().add({**entry, "code": code_of(entry["cell"]["method"])})


def evaluate(case: Case, grid: Grid, jobs: int) -> list[Outcome]:
    """All cells of a grid, those from the journal included."""
    problem = case.problem()
    journal = CellJournal(case.path, fingerprint(problem))
    outcomes, total = [], len(grid.cells)
    for done, outcome in enumerate(run(problem, grid, jobs=jobs, journal=journal), start=1):
        outcomes.append(outcome)
        if 4 * done // total > 4 * (done - 1) // total:
            log.info("%s, %s split: %d of %d cells", case.name, case.split, done, total)
    return outcomes


@cache
def code_of(method: str) -> str:
    """A digest of the code that an outcome of the method comes from."""
    module = f"facert.methods.{REGISTRY[method][0]}" if method in REGISTRY else "facert"
    digest = hashlib.sha256()
    for path in sorted(_sources("facert.evaluation.cells", module)):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def _sources(*modules: str) -> set[Path]:
    """The files of modules of facert and of all that they import."""
    waiting, found = list(modules), set[Path]()
    while waiting:
        path = _file_of(waiting.pop())
        if path is not None and path not in found:
            found.add(path)
            waiting += _imports(path)
    return found


def _imports(path: Path) -> list[str]:
    """What may be modules among the names that a file imports."""
    names = []
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            names += [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
    return names


def _file_of(module: str) -> Path | None:
    """The file of a module of facert; None for any other name."""
    root = Path(facert.__file__).parent.parent / module.replace(".", "/")
    places = (root.with_suffix(".py"), root / "__init__.py")
    inside = module.split(".")[0] == "facert"
    return next((place for place in places if inside and place.exists()), None)


def basic_options(text: str | None, repeats: int) -> argparse.ArgumentParser:
    """A parser with the options of every experiment on tracks."""
    parser = argparse.ArgumentParser(
        description=text, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--tracks", nargs="+", choices=TARGETS, default=list(TARGETS))
    parser.add_argument("--repeats", type=int, default=repeats, help="draws (%(default)s)")
    parser.add_argument("--results", type=Path, default=RESULTS, help="folder (%(default)s)")
    return parser


def options(text: str | None, repeats: int) -> argparse.ArgumentParser:
    """A parser with the options that all experiments on grids have."""
    parser = basic_options(text, repeats)
    parser.add_argument("--methods", nargs="+", choices=REGISTRY, default=list(REGISTRY))
    parser.add_argument("--jobs", type=int, default=2, help="processes (%(default)s)")
    parser.add_argument("--test-frames", type=int, help="at most; by default all others")
    return parser


def begin_log(log: logging.Logger = log) -> None:
    """Log progress on stderr."""
    logging.basicConfig(format="%(asctime)s %(message)s", datefmt="%H:%M:%S")
    log.setLevel(logging.INFO)


def kinds(tracks: Sequence[str]) -> list[tuple[str, str]]:
    """Tracks with their targets, target by target."""
    pairs = [(track, target) for track in tracks for target in TARGETS[track]]
    return sorted(pairs, key=lambda pair: ("arkit", "units", "solved").index(pair[1]))

"""The guides as a reader follows them: every command and every script of a page, in order."""

from __future__ import annotations

import io
import os
import re
import runpy
import shlex
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import pytest
import typer
import typer.core

from facert.cli import app

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
STAND_IN = "docs/stand_in.py"
_BLOCK = re.compile(r"^```([^\n`]*)\n(.*?)^```$", re.DOTALL | re.MULTILINE)


@dataclass(frozen=True)
class Block:
    """The text between two fences of a page, and the language and name on the first.

    Commands have no language; `sh` has commands that end with Ctrl-C, of which the options are
    checked; `bash` what makes an installation; `text` what the commands before it print; `python` a
    script to run; and what has a name after its language is a file that the reader writes.
    """

    language: str
    name: str
    text: str

    @property
    def commands(self) -> list[str]:
        """Its lines, with those that continue one joined."""
        return [line for line in self.text.replace("\\\n", " ").splitlines() if line.strip()]


def blocks_of(page: Path) -> list[Block]:
    """All blocks of a page, in order."""
    found = _BLOCK.findall(page.read_text(encoding="utf-8"))
    return [Block(*(f"{info} ".split(" ")[:2]), text) for info, text in found]


def follow(page: Path, folder: Path) -> None:
    """Follow a page in a folder: its commands succeed and print what it shows.

    Where it exists already, the folder that the page makes stand-ins in keeps what it holds.
    """
    printed, variables = "", {"__name__": page.stem}
    with inside(folder):
        for block in blocks_of(page):
            if block.name:
                Path(block.name).write_text(block.text, encoding="utf-8")
            elif not block.language:
                printed = "".join(run(command) for command in block.commands)
            elif block.language == "python":
                exec(compile(block.text, page.name, "exec"), variables)
            elif block.language == "text":
                require_printed(block.text, printed)


@contextmanager
def inside(folder: Path) -> Iterator[None]:
    """In a folder, on a terminal of a hundred columns without colours."""
    before = Path.cwd()
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("COLUMNS", "100")
        patch.setenv("NO_COLOR", "1")
        os.chdir(folder)
        try:
            yield
        finally:
            os.chdir(before)


def run(line: str) -> str:
    """Run a command line, its comment aside; return what it prints, notes included."""
    command, _, output = line.partition(" > ")
    program, *arguments = shlex.split(command, comments=True)
    if program == "cd":
        os.chdir(arguments[0])
        return ""
    result, notes = facert(arguments) if program == "facert" else shell([program, *arguments])
    if output:
        Path(output.strip()).write_text(result, encoding="utf-8")
        return notes
    return result + notes


def facert(arguments: list[str]) -> tuple[str, str]:
    """What ``facert ARGUMENTS`` writes to stdout and to stderr, in this process."""
    forget()
    out, notes = io.StringIO(), io.StringIO()
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(out), redirect_stderr(notes):
        patch.setattr(sys, "argv", ["facert", *arguments])
        try:
            app.main()
            code: object = 0
        except SystemExit as stop:
            code = stop.code or 0
    assert code == 0, f"facert {' '.join(arguments)}: {notes.getvalue()}"
    return out.getvalue(), notes.getvalue()


def forget() -> None:
    """Drop what commands keep for the life of their process, of which a reader starts many."""
    modules = [module for name, module in sys.modules.items() if name.startswith("facert.cli.")]
    for kept in [thing for module in modules for thing in vars(module).values()]:
        if hasattr(kept, "cache_clear"):
            kept.cache_clear()


def shell(command: list[str]) -> tuple[str, str]:
    """The same of the scripts beside the guides, and of the shell's own commands."""
    if command[:2] == ["python", STAND_IN]:
        if not Path(command[-1]).exists():
            stand_in()["main"](command[2:])
        return "", ""
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return done.stdout, done.stderr


def stand_in() -> dict[str, Any]:
    """What is in the script that makes recordings."""
    return runpy.run_path(str(ROOT / STAND_IN))


@cache
def whole_command() -> Any:
    """``facert`` with all its commands."""
    return typer.main.get_command(app.app)


def check_options(line: str) -> None:
    """Parse a command of facert without running it."""
    name, command, arguments = _resolved(line)
    command.make_context(name, arguments)


def unknown_options(line: str) -> list[str]:
    """The options in a part of a command line that the command does not have."""
    _, command, arguments = _resolved(line)
    known = {option for parameter in command.params for option in parameter.opts}
    return [word for word in arguments if word.startswith("-") and word not in {*known, "--help"}]


def all_options() -> set[str]:
    """The options of all commands."""
    found, commands = {"--help"}, [whole_command()]
    while commands:
        command: Any = commands.pop()
        found |= {option for parameter in command.params for option in parameter.opts}
        found |= {option for parameter in command.params for option in parameter.secondary_opts}
        commands += command.commands.values() if isinstance(command, typer.core.TyperGroup) else []
    return found


def _resolved(line: str) -> tuple[str, Any, list[str]]:
    """Name and object of the command in a line, and its arguments."""
    name, *arguments = shlex.split(line, comments=True)
    command = whole_command()
    while isinstance(command, typer.core.TyperGroup) and arguments and arguments[0][0] != "-":
        name = arguments.pop(0)
        assert name in command.commands, f"no such command: {line}"
        command = command.commands[name]
    return name, command, arguments


def require_printed(shown: str, printed: str) -> None:
    """Every line that a page shows was printed, in that order, numbers aside."""
    lines = iter([likeness(line) for line in printed.splitlines()])
    for line in shown.splitlines():
        assert line.strip() in ("", "...") or likeness(line) in lines, f"not printed: {line!r}"


def likeness(line: str) -> str:
    """A line without what differs from machine to machine: numbers, and the space they take."""
    return re.sub(r"[\s─━]+", " ", re.sub(r"-?\d[\d.,]*(e-?\d+)?", "#", line)).strip()

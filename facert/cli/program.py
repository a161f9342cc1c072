"""The commands of ``facert`` in one registry, and the place where errors become exit codes."""

from __future__ import annotations

import logging
import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from types import ModuleType
from typing import Annotated, Any

import typer
import typer.main

from facert.cli.commands import (
    clean,
    convert,
    correct,
    demo,
    drive,
    evaluate,
    export_script,
    inspect,
    live,
    plot,
    points,
    pose,
    propagate,
    regions,
    render,
    report,
    retarget,
    simulate,
    stabilise,
    suggest,
    train,
    view,
)
from facert.cli.shared import console
from facert.cli.shared.failures import described, exit_status, is_unexpected, trace
from facert.cli.shared.help import Command, Group
from facert.cli.shared.options import option
from facert.cli.shared.signals import signals
from facert.data import memory
from facert.data.text import printable_lines
from facert.data.version import CREATED_BY
from facert.io.claims import claims_kept

_Usage: Any = typer.BadParameter.__base__
UNREAD = 128 + 13  # what shells show of a program that SIGPIPE ended: nobody reads its output
ANYWHERE = ("-q", "--quiet", "-v", "--verbose", memory.OPTION)
"""Options of the whole command that may stand after its name as well as before it."""


class _Commands(Group):
    """Group of commands that ends at a signal in one line, with the exit status shells expect."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Let the options of the whole command stand after its name as well as before it."""
        own = args[: args.index("--")] if "--" in args else args
        moved, rest = _split(own)
        with _escaping():
            return super().parse_args(ctx, [*moved, *rest, *args[len(own) :]])

    def invoke(self, ctx: Any) -> Any:
        """Run the command that was asked for, until it is done or a signal ends it."""
        try:
            with signals.raising(), claims_kept(), _escaping():
                result = super().invoke(ctx)
        except KeyboardInterrupt as stop:
            notes = getattr(stop, "__notes__", [])
            console.err.print(": ".join(["stopped", *notes]), style="yellow")
            raise typer.Exit(signals.status) from None
        except BrokenPipeError:
            _drop_output()
            raise typer.Exit(UNREAD) from None
        if signals.number not in (None, signal.SIGINT):  # Ctrl-C is how live and view end
            raise typer.Exit(signals.status)
        return result


@contextmanager
def _escaping() -> Iterator[None]:
    """Escape what Typer says of the arguments: names of files are among them."""
    try:
        yield
    except _Usage as error:
        error.message = printable_lines(error.message)
        raise


def _split(args: list[str]) -> tuple[list[str], list[str]]:
    """The options that may stand anywhere, with their values, and all else."""
    moved: list[str] = []
    rest: list[str] = []
    for arg in args:
        value = bool(moved) and moved[-1] == memory.OPTION
        (moved if value or arg.partition("=")[0] in ANYWHERE else rest).append(arg)
    return moved, rest


app = typer.Typer(
    name="facert",
    cls=_Commands,
    help="Carry a facial performance over to any character's rig, from a handful of poses.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _print_version(asked: bool) -> None:
    if asked:
        console.out.print(CREATED_BY)
        raise typer.Exit


@app.callback()
def options(
    quiet: Annotated[bool, option("Results, warnings and errors only.", "--quiet", "-q")] = False,
    verbose: Annotated[bool, option("Details as well.", "--verbose", "-v")] = False,
    max_memory: Annotated[
        str | None,
        option(
            "What a file or a computation may take at most.",
            memory.OPTION,
            metavar="SIZE",
            show_default="100 times the file, at least 64M, at most 2G",
        ),
    ] = None,
    _version: Annotated[
        bool, option("Print the version.", "--version", callback=_print_version, is_eager=True)
    ] = False,
) -> None:
    """Handle the options that may stand before or after the command."""
    console.configure(quiet, verbose)
    memory.set_max_memory(max_memory)


PANELS: dict[str, dict[str, ModuleType]] = {
    "Pose and suggest": {"suggest": suggest, "pose": pose},
    "Train and retarget": {
        "train": train,
        "regions": regions,
        "retarget": retarget,
        "correct": correct,
    },
    "Look and judge": {
        "inspect": inspect,
        "view": view,
        "render": render,
        "plot": plot,
        "eval": evaluate,
        "report": report,
    },
    "Prepare takes": {
        "demo": demo,
        "convert": convert,
        "stabilise": stabilise,
        "clean": clean,
        "simulate": simulate,
    },
    "Without training": {"propagate": propagate, "drive": drive, "points": points},
    "Live and in other programs": {"live": live, "export-script": export_script},
}
for panel, modules in PANELS.items():
    for name, module in modules.items():
        if module is points:
            app.add_typer(points.app, name=name, rich_help_panel=panel)
        else:
            app.command(name, cls=Command, rich_help_panel=panel)(module.command)


@cache
def _command() -> Any:
    """The commands as Typer makes them: of one process, once, as that takes its time."""
    return typer.main.get_command(app)


def run() -> None:
    """Run the command line, and exit with what became of it."""
    console.show_any_letter()
    try:
        _command()()
    except Exception as error:
        if is_unexpected(error) and console.log.isEnabledFor(logging.DEBUG):
            console.err.print(trace(error))
        console.err.print(f"error: {described(error)}", style="red")
        if isinstance(error, OSError):
            _drop_output()
        sys.exit(exit_status(error))


def _drop_output() -> None:
    """Discard output that could not be written: Python would try again at its end."""
    with suppress(OSError), open(os.devnull, "w") as nowhere:  # noqa: PTH123  a device, not a path
        os.dup2(nowhere.fileno(), sys.stdout.fileno())

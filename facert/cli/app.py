"""The ``facert`` command: one registry of commands, one place where errors become exit codes."""

from __future__ import annotations

import sys
from typing import Annotated

import typer

import facert
from facert.cli import (
    console,
    convert,
    demo,
    evaluate,
    inspect,
    plot,
    render,
    retarget,
    simulate,
    train,
)
from facert.errors import FacertError

app = typer.Typer(
    name="facert",
    help="Carry a facial performance over to any character's rig, from a handful of poses.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _print_version(asked: bool) -> None:
    if asked:
        console.out.print(f"facert {facert.__version__}")
        raise typer.Exit


@app.callback()
def options(
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Only warnings and errors.")] = False,
    verbose: Annotated[bool, typer.Option("--verbose", "-v", help="Details as well.")] = False,
    _version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True)
    ] = False,
) -> None:
    """Options before the command."""
    console.configure(quiet, verbose)


app.command("train")(train.command)
app.command("retarget")(retarget.command)
app.command("convert")(convert.command)
app.command("inspect")(inspect.command)
app.command("simulate")(simulate.command)
app.command("demo")(demo.command)
app.command("render")(render.command)
app.command("plot")(plot.command)
app.command("eval")(evaluate.command)


def main() -> None:
    """Run the command line: exit 0 done, 1 failed, 2 wrong usage, 3 bad input."""
    try:
        app()
    except FacertError as error:
        console.err.print(f"error: {error}", style="red", markup=False)
        sys.exit(error.exit_code)
    except KeyboardInterrupt:
        console.err.print("stopped", style="yellow")
        sys.exit(130)

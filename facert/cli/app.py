"""The door of the ``facert`` command: signals are handled before anything else is loaded."""

from __future__ import annotations

import sys

from facert.cli.shared.signals import signals

TYPE_CHECKING = False  # as in typing, which takes its time
if TYPE_CHECKING:
    import typer


def main() -> None:
    """Run the command line.

    Exits with 0 done, 1 failed, 2 wrong usage, 3 bad input, 128 + n ended by signal n.
    """
    is_program = sys._getframe(1).f_globals.get("__name__") == "__main__"
    if is_program:  # elsewhere signals are those of the program that calls
        signals.install()
    from facert.cli.program import run

    try:
        run()
    finally:
        if is_program:
            signals.ignore()


def __getattr__(name: str) -> typer.Typer:
    """The Typer application, loaded when it is asked for."""
    if name != "app":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from facert.cli.program import app

    return app

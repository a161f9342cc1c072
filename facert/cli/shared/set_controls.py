"""Controls set on the command line, as ``--set jawOpen=0.3``."""

from __future__ import annotations

from collections.abc import Sequence

import typer


def parse_controls(wanted: Sequence[str]) -> dict[str, float]:
    """Names and values of ``NAME=VALUE``."""
    given: dict[str, float] = {}
    for text in wanted:
        name, _, value = text.rpartition("=")
        try:
            number = float(value)
        except ValueError:
            name = ""
        if not name.strip():
            raise typer.BadParameter(f"{text!r}: write it as in --set jawOpen=0.3")
        if name.strip() in given:
            raise typer.BadParameter(f"{name.strip()} is set twice")
        given[name.strip()] = number
    return given

"""Hostile files, each written by a small function that registers itself.

A bomb is small, or a hole on the disk, and declares or repeats what is large; or it is honest but
for one absurd number.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from facert.data.take import Controls, Source, Take
from facert.io.formats import write_take_file

READ = ("inspect FILE", "convert FILE DIR/out.h5")
RIG = (*READ, "render DIR/take.h5 DIR/out.png --rig FILE")
TAKE = (*READ, "clean FILE DIR/out.h5", "suggest FILE -n 3")


@dataclass(frozen=True)
class Bomb:
    """One hostile file, by the function that writes it into a folder, and commands to try."""

    make: Callable[[Path], Path]
    commands: Sequence[str]


BOMBS: dict[str, Bomb] = {}


def write_take(folder: Path) -> None:
    """A take of 20 poses of a jaw, for a rig to show."""
    params = np.linspace(0, 1, 20)[:, None]
    source, controls = Source(params, ("jaw",)), Controls(("jawOpen",))
    write_take_file(
        Take(np.arange(20) / 25, source, controls=controls, params=params, fps=25.0),
        folder / "take.h5",
    )


def bomb(name: str, ending: str, commands: Sequence[str] = READ) -> Callable[[Any], Any]:
    """Register a function that makes the content of a file: bytes, text, or JSON."""

    def register(content: Callable[[], Any]) -> Callable[[], Any]:
        def make(folder: Path) -> Path:
            path, made = folder / f"bomb{ending}", content()
            if any("take.h5" in command for command in commands):
                write_take(folder)
            if not isinstance(made, bytes | str):
                made = json.dumps(made)
            path.write_bytes(made.encode() if isinstance(made, str) else made)
            return path

        BOMBS[name] = Bomb(make, commands)
        return content

    return register


def each(name: str, ending: str, cases: dict[str, Any], commands: Sequence[str] = READ) -> None:
    """Register several files of one kind, by their content."""
    for case, content in cases.items():
        bomb(f"{name} {case}", ending, commands)(
            content if callable(content) else lambda content=content: content
        )

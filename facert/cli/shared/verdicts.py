"""Verdicts of takes on a terminal, the worst first, and as a file for programs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.text import Text

from facert.cli.shared import console
from facert.cli.shared.files import save_json

if TYPE_CHECKING:
    from facert.data.verdict import Reason, Verdict

Verdicts = Mapping[tuple[Path, Path], "Verdict"]
"""Of each take, by its file and that of the result."""
COLOURS = {"good": "green", "look at it": "yellow", "bad": "red"}
WORST = 6
"""Frames to look at that a file for programs names."""


def print_verdicts(verdicts: Verdicts, model: Path, many: bool) -> None:
    """A line a take; of a single one, a line for each reason."""
    from facert.data.verdict import LEVELS

    order = sorted(verdicts, key=lambda pair: -LEVELS.index(verdicts[pair].level))
    width = max((len(pair[0].name) for pair in order), default=0)
    for pair in order:
        verdict, name = verdicts[pair], pair[0].name
        reasons = [r for r in verdict.reasons if not many or r.level != LEVELS[0]]
        lines = [_in_words(reason, name, model) for reason in reasons] or [""]
        if many and reasons[1:]:
            kinds = dict.fromkeys(reason.kind for reason in reasons[1:])
            lines = [f"{lines[0]} (also: {', '.join(kinds)})"]
        level = Text(f"{verdict.level:10}", style=COLOURS[verdict.level])
        console.out.print(level, console.cell(f"{name:{width}}  {lines[0]}".rstrip()))
        for line in lines[1:]:
            console.show(f"{'':{width + 13}}{line}")


def _in_words(reason: Reason, take: str, model: Path) -> str:
    """A reason with its cure."""
    return f"{reason.kind}: {reason.text} -> {reason.cure_for(take, model.name)}"


def save_verdicts(verdicts: Verdicts, model: Path, path: Path, overwrite: bool) -> None:
    """Write all of it as JSON."""
    from facert.data.version import CREATED_BY

    takes = [_entry(pair, verdict, model) for pair, verdict in verdicts.items()]
    content = {"created_by": CREATED_BY, "model": str(model), "verdicts": takes}
    save_json(content, path, overwrite)


def _entry(pair: tuple[Path, Path], verdict: Verdict, model: Path) -> dict[str, Any]:
    take, result = pair
    return {
        "take": str(take),
        "result": str(result),
        "level": verdict.level,
        "reasons": list(_reasons(take, verdict, model)),
        "worst": [
            {"frame": int(frame), "seconds": round(float(verdict.time[frame]), 3)}
            for frame in verdict.worst(WORST)
        ],
    }


def _reasons(take: Path, verdict: Verdict, model: Path) -> Iterator[dict[str, Any]]:
    from facert.data.verdict import runs_of

    for reason in verdict.reasons:
        runs = runs_of(reason.frames, verdict.time)
        yield {
            "kind": reason.kind,
            "level": reason.level,
            "text": reason.text,
            "cure": reason.cure_for(take.name, model.name),
            "frames": runs,
            "seconds": [[round(float(verdict.time[end]), 3) for end in run] for run in runs],
        }

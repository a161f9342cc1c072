"""``facert inspect``: what is in a file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from facert.cli.shared import console
from facert.cli.shared.options import AS_JSON, SHAPES, TARGET, argument
from facert.data.text import for_json, plural

if TYPE_CHECKING:
    from rich.table import Table

MOST = 500
"""Names in a list that are shown: nobody reads more, and a table of very many takes seconds."""
_LABELS = {"deviations": "standard deviations"}


def command(
    path: Annotated[Path, argument("FILE", "A take, a rig, a mesh sequence or a model.")],
    target: TARGET = None,
    shapes: SHAPES = None,
    as_json: AS_JSON = False,
) -> None:
    """Show what is in a file: units, rates, names, gaps, labels, active channels.

    facert inspect facert-demo/training.h5
    facert inspect model.safetensors --json
    """
    facts = _facts(path, target, shapes)
    if as_json:
        console.write(for_json({"file": str(path), **facts}) + "\n")
    else:
        shown = _model_facts(facts) if facts["kind"] == "model" else _take_facts(facts)
        console.out.print(_table(path.name, shown), soft_wrap=False)


def _facts(path: Path, target: str | None, shapes: str | None) -> dict[str, Any]:
    """Facts about a file's content, ready for JSON."""
    if path.suffix.lower() == ".safetensors":
        from facert.retarget.retargeter import load

        return {"kind": "model", **load(path).facts}
    from facert.data.facts import facts_of
    from facert.io.formats import nodes_of, read_any, targets_of
    from facert.io.mesh_sequence import holds_mesh_sequence, open_mesh_sequence
    from facert.io.npz import NO_TARGET
    from facert.io.take_overview import overview

    if holds_mesh_sequence(path):
        with open_mesh_sequence(path) as sequence:
            return facts_of(sequence)
    if target is None and shapes is None and (looked := overview(path)) is not None:
        return facts_of(looked)
    targets = targets_of(path) if target is None else {}
    found = read_any(path, target=NO_TARGET if targets else target, shapes=shapes, fps=None)
    facts = facts_of(found)
    if facts["kind"] == "rig" and (nodes := nodes_of(path)):
        facts["nodes"] = nodes
    if targets:
        console.log.info("several targets: --target shows one of them")
        facts["controls_of_targets"] = {name: len(controls) for name, controls in targets.items()}
    return facts


def _model_facts(facts: Mapping[str, Any]) -> dict[str, Any]:
    """Facts about a model with only the settings that its method uses, and plain names."""
    from facert.methods.registry import method_class
    from facert.settings import OF_SHARED

    settings, figures = facts["settings"], facts["figures"]
    idle = () if method_class(settings["method"]).stepwise else OF_SHARED
    used = {name: value for name, value in settings.items() if name not in idle}
    named = {console.figure_label(name): value for name, value in figures.items()}
    return {**facts, "settings": used, "figures": named}


def _take_facts(facts: Mapping[str, Any]) -> dict[str, Any]:
    """Of a take or a rig, for people: the targets of a file, a line for each."""
    shown = dict(facts)
    targets = shown.pop("controls_of_targets", {})
    return shown | {f"target {name}": plural(count, "control") for name, count in targets.items()}


def _table(title: str, facts: Mapping[str, Any]) -> Table:
    from rich import box
    from rich.table import Table

    table = Table(
        title=console.cell(title), title_justify="left", box=box.SIMPLE, show_header=False
    )
    table.add_column(style="bold", max_width=44)
    table.add_column(overflow="fold")
    for label, text in _lines(facts):
        table.add_row(label, console.cell(text))
    return table


def _lines(facts: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, str]]:
    """Label and text of every fact that is not empty, parts below their whole."""
    for key, value in facts.items():
        label = prefix + _LABELS.get(key, key.replace("_", " "))
        if isinstance(value, Mapping):
            yield from _lines(value, f"{label} ")
        elif value not in ("", (), [], None):
            yield label, f"{value:.1%}" if key == "missing" else _text(value)


def _text(value: Any) -> str:
    if value is None:
        return "any"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, Sequence) and not isinstance(value, str):
        count = f"({len(value)}) " if value and isinstance(value[0], str) else ""
        more = f", and {len(value) - MOST} more: --json lists all" if len(value) > MOST else ""
        return count + ", ".join(map(_part, value[:MOST])) + more
    return str(value)


def _part(value: Any) -> str:
    """An entry of a list: a name with its share, a low and a high limit, or anything plain."""
    if isinstance(value, Mapping):
        return f"{value['name']} {value['missing']:.1%}"
    if isinstance(value, (list, tuple)):
        return " to ".join(map(_text, value))
    return _text(value)

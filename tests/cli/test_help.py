"""The help of every command: as wide as the terminal, with two examples that work as printed."""

from __future__ import annotations

import shlex
from dataclasses import replace
from pathlib import Path

import pytest
import typer.main

from facert.cli.app import app
from facert.cli.shared.help import examples
from facert.data.units import METRES
from facert.demo import write_demo
from facert.settings import DESCRIBED, FINE

GROUP = typer.main.get_command(app)
COMMANDS = {
    **{name: one for name, one in GROUP.commands.items() if name != "points"},
    "points suggest": GROUP.commands["points"].commands["suggest"],
}
# They wait for Ctrl-C, or take minutes: that they can be parsed must do.
LONG = ("facert view", "facert pose --view", "facert live", "facert eval --labels", ".gif")
SHORTER = {"training.h5": 600, "performance.h5": 150}
"""Frames that are left of the demo's takes: the examples do the same with them."""
# What one of a command's examples makes, and those of others take.
WRITTEN = {
    "demo": "facert-demo",
    "train": "model.safetensors",
    "retarget": "retargeted.h5",
    "convert": "curves.csv",
}
EXAMPLES = [(name, line) for name, one in COMMANDS.items() for line in examples(one)]


@pytest.fixture(scope="module", name="made")
def _made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The demo, a model of it, and what the examples take from each other."""
    import facert
    from facert.io.formats import write_take_file

    folder = tmp_path_factory.mktemp("examples")
    write_demo(folder / "facert-demo")
    for name, frames in SHORTER.items():
        path = folder / "facert-demo" / name
        take = facert.read_take(path)
        kept = range(frames)
        part = replace(
            take,
            time=take.time[kept],
            source=take.source.with_matrix(take.source.matrix[kept]),
            params=take.params[kept],
        )
        facert.write_take(part, path, overwrite=True)
    model = facert.train(facert.read_take(folder / "facert-demo" / "training.h5"))
    model.save(folder / "model.safetensors")
    result = model.retarget(facert.read_take(folder / "facert-demo" / "performance.h5"))
    write_take_file(result, folder / "retargeted.h5")
    write_take_file(result, folder / "curves.csv")
    return folder


@pytest.mark.parametrize("columns", [80, 120])
@pytest.mark.parametrize("name", ["", *COMMANDS])
def test_help_fits_the_terminal_without_broken_words(facert, monkeypatch, name, columns):
    monkeypatch.setenv("COLUMNS", str(columns))
    shown = facert(*name.split(), "--help").out
    assert max(map(len, shown.splitlines())) <= columns
    assert "<" not in shown
    words = set(shown.split())
    command = COMMANDS.get(name, GROUP)
    texts = [command.help or "", *(param.help or "" for param in command.params)]
    assert not set(" ".join(texts).split()) - words


def test_commands_stand_in_panels(facert):
    shown = facert("--help").out
    for panel in ("Pose and suggest", "Train and retarget", "Look and judge", "Without training"):
        assert f"─ {panel} ─" in shown


def test_train_has_an_option_for_every_setting_but_the_finest():
    offered = {param.name for param in COMMANDS["train"].params}
    groups = {name: about.group for name, (_, about) in DESCRIBED.items()}
    assert {name for name, group in groups.items() if group != FINE} <= offered
    assert not {name for name, group in groups.items() if group == FINE} & offered


@pytest.mark.parametrize("name", COMMANDS)
def test_help_ends_with_two_examples(facert, name):
    lines = examples(COMMANDS[name])
    assert len(lines) == 2
    shown = facert(*name.split(), "--help").out.rstrip()
    assert shown.endswith("\n".join(["Examples", *(f"  {one}" for one in lines)]))


def test_units_are_listed_as_they_are_known():
    units = next(param for param in COMMANDS["convert"].params if param.name == "units")
    assert f"{', '.join(METRES)};".replace(", ft", " or ft") in units.help


@pytest.mark.parametrize(("name", "line"), EXAMPLES)
def test_examples_are_of_their_command_and_can_be_parsed(name, line):
    words = shlex.split(line.partition(">")[0])[1:]
    count = len(name.split())
    assert words[:count] == name.split()
    COMMANDS[name].make_context(name, words[count:])


@pytest.mark.slow
@pytest.mark.parametrize("line", [one for _, one in EXAMPLES if not any(w in one for w in LONG)])
def test_examples_run_on_the_demo(facert, made, tmp_path, monkeypatch, line):
    words = shlex.split(line.partition(">")[0])[1:]
    for path in made.iterdir():
        if path.name != WRITTEN.get(words[0]):
            (tmp_path / path.name).symlink_to(path)
    monkeypatch.chdir(tmp_path)
    done = facert(*words)
    assert done.code == 0, done.err

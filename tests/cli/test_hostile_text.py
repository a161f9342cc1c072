"""Every command over files whose every name is hostile: it comes out as text, wherever it does."""

from __future__ import annotations

import csv
import json
import re
from dataclasses import MISSING, dataclass, fields
from html.parser import HTMLParser
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from PIL import Image

import facert as api
from facert.data.rig import Rig
from facert.data.take import Controls, Source, Take
from facert.evaluation.table import EvaluationRow
from facert.io.rig import write_rig

IN_FILES = (
    "[/bold]", ":smile:[red]", "$\\frac{$", "$x$", "<script>alert(1)</script>", "=cmd|' /C'!A0",
    '"><img src=x onerror=alert(1)>', "+1;=2", "@SUM(1)", "-x", "'=1", "\u202egnp.exe\u2066",
    "%s %d {0} {{7*7}}", "$(reboot)`id`", "x' or 1", "]]>&amp;--", "\u200b\ufeff hidden",
)  # fmt: skip
"""What a take can hold: control characters are refused when it is read."""
CALLED = "bold]\x1b[31m\x1b]0;owned\x07:smile:$\\frac{$\u202e\x9b2J<img src=x>\n'\"&`id` =1"
"""What a file is called; it lies in a folder that is called [."""


@dataclass(frozen=True)
class Hostile:
    """A folder of files with hostile names, about hostile names."""

    folder: Path

    def __call__(self, kind: str) -> Path:
        return self.folder / f"{CALLED}{kind}"

    @property
    def reported(self) -> Path:
        """What a report is made of."""
        return self.folder / f"{CALLED} reported"


def hostile_rig() -> Rig:
    across, up = np.meshgrid(np.arange(6.0), np.arange(6.0))
    neutral = np.stack([across.ravel(), up.ravel(), np.sin(across).ravel()], axis=1)
    corner = (np.arange(5)[:, None] * 6 + np.arange(5)).ravel()
    faces = np.concatenate([corner[:, None] + (0, 1, 6), corner[:, None] + (1, 7, 6)])
    shapes = np.random.default_rng(1).normal(scale=0.2, size=(4, 36, 3))
    return Rig(neutral, shapes, IN_FILES[:4], faces, units="[/bold]<b>$\\frac{$")


def hostile_take(rig: Rig, frames: int = 40) -> Take:
    time = np.arange(frames) / 30
    walk = np.sin(time[:, None] * (3 + np.arange(4)))
    moved = rig.neutral[::2][:12] + np.einsum("tp,pvc->tvc", walk, rig.shapes[:, ::2][:, :12])
    params = np.where(np.arange(frames)[:, None] % 3 == 0, walk, np.nan)
    limits = np.tile([-0.9, 1.0], (4, 1))
    return Take(
        time, Source(moved, IN_FILES[4:16]), Controls(rig.names, limits), params,
        units="[/bold]<b>", start_timecode="<i>[/x]$\\frac{$", created_by="[/me]",
    )  # fmt: skip


@pytest.fixture(scope="module")
def hostile(tmp_path_factory) -> Hostile:
    folder = tmp_path_factory.mktemp("hostile") / "["
    folder.mkdir()
    found, rig = Hostile(folder), hostile_rig()
    take = hostile_take(rig)
    write_rig(rig, found(".rig.h5"))
    api.write_take(take, found(".h5"))
    trained = api.train(take, api.Settings(method="nearest", smooth=False, detect=False))
    trained.save(found(".safetensors"))
    api.write_take(trained.retarget(take), found(".result.h5"))
    weights = Source(np.nan_to_num(take.params), rig.names)
    api.write_take(Take(take.time, weights), found(".weights.h5"))
    text = 'controls = 3\n["[/bold]\\u001b[31m$x$"]\ngain = 1.2\n'
    found(".toml").write_text(text)
    found(".poses.csv").write_text('time,"[/b]\x1b[31m"\n0,1\n1,2\n')
    found.reported.mkdir()
    for kind in (".result.h5", ".rig.h5", ".safetensors"):
        (found.reported / found(kind).name).hardlink_to(found(kind))
    (found.reported / f"{CALLED}.json").write_text(
        json.dumps(evaluation("\x1b[31m[/bold]<img src=x>$\\frac{$\n"))
    )
    return found


def evaluation(evil: str) -> dict[str, object]:
    """What eval --json might have written."""
    row = {
        one.name: None if one.default is MISSING else one.default for one in fields(EvaluationRow)
    }
    row |= {"method": evil, "labels": 5, "unlabelled": 3, "rms": 0.1, "per_control": [0.1, 0.2]}
    row |= {"repeats": 2, "noise": 0.0, "missing": 0.0, "failure": evil}
    rows = [row, row | {"method": "x" + evil, "labels": 9, "failure": ""}]
    keys = ("take", "target", "across", "rig", "split")
    names = {"controls": ["a" + evil, "b" + evil], "versions": {evil: evil}}
    return {"settings": {**dict.fromkeys(keys, evil), **names}, "rows": rows}


COMMANDS: dict[str, tuple[str, ...]] = {
    "inspect": ("inspect {.h5}", "inspect {.safetensors} -v", "inspect {.rig.h5}",
                "inspect {.h5} --json", "inspect {.safetensors} --json", "inspect {.result.h5}"),
    "suggest": ("suggest {.h5} -n 3 --sheet {out.png}", "suggest {.h5} {.result.h5} -n 3 --json"),
    "train": ("train {.h5} -o {out.safetensors} --method ridge -v",),
    "regions": ("regions {.h5}",),
    "retarget": ("retarget {.h5} {out.csv} -m {.safetensors} --json {verdict.json} -v",
                 "retarget {.h5} {.result.h5} --out-dir {batch} -m {.safetensors}"),
    "correct": ("correct {.result.h5} -o {fixed.h5} -m {.safetensors} --frame 5 --set [/bold]=.4",
                "correct {.result.h5} --list"),
    "render": ("render {.result.h5} {sheet.svg} --rig {.rig.h5}",
               "render {.result.h5} {clip.gif} --rig {.rig.h5} --size 64"),
    "plot": ("plot {.result.h5} {curves.svg}", "plot {.result.h5} {curves.png}"),
    "eval": ("eval {.h5} --methods nearest --labels 4,5 --jobs 1 --json {eval.json} "
             "--plot {eval.svg}",),
    "report": ("report {reported} -o {out.html}",),
    "convert": ("convert {.h5} {made.csv}", "convert {.weights.h5} {made.json}",
                "convert {.weights.h5} {made2.csv}",
                "convert {.result.h5} {made.glb} --rig {.rig.h5}",
                "convert {.result.h5} {made.usda} --rig {.rig.h5}", "convert {.rig.h5} {rig.glb}",
                ),
    "stabilise": ("stabilise {.h5} {still.h5}",),
    "clean": ("clean {.h5} {clean.csv}", "clean {.h5} {clean.h5} -v"),
    "simulate": ("simulate {.rig.h5} {.weights.h5} {simulated.h5} --markers 5",),
    "propagate": ("propagate {.h5} {whole.h5}",),
    "drive": ("drive {.rig.h5} {.h5} {driven.h5} --auto", "drive {.rig.h5} {.h5} {d.glb} --auto"),
    "points": ("points suggest {.rig.h5} -n 4",),
    "pose": ("pose --set [/bold]=0.4 -m {.safetensors} -o {pose.h5}",),
    "export-script": ("export-script blender", "export-script maya"),
    "errors": ("convert {.h5} {posed.h5} --poses {.poses.csv}", "inspect {nothing.h5}",
               "pose --set [/b]\x1b -m {.safetensors}", "pose --set \x1b[31m=1 -m {.safetensors}",
               "inspect {.toml}", "train {.h5} --config {.toml}", "\x1b[31m[/bold]",
               "retarget {.h5} {no.h5} -m {.safetensors} --controls {.toml}",
               "inspect --\x1b[31m[/bold]", "suggest {.h5} -n \x1b[31m[/b]",
               "plot {.h5} {x.svg} --controls \x1b[", "convert {.h5} {out.\x1b[}",
               "inspect {.h5} --target \x1b[", "view {.h5} --host \x1b[31m[/x]"),
}  # fmt: skip


@pytest.mark.parametrize("command", COMMANDS)
def test_a_hostile_name_comes_out_as_text(command: str, facert, hostile: Hostile) -> None:
    failed = []
    for line in COMMANDS[command]:
        done = facert(*(_argument(word, hostile) for word in line.split(" ")))
        assert _is_text(done.out), (line, done.out)
        assert _is_text(done.err), (line, done.err)
        assert not re.search("Traceback|unexpected", done.err), done.err
        failed += [done.err] if done.code else []
        for word in line.split(" "):
            path = Path(_argument(word, hostile))
            if path.suffix in CHECKS and path.exists() and not path.name.endswith(".poses.csv"):
                CHECKS[path.suffix](path)
    assert len(failed) == (len(COMMANDS[command]) if command == "errors" else 0), failed


def _argument(word: str, hostile: Hostile) -> object:
    found = re.fullmatch(r"\{(.*)\}", word)
    if found is None:
        return word
    return hostile.reported if found[1] == "reported" else hostile(found[1])


def _is_text(text: str) -> bool:
    return all(sign.isprintable() for sign in text.replace("\n", ""))


class _Elements(HTMLParser):
    """The elements of a page, and what their attributes are called."""

    def __init__(self) -> None:
        super().__init__()
        self.found: set[str] = set()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found |= {tag, *(name for name, _ in attrs if name.startswith("on"))}
        urls = [value or "" for name, value in attrs if name in ("src", "href")]
        assert all(url.startswith(("data:", "#")) for url in urls)


def _check_page(path: Path) -> None:
    elements = _Elements()
    elements.feed(path.read_text())
    assert not elements.found & {"script", "onerror", "b", "i", "iframe", "object"}
    assert _is_text(path.read_text())


def _check_picture(path: Path) -> None:
    ElementTree.parse(path)
    assert _is_text(path.read_text())


def _check_table(path: Path) -> None:
    with path.open(newline="") as file:
        header = next(csv.reader(file))
    assert not any(cell.lstrip()[:1] in set("=+-@\t\r") for cell in header)
    read = api.read_take(path)
    assert read.source.names in (IN_FILES[:4], IN_FILES[4:16])


CHECKS = {
    ".html": _check_page, ".svg": _check_picture, ".csv": _check_table,
    ".png": lambda path: Image.open(path).verify(), ".gif": lambda path: Image.open(path).verify(),
    ".usda": lambda path: path.read_text(encoding="utf-8"),
    ".glb": lambda path: api.read_rig(path),
}  # fmt: skip

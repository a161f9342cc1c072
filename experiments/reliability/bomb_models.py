"""Hostile models and mesh sequences: little that declares much; see `bomb_registry`."""

from __future__ import annotations

import json
import math
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from experiments.reliability.bomb_registry import BOMBS, READ, Bomb, write_take
from experiments.reliability.bomb_tables import honest, markers
from facert import load

MODEL = ("inspect FILE", "retarget DIR/take.csv DIR/out.h5 --model FILE")
OWN_TAKE = ("inspect FILE", "retarget DIR/take.h5 DIR/out.h5 --model FILE")
MODELS = Path(__file__).parents[2] / "tests" / "retarget" / "models"
SEQUENCE = ("inspect FILE", "render FILE DIR/out.png", "convert FILE DIR/out.glb",
            "render FILE DIR/out.png --beside FILE")  # fmt: skip
FOLDER = (*READ, "render DIR/take.h5 DIR/out.png --rig FILE",
          "drive FILE/neutral.obj DIR/points.csv DIR/out.h5 --auto")  # fmt: skip


def model(shape: list[int], kept: int, claimed: int | None = None) -> Callable[[Path], Path]:
    """A model whose only tensor has so many bytes, which are a hole, or claims so."""

    def make(folder: Path) -> Path:
        (folder / "take.csv").write_text(honest())
        tensor = {"dtype": "F64", "shape": shape, "data_offsets": [0, claimed or kept]}
        head = json.dumps({"__metadata__": {"format": "facert-model"}, "a": tensor}).encode()
        path = folder / "bomb.safetensors"
        with path.open("wb") as file:
            file.write(struct.pack("<Q", len(head)) + head)
            file.truncate(8 + len(head) + kept)
        return path

    return make


def posed(method: str, poses: int) -> Callable[[Path], Path]:
    """A model of so many poses, which are a hole; all else is as it was learned."""

    def make(folder: Path) -> Path:
        take, few = MODELS / "take.h5", 12
        (folder / "take.h5").write_bytes(take.read_bytes())
        path = folder / "bomb.safetensors"
        load(MODELS / f"{method}.safetensors").save(path)
        content = path.read_bytes()
        start = 8 + int.from_bytes(content[:8], "little")
        header = json.loads(content[8:start])
        about = json.loads(header.pop("__metadata__")["facert"])
        head: dict[str, Any] = {"__metadata__": {"facert": json.dumps(_grown(about, few, poses))}}
        parts, end = [], 0
        for name, one in sorted(header.items(), key=lambda item: item[1]["data_offsets"]):
            shape = [poses if size == few else size for size in one["shape"]]
            if shape == one["shape"]:
                first, last = one["data_offsets"]
                parts.append((end, content[start + first : start + last]))
            size = 8 * math.prod(shape)
            head[name] = {"dtype": "F64", "shape": shape, "data_offsets": [end, end + size]}
            end += size
        text = json.dumps(head).encode()
        with path.open("wb") as file:
            file.write(struct.pack("<Q", len(text)) + text)
            for place, values in parts:
                file.seek(8 + len(text) + place)
                file.write(values)
            file.truncate(8 + len(text) + end)
        return path

    return make


def _grown(value: Any, few: int, many: int) -> Any:
    """A JSON value with one number in place of another."""
    if isinstance(value, dict):
        return {key: _grown(inner, few, many) for key, inner in value.items()}
    if isinstance(value, list):
        return [_grown(inner, few, many) for inner in value]
    return many if type(value) is int and value == few else value


def sequence(frames: int, vertices: int, faces: int, packed: bool) -> Callable[[Path], Path]:
    """A mesh sequence of zeros that were never written, or are compressed."""

    def make(folder: Path) -> Path:
        path = folder / "bomb.h5"
        kept: dict[str, Any] = {"compression": "gzip", "chunks": True} if packed else {}
        with h5py.File(path, "w", libver="latest") as file:
            file.attrs.update(format="facert-mesh-sequence", format_version=1, fps=25.0, units="m")
            file["time"] = np.arange(frames) / 25
            file.create_dataset("faces", (faces, 3), "i4", **kept)
            file.create_dataset("neutral", (vertices, 3), "f8", **kept)
            file.create_dataset("vertices", (frames, vertices, 3), "f4", **kept)
        return path

    return make


def obj_folder(vertices: int, shapes: int) -> Callable[[Path], Path]:
    """A rig of OBJ files of many vertices and one triangle."""

    def make(folder: Path) -> Path:
        write_take(folder)
        (folder / "points.csv").write_text(markers(6, 10))
        made = folder / "bomb"
        made.mkdir()
        text = "v 0 0 0\nv 1 0 0\nv 0 1 0\n" + "v 1 2 3\n" * vertices + "f 1 2 3\n"
        for name in ("neutral", *(f"s{i}" for i in range(shapes))):
            (made / f"{name}.obj").write_text(text)
        return made

    return make


for name, make in {
    "a tensor of 8 TB": model([10**9, 1000], 100, 8 * 10**12),
    "a tensor of 4 GB that is a hole": model([5 * 10**8], 4 * 10**9),
    "a tensor of 10^18 by 0": model([10**18, 0], 8, 8),
    "10^5 dimensions": model([1] * 100_000, 8),
}.items():
    BOMBS[f"model {name}"] = Bomb(make, MODEL)
for method in ("auto", "gpr", "nearest", "pls", "rbf", "regions", "ridge", "ssgpr", "svr"):
    BOMBS[f"model {method} of 50,000 poses"] = Bomb(posed(method, 50_000), OWN_TAKE)
for name, make in {
    "5 million vertices, never written": sequence(4, 5_000_000, 1, False),
    "5 million vertices, packed": sequence(4, 5_000_000, 1, True),
    "a million frames": sequence(1_000_000, 3, 1, False),
    "5 million triangles": sequence(4, 3, 5_000_000, True),
}.items():
    BOMBS[f"sequence of {name}"] = Bomb(make, SEQUENCE)
BOMBS["obj folder of 300,000 vertices, 3 shapes"] = Bomb(obj_folder(300_000, 3), FOLDER)
BOMBS["obj folder of 3 vertices, 5,000 shapes"] = Bomb(obj_folder(0, 5_000), FOLDER)

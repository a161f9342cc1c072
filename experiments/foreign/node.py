"""GLB files that gltfpack and gltf-transform make smaller, and Khronos' validator."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from collections.abc import Callable, Sequence
from pathlib import Path

from experiments.foreign.documents import skinned_builder
from experiments.foreign.face import (
    FACE,
    FPS,
    NAMES,
    SHAPES,
    TIME,
    VERTICES,
    WEIGHTS,
    rig_difference,
    weights_difference,
)
from experiments.foreign.trial import Trial
from facert.io.formats import read_rig_file, read_take_file
from facert.io.gltf.writer import write_glb
from facert.mesh.morphs import rig_morphs

PACK, TRANSFORM, VALIDATOR = "gltfpack", "gltf-transform", "gltf-validator"
_SHOWN = dict(zip(NAMES, SHAPES, strict=True))
_COARSE = 3e-4
"""Metres: 14 bits over the space from the origin to the head, as gltf-transform cuts it."""
_FINE = 1e-4
_EXACT = 5e-7
_PACKED = {
    "as it comes": (),
    "extras and names kept": ("-ke", "-kn"),
    "normalised": ("-vpn",),
    "16 bits": ("-vp", "16"),
    "float32": ("-vpf",),
    "not quantised": ("-noq",),
    "compressed": ("-c",),
    "compressed more": ("-cc",),
    "simplified not, interleaved": ("-vi",),
}
_TRANSFORMED = {
    "quantize": (),
    "meshopt": (),
    "sparse": (),
    "weld": (),
    "dedup": (),
    "flatten": (),
    "join": (),
    "copy": (),
    "unweld": (),
    "reorder": (),
    "dequantize": (),
    "optimize": ("--compress", "meshopt", "--simplify", "false"),
}
_VALIDATE = """
const path = process.argv[1];
require('gltf-validator').validateBytes(new Uint8Array(require('fs').readFileSync(path)))
    .then(found => console.log(JSON.stringify(found.issues)));
"""


def trials(folder: str) -> list[Trial]:
    """Trials of the programs in a folder of npm's, or else on the path."""
    made: list[Trial] = []
    pack, transform = (_program(name, folder) for name in (PACK, TRANSFORM))
    for kind, source in (("plain", _plain), ("skinned", _skinned)):
        for about, options in _PACKED.items():
            command = [pack, "-i", "{}", "-o", "{}", *options]
            made += _pair(PACK, f"{kind}.glb", about, source, command)
        for about, options in _TRANSFORMED.items():
            command = [transform, about, "{}", "{}", *options]
            made += _pair(TRANSFORM, f"{kind}.glb", about, source, command)
    modules = str(Path(folder) / "node_modules") if folder else os.environ.get("NODE_PATH", "")
    return [*made, Trial(VALIDATOR, "facert's .glb", "errors and warnings", _valid(modules), 0.0)]


def present(program: str, folder: str) -> bool:
    """Whether a program is there."""
    if program == VALIDATOR:
        command = ["node", "-e", "require('gltf-validator')"]
        modules = str(Path(folder) / "node_modules") if folder else os.environ.get("NODE_PATH", "")
        return bool(shutil.which("node")) and not _run(command, modules).returncode
    return bool(shutil.which(_program(program, folder)))


def _program(name: str, folder: str) -> str:
    own = Path(folder) / "node_modules" / ".bin" / name
    return str(own) if folder and own.exists() else name


def _run(command: Sequence[str], modules: str = "") -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "NODE_PATH": modules, "NO_COLOR": "1"}
    return subprocess.run(command, capture_output=True, text=True, check=False, env=environment)


def _plain(path: Path) -> None:
    write_glb(rig_morphs(FACE, WEIGHTS, TIME, FPS), path)


def _skinned(path: Path) -> None:
    builder, node = skinned_builder()
    builder.animate(node, TIME, builder.single(WEIGHTS.ravel()))
    builder.save(path)


def _pair(
    program: str, file: str, about: str, source: Callable[[Path], None], command: list[str]
) -> list[Trial]:
    """Trials of the rig and of its animation."""

    def changed(folder: Path) -> Path:
        before, after = folder / f"before-{file}", folder / file
        source(before)
        places = iter((str(before), str(after)))
        done = _run([next(places) if part == "{}" else part for part in command])
        if not after.exists():
            raise RuntimeError((done.stderr or done.stdout)[-200:])
        return after

    def rig(folder: Path) -> float:
        return rig_difference(read_rig_file(changed(folder)), VERTICES, _SHOWN)

    def take(folder: Path) -> float:
        found = read_take_file(changed(folder))
        return weights_difference(found, TIME, WEIGHTS)

    packs = program == PACK  # it samples animations anew
    return [
        Trial(program, file, f"vertices, {about}", rig, _tolerance(program, about)),
        *([] if packs else [Trial(program, file, f"weights, {about}", take, 1 / 254)]),
    ]


def _tolerance(program: str, about: str) -> float:
    if program == PACK:
        return _EXACT if about == "not quantised" else _FINE
    return _COARSE if about in ("quantize", "meshopt", "optimize") else _EXACT


def _valid(modules: str) -> Callable[[Path], float]:
    def difference(folder: Path) -> float:
        path = folder / "face.glb"
        _plain(path)
        issues = json.loads(_run(["node", "-e", _VALIDATE, str(path)], modules).stdout)
        if issues["numErrors"] or issues["numWarnings"]:
            raise ValueError(", ".join(one["message"] for one in issues["messages"][:3]))
        return 0.0

    return difference

"""What Blender exports and imports; `in_blender` is what runs there."""

from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from tempfile import mkdtemp

import numpy as np

from experiments.foreign.face import (
    FACE,
    FACES,
    FPS,
    NAMES,
    SHAPES,
    TIME,
    VERTICES,
    WEIGHTS,
    rig_difference,
    weights_difference,
)
from experiments.foreign.trial import Trial, messages
from facert import Source, Take
from facert.data.arrays import FloatArray
from facert.io.formats import read_rig_file, read_take_file, write_take_file
from facert.io.gltf.writer import write_glb
from facert.io.importers import script
from facert.mesh.morphs import rig_morphs

SCRIPT = Path(__file__).with_name("in_blender.py")
RIGS = {
    "moved.glb": "an object that was moved, turned, scaled",
    "separate.gltf": "the same as .gltf and .bin",
    "sparse.glb": "sparse targets",
    "materials.glb": "two materials",
    "skinned.glb": "an armature at scale 0.01 on its back",
    "skinned_moved.glb": "the same, elsewhere",
    "several.glb": "a head, teeth and lashes",
}
ANIMATIONS = {
    "animated_24.glb": "24/s",
    "animated_23.976.glb": "a scene at 23.976/s",
    "animated_60.glb": "60/s",
    "animated_sparse_keys.glb": "keys as they are, not sampled",
    "animated_skinned.glb": "a head with an armature",
}
OBJ = {
    "obj": (1.0, False, "as it comes"),
    "obj_cm": (100.0, False, "scale 100, no normals"),
    "obj_z_up": (1.0, True, "z up"),
    "obj_triangles": (1.0, False, "triangles, smooth groups"),
}
_MIXED = {"obj_mixed": "one with another axis up", "obj_mixed_scale": "one 100 times as large"}


_SNAPPED = 1.01e-3
"""The share by which a rate may be off: 24.024 is taken as 24."""


def commands() -> dict[str, list[str]]:
    """The commands that start the programs of this kind that are here, by program."""
    found = {"Blender": shutil.which("blender")}
    return {
        name: [path, "--background", "--factory-startup", "--python"]
        for name, path in found.items()
        if path
    }


def trials(program: str, command: list[str]) -> list[Trial]:
    """Trials of one Blender, or of a Python that has bpy."""
    files = cache(lambda: _made(command))

    def trial(file: str, compared: str, of: Callable[[Path], float], tolerance: float) -> Trial:
        return Trial(program, file, compared, lambda _: of(files()), tolerance)

    return [
        *(trial(one, f"vertices, {about}", _rig(one), 2e-6) for one, about in RIGS.items()),
        *(trial(one, f"weights, {about}", _keys(one), 2e-5) for one, about in ANIMATIONS.items()),
        trial("driven.glb", "weights, shape keys driven by a bone", _driven, 2e-5),
        *(trial(f"{one}/", f"shapes, {OBJ[one][2]}", _obj(one), 2e-6 * OBJ[one][0]) for one in OBJ),
        *(
            trial(f"{one}/", f"a warning: {about}", _warned(one), 0.0)
            for one, about in _MIXED.items()
        ),
        trial("facert's .glb", "vertices as Blender has them", _imported_rig, 2e-6),
        *(
            trial(f"facert's {one}", "weights as Blender plays them", _played(f"facert{one}"), 2e-5)
            for one in (".glb", ".json", ".csv")
        ),
    ]


def _made(command: list[str]) -> Path:
    """A folder with all that Blender makes of the face, and of facert's files."""
    folder = Path(mkdtemp(prefix="facert-"))
    facts = {"vertices": VERTICES, "faces": FACES, "shapes": SHAPES, "names": NAMES}
    np.savez(folder / "face.npz", weights=WEIGHTS, time=TIME, **facts)
    write_glb(rig_morphs(FACE, WEIGHTS, TIME, FPS), folder / "facert.glb")
    for ending in (".json", ".csv"):
        write_take_file(Take(TIME, Source(WEIGHTS, NAMES), fps=FPS), folder / f"facert{ending}")
    (folder / "import_curves.py").write_text(script("blender"), encoding="utf-8")
    done = subprocess.run(
        [*command, str(SCRIPT), "--", str(folder)], capture_output=True, text=True, check=False
    )
    if not (folder / "blender.json").exists():
        raise RuntimeError(done.stderr[-300:] or done.stdout[-300:])
    failed = json.loads((folder / "blender.json").read_text(encoding="utf-8"))["failed"]
    if failed:
        raise RuntimeError(", ".join(f"{step}: {error[-200:]}" for step, error in failed.items()))
    return folder


def _truth(folder: Path, name: str) -> dict[str, FloatArray]:
    """What Blender says of a file: vertices, weights, or shapes by name."""
    with np.load(folder / "truth.npz") as file:
        found = {key: file[key] for key in file.files if key.startswith(f"{name}/")}
    return {key.removeprefix(f"{name}/"): values for key, values in found.items()}


def _shapes(truth: Mapping[str, FloatArray], scale: float = 1.0) -> dict[str, FloatArray]:
    return {name: scale * truth[name] for name in NAMES if name in truth}


def _rig(name: str) -> Callable[[Path], float]:
    def difference(folder: Path) -> float:
        truth = _truth(folder, name)
        return rig_difference(read_rig_file(folder / name), truth["vertices"], _shapes(truth))

    return difference


def _keys(name: str) -> Callable[[Path], float]:
    """Weights at the times in the file, which are not all that the scene has.

    At 23.976/s, Blender 3.4 writes 24 keys a second and 4.4 writes 24.024.
    """

    def difference(folder: Path) -> float:
        take, time = read_take_file(folder / name), _times_in(folder / name)
        off = weights_difference(take, time, WEIGHTS)
        return max(off, abs(take.fps * (time[-1] - time[0]) / (len(time) - 1) - 1) - _SNAPPED)

    return difference


def _times_in(path: Path) -> FloatArray:
    """The times of the keys of the first animation, as pygltflib finds them."""
    import pygltflib

    document = pygltflib.GLTF2.load(str(path))
    keys = document.accessors[document.animations[0].samplers[0].input]
    begin = document.bufferViews[keys.bufferView].byteOffset or 0
    found = np.frombuffer(document.binary_blob(), "<f4", keys.count, begin)
    return found.astype(np.float64)


def _driven(folder: Path) -> float:
    take = read_take_file(folder / "driven.glb")
    if set(NAMES[:3]) - set(take.source.names):
        raise ValueError(f"weights {', '.join(take.source.names)}")
    order = [take.source.names.index(name) for name in NAMES[:3]]
    return float(np.abs(take.source.values[:, order] - WEIGHTS[:, :3]).max())


def _obj(name: str) -> Callable[[Path], float]:
    def difference(folder: Path) -> float:
        scale, z_up, _ = OBJ[name]
        turn = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]) if z_up else np.eye(3)
        truth = {key: scale * value @ turn.T for key, value in _truth(folder, "obj").items()}
        return rig_difference(read_rig_file(folder / name), truth["vertices"], _shapes(truth))

    return difference


def _warned(name: str) -> Callable[[Path], float]:
    def difference(folder: Path) -> float:
        with messages() as lines:
            read_rig_file(folder / name)
        if not any(NAMES[-1] in line for line in lines):
            raise ValueError("nothing is told")
        return 0.0

    return difference


def _imported_rig(folder: Path) -> float:
    truth = _truth(folder, "facert.glb")
    return rig_difference(FACE, truth["vertices"], _shapes(truth))


def _played(name: str) -> Callable[[Path], float]:
    return lambda folder: float(np.abs(_truth(folder, name)["weights"] - WEIGHTS).max())

"""Meshes that trimesh writes, and facert's that trimesh and usd-core read."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

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
)
from experiments.foreign.trial import Trial
from facert.data.arrays import FloatArray
from facert.io.formats import read_mesh, read_rig_file
from facert.io.gltf.writer import write_glb
from facert.io.usd import write_usd
from facert.mesh.morphs import rig_morphs

TRIMESH, USD = "trimesh", "usd-core"
_SHOWN = dict(zip(NAMES, SHAPES, strict=True))
_SINGLE = 2e-7
"""Metres of a vertex in float32."""


def trials() -> list[Trial]:
    """Trials of meshes at rest, of shapes, and of what facert writes."""
    rates = (24.0, 24000 / 1001, 30000 / 1001, 60.0)
    return [
        Trial(TRIMESH, "head.glb", "vertices where the scene places them", _scene, _SINGLE),
        Trial(TRIMESH, "head.obj", "vertices", lambda at: _rest(at, "obj"), 1e-8),
        Trial(TRIMESH, "head.ply", "vertices, binary", lambda at: _rest(at, "ply"), _SINGLE),
        Trial(TRIMESH, "shapes/", "shapes, an OBJ each", lambda at: _folder(at, 1.0), 1e-7),
        Trial(TRIMESH, "shapes/", "shapes, an OBJ each in cm", lambda at: _folder(at, 100.0), 1e-5),
        Trial(TRIMESH, "facert's .glb", "vertices as trimesh has them", _glb_back, _SINGLE),
        *(
            Trial(USD, "facert's .usdc", f"vertices and times at {rate:.3f}/s", _usd_at(rate), 2e-7)
            for rate in rates
        ),
    ]


def _mesh(vertices: FloatArray = VERTICES) -> Any:
    import trimesh

    return trimesh.Trimesh(vertices, FACES, process=False)


def _apart(one: FloatArray, other: FloatArray) -> float:
    """The largest distance of a vertex from the nearest one of the other mesh, both ways."""
    return float(max(cKDTree(a).query(b)[0].max() for a, b in ((one, other), (other, one))))


def _scene(folder: Path) -> float:
    import trimesh

    head, node = np.eye(4), np.eye(4)
    head[:3, :3] = 0.01 * Rotation.from_euler("x", -90, degrees=True).as_matrix()
    node[:3, 3] = 3, 10, -2
    scene = trimesh.Scene()
    scene.graph.update(frame_to="armature", frame_from="world", matrix=head)
    scene.add_geometry(_mesh(100 * VERTICES), "head", "face", "armature", transform=node)
    scene.export(str(folder / "head.glb"))
    expected = scene.to_mesh().vertices
    return _apart(read_mesh(folder / "head.glb").vertices, np.asarray(expected))


def _rest(folder: Path, ending: str) -> float:
    path = folder / f"head.{ending}"
    _mesh().export(str(path))
    return float(np.abs(read_mesh(path).vertices - VERTICES).max())


def _folder(folder: Path, scale: float) -> float:
    shapes = folder / "shapes"
    shapes.mkdir()
    for name, shape in {"neutral": np.zeros_like(VERTICES), **_SHOWN}.items():
        path = str(shapes / f"{name}.obj")
        _mesh(scale * (VERTICES + shape)).export(path, include_normals=True, digits=8)
    scaled = {name: scale * shape for name, shape in _SHOWN.items()}
    return rig_difference(read_rig_file(shapes), scale * VERTICES, scaled)


def _glb_back(folder: Path) -> float:
    import trimesh

    write_glb(rig_morphs(FACE, WEIGHTS, TIME, FPS), folder / "face.glb")
    scene = trimesh.load_scene(str(folder / "face.glb"), process=False)
    return _apart(np.asarray(scene.to_mesh().vertices), VERTICES)


def _usd_at(rate: float) -> Any:
    def difference(folder: Path) -> float:
        path, time = folder / "face.usdc", np.arange(len(WEIGHTS)) / rate
        write_usd(rig_morphs(FACE, WEIGHTS, time, rate), path)
        return max(_usd_moved(path, row, rate) for row in (0, 7, len(WEIGHTS) - 1))

    return difference


def _usd_moved(path: Path, row: int, rate: float) -> float:
    """How far a vertex is off at the time of a row, in metres, as UsdSkel moves it."""
    from pxr import Usd, UsdGeom, UsdSkel, Vt

    stage = Usd.Stage.Open(str(path))
    cache, root = UsdSkel.Cache(), UsdSkel.Root(stage.GetDefaultPrim())
    cache.Populate(root, Usd.PrimDefaultPredicate)
    (binding,) = cache.ComputeSkelBindings(root, Usd.PrimDefaultPredicate)
    (skinned,) = binding.GetSkinningTargets()
    query = UsdSkel.BlendShapeQuery(UsdSkel.BindingAPI(skinned.GetPrim()))
    moment = row / rate * stage.GetTimeCodesPerSecond()
    animation = cache.GetSkelQuery(binding.GetSkeleton()).GetAnimQuery()
    weights = skinned.GetBlendShapeMapper().Remap(animation.ComputeBlendShapeWeights(moment))
    points = Vt.Vec3fArray(UsdGeom.Mesh(skinned.GetPrim()).GetPointsAttr().Get())
    parts = query.ComputeSubShapeWeights(weights)
    places, offsets = query.ComputeBlendShapePointIndices(), query.ComputeSubShapePointOffsets()
    query.ComputeDeformedPoints(*parts, places, offsets, points)
    expected = FACE.deform(WEIGHTS[row : row + 1])[0]
    return float(np.abs(np.array(points) * UsdGeom.GetStageMetersPerUnit(stage) - expected).max())

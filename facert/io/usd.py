"""USD: a mesh with blend shapes and the animation of their weights, as UsdSkel has them.

``.usdc`` is binary, ``.usda`` text, ``.usd`` either. The package usd-core writes them; it is not
among what facert needs, so it may have to be installed.
"""

from __future__ import annotations

import errno
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from facert.data.arrays import single_precision
from facert.data.units import in_metres
from facert.data.version import CREATED_BY, MARK
from facert.errors import FacertError, InputError
from facert.io.atomic import replacing
from facert.io.guarded import read_beginning
from facert.mesh.morphs import Morphs

_ROOT = "/face"
_JOINT = "root"
_MARKS = (
    re.compile(rf'#usda \S+\s*\(\s*"{MARK}'.encode()),
    re.compile(rf"PXR-USDC.*\0{MARK}".encode(), re.DOTALL),
)


def write_usd(morphs: Morphs, path: Path, overwrite: bool = False) -> None:
    """Write a mesh with blend shapes and the animation of their weights.

    Times are counted in frames from 0; a vertex that a shape does not move has no offset.

    Raises `FacertError` when usd-core is not installed, `InputError` when the mesh has no
    triangles, and `OutputExistsError` when `path` exists and `overwrite` is not set.
    """
    Usd, UsdGeom, UsdSkel = _pxr()
    if not len(morphs.neutral.faces):
        raise InputError("/faces", "triangles", "none", "Give a mesh with faces.", str(path))
    with replacing(path, overwrite) as temporary, _errors_of_usd():
        stage = Usd.Stage.CreateNew(str(temporary))
        UsdGeom.SetStageUpAxis(stage, "Y")
        UsdGeom.SetStageMetersPerUnit(stage, in_metres(morphs.neutral.units) or 1.0)
        _set_clock(stage, morphs)
        root = UsdSkel.Root.Define(stage, _ROOT)
        stage.SetDefaultPrim(root.GetPrim())
        tokens = _identifiers(morphs.names)
        mesh = _mesh(stage, morphs)
        _bind(stage, mesh, _animation(stage, morphs, tokens), len(morphs.neutral.vertices))
        _blend_shapes(stage, mesh, morphs, tokens)
        _mark(stage.GetRootLayer())
        stage.GetRootLayer().Save()


@contextmanager
def _errors_of_usd() -> Iterator[None]:
    """The errors of the file system that USD reports in its own way, as OSError."""
    from pxr import Tf

    try:
        yield
    except Tf.ErrorException as error:
        said = str(error).partition("\n")[0].rpartition(" : ")[2].strip("' ")  # after the place
        raise OSError(errno.EIO, f"USD: {said or 'cannot be written'}") from error


def bears_mark(path: Path) -> bool:
    """Whether facert wrote a USD file, by what `_mark` left at its beginning."""
    beginning = read_beginning(path)
    return any(pattern.match(beginning) for pattern in _MARKS)


def _mark(layer: Any) -> None:
    """Name facert in the layer's comment, where a text file begins with it.

    A binary one compresses text, but begins with the first array of bytes as they are.
    """
    from pxr import Vt

    layer.comment = CREATED_BY
    if layer.GetFileFormat().formatId != "usda":
        layer.customLayerData = {"createdBy": Vt.UCharArray(list(CREATED_BY.encode()))}


def _pxr() -> tuple[Any, Any, Any]:
    try:
        from pxr import Usd, UsdGeom, UsdSkel
    except ImportError as error:
        raise FacertError("USD needs the package usd-core: pip install 'facert[usd]'") from error
    return Usd, UsdGeom, UsdSkel


def _set_clock(stage: Any, morphs: Morphs) -> None:
    stage.SetTimeCodesPerSecond(morphs.fps)
    stage.SetFramesPerSecond(morphs.fps)
    stage.SetStartTimeCode(0.0)
    stage.SetEndTimeCode(float(morphs.time[-1] - morphs.time[0]) * morphs.fps)


def _mesh(stage: Any, morphs: Morphs) -> Any:
    from pxr import UsdGeom, Vt

    neutral = morphs.neutral
    mesh = UsdGeom.Mesh.Define(stage, f"{_ROOT}/mesh")
    mesh.CreatePointsAttr(_vectors(neutral.vertices))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(_int32(neutral.faces.ravel())))
    counts = np.full(len(neutral.faces), 3)
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(_int32(counts)))
    mesh.CreateSubdivisionSchemeAttr("none")
    bounds = np.stack([neutral.vertices.min(axis=0), neutral.vertices.max(axis=0)])
    mesh.CreateExtentAttr(_vectors(bounds))
    if neutral.colours is not None:
        colours = mesh.CreateDisplayColorPrimvar("vertex")
        colours.Set(_vectors(neutral.colours**2.2))  # USD's are linear light
    return mesh


def _animation(stage: Any, morphs: Morphs, tokens: list[str]) -> Any:
    """The weights of the shapes in every frame."""
    from pxr import UsdSkel, Vt

    animation = UsdSkel.Animation.Define(stage, f"{_ROOT}/animation")
    animation.CreateBlendShapesAttr(tokens)
    weights = animation.CreateBlendShapeWeightsAttr()
    frames = (morphs.time - morphs.time[0]) * morphs.fps
    for frame, row in zip(
        frames.tolist(), single_precision(morphs.weights, "weights"), strict=True
    ):
        weights.Set(Vt.FloatArray.FromNumpy(row), frame)
    return animation


def _bind(stage: Any, mesh: Any, animation: Any, vertices: int) -> None:
    """A skeleton of one joint at rest: programs look for blend shapes below a skeleton."""
    from pxr import Gf, UsdSkel, Vt

    skeleton = UsdSkel.Skeleton.Define(stage, f"{_ROOT}/skeleton")
    skeleton.CreateJointsAttr([_JOINT])
    skeleton.CreateBindTransformsAttr([Gf.Matrix4d(1.0)])
    skeleton.CreateRestTransformsAttr([Gf.Matrix4d(1.0)])
    holder = UsdSkel.BindingAPI.Apply(skeleton.GetPrim())
    holder.CreateAnimationSourceRel().SetTargets([animation.GetPath()])
    binding = UsdSkel.BindingAPI.Apply(mesh.GetPrim())
    binding.CreateSkeletonRel().SetTargets([skeleton.GetPath()])
    binding.CreateJointIndicesPrimvar(False, 1).Set(Vt.IntArray([0] * vertices))
    binding.CreateJointWeightsPrimvar(False, 1).Set(Vt.FloatArray([1.0] * vertices))


def _blend_shapes(stage: Any, mesh: Any, morphs: Morphs, tokens: list[str]) -> None:
    from pxr import UsdSkel, Vt

    paths = []
    for token, name, target in zip(tokens, morphs.names, morphs.targets, strict=True):
        shape = UsdSkel.BlendShape.Define(stage, mesh.GetPath().AppendChild(token))
        moved = np.flatnonzero((target != 0).any(axis=1))
        moved = moved if len(moved) else np.arange(1)  # programs drop a shape without offsets
        shape.CreateOffsetsAttr(_vectors(target[moved]))
        shape.CreatePointIndicesAttr(Vt.IntArray.FromNumpy(_int32(moved)))
        shape.GetPrim().SetDisplayName(name)
        paths.append(shape.GetPath())
    binding = UsdSkel.BindingAPI(mesh.GetPrim())
    binding.CreateBlendShapesAttr(tokens)
    binding.CreateBlendShapeTargetsRel().SetTargets(paths)


def _identifiers(names: tuple[str, ...]) -> list[str]:
    """Names that USD allows in a path, all different; most names are such already."""
    from pxr import Tf

    found: list[str] = []
    for name in names:
        base = identifier = Tf.MakeValidIdentifier(name)
        while identifier in found:
            identifier = f"{base}_{len(found)}"
        found.append(identifier)
    return found


def _vectors(values: Any) -> Any:
    from pxr import Vt

    return Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(single_precision(values, "vertices")))


def _int32(values: Any) -> Any:
    return np.ascontiguousarray(values, dtype=np.int32)

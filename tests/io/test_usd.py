"""USD files play the same motion, as the library of USD reads them."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from facert.data.rig import Mesh, Rig
from facert.errors import FacertError, InputError, OutputExistsError
from facert.io.usd import write_usd
from facert.mesh.morphs import Morphs, rig_morphs

pytest.importorskip("pxr", reason="needs usd-core: pip install 'facert[usd]'")
from pxr import Gf, Usd, UsdGeom, UsdSkel, Vt

RNG = np.random.default_rng(0)
SHAPES = RNG.normal(size=(3, 20, 3)) * (RNG.random((3, 20, 1)) < 0.5)
FACE = Rig(
    RNG.normal(size=(20, 3)) * 10,
    SHAPES,
    ("jawOpen", "mouth-smile.L", "0brow"),
    RNG.integers(0, 20, (9, 3)),
    "cm",
    RNG.random((20, 3)),
)
WEIGHTS = RNG.random((7, 3))
TIME = 3 + np.arange(7) / 25
MORPHS = rig_morphs(FACE, WEIGHTS, TIME, fps=25.0)


def deformed(path: Path, frame: float) -> np.ndarray:
    """The vertices (V, 3) that UsdSkel computes."""
    stage = Usd.Stage.Open(str(path))
    cache = UsdSkel.Cache()
    root = UsdSkel.Root(stage.GetDefaultPrim())
    cache.Populate(root, Usd.PrimDefaultPredicate)
    (binding,) = cache.ComputeSkelBindings(root, Usd.PrimDefaultPredicate)
    (skinning,) = binding.GetSkinningTargets()
    shapes = UsdSkel.BlendShapeQuery(UsdSkel.BindingAPI(skinning.GetPrim()))
    animation = cache.GetSkelQuery(binding.GetSkeleton()).GetAnimQuery()
    weights = skinning.GetBlendShapeMapper().Remap(animation.ComputeBlendShapeWeights(frame))
    points = Vt.Vec3fArray(UsdGeom.Mesh(skinning.GetPrim()).GetPointsAttr().Get())
    sub_weights, indices, sub_shapes = shapes.ComputeSubShapeWeights(weights)
    assert shapes.ComputeDeformedPoints(
        sub_weights,
        indices,
        sub_shapes,
        shapes.ComputeBlendShapePointIndices(),
        shapes.ComputeSubShapePointOffsets(),
        points,
    )
    return np.array(points)


@pytest.mark.parametrize("ending", [".usda", ".usdc", ".usd"])
def test_every_frame_has_its_vertices(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"face{ending}"
    write_usd(MORPHS, path)
    for frame, params in enumerate(WEIGHTS):
        wanted = FACE.deform(params[None])[0]
        np.testing.assert_allclose(deformed(path, frame), wanted, atol=1e-5)


def test_between_frames_weights_go_linearly(tmp_path: Path) -> None:
    write_usd(MORPHS, tmp_path / "a.usdc")
    wanted = FACE.deform(WEIGHTS[2:4].mean(axis=0, keepdims=True))[0]
    np.testing.assert_allclose(deformed(tmp_path / "a.usdc", 2.5), wanted, atol=1e-5)


def test_unit_axis_and_rate_are_written(tmp_path: Path) -> None:
    write_usd(MORPHS, tmp_path / "a.usda")
    stage = Usd.Stage.Open(str(tmp_path / "a.usda"))
    assert UsdGeom.GetStageMetersPerUnit(stage) == pytest.approx(0.01)
    assert UsdGeom.GetStageUpAxis(stage) == "Y"
    assert stage.GetTimeCodesPerSecond() == 25.0
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (0.0, pytest.approx(6.0))


def test_names_that_usd_does_not_allow_are_kept_as_display_names(tmp_path: Path) -> None:
    names = ("mouth-smile.L", "mouth_smile.L", "0brow")
    write_usd(replace(MORPHS, names=names), tmp_path / "a.usda")
    stage = Usd.Stage.Open(str(tmp_path / "a.usda"))
    mesh = stage.GetPrimAtPath("/face/mesh")
    assert tuple(child.GetDisplayName() for child in mesh.GetChildren()) == names
    tokens = list(UsdSkel.BindingAPI(mesh).GetBlendShapesAttr().Get())
    assert len(set(tokens)) == 3


def test_a_shape_that_moves_nothing_stays_a_shape(tmp_path: Path) -> None:
    still = replace(MORPHS, targets=np.zeros_like(MORPHS.targets))
    write_usd(still, tmp_path / "a.usda")
    np.testing.assert_allclose(deformed(tmp_path / "a.usda", 1), FACE.neutral, atol=1e-5)


def test_the_checker_of_usd_finds_no_fault(tmp_path: Path) -> None:
    UsdValidation = pytest.importorskip("pxr.UsdValidation", reason="usd-core has no checker yet")
    write_usd(MORPHS, tmp_path / "a.usda")
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    assert len(validators) > 10
    faults = UsdValidation.ValidationContext(validators).Validate(
        Usd.Stage.Open(str(tmp_path / "a.usda"))
    )
    assert [fault.GetMessage() for fault in faults] == []


def test_the_skeleton_moves_nothing(tmp_path: Path) -> None:
    write_usd(MORPHS, tmp_path / "a.usda")
    stage = Usd.Stage.Open(str(tmp_path / "a.usda"))
    skeleton = UsdSkel.Skeleton(stage.GetPrimAtPath("/face/skeleton"))
    assert list(skeleton.GetRestTransformsAttr().Get()) == [Gf.Matrix4d(1.0)]


def test_an_existing_file_is_kept_and_a_mesh_needs_triangles(tmp_path: Path) -> None:
    write_usd(MORPHS, tmp_path / "a.usda")
    with pytest.raises(OutputExistsError):
        write_usd(MORPHS, tmp_path / "a.usda")
    points = Morphs(Mesh(FACE.neutral, np.empty((0, 3), int)), SHAPES, FACE.names, WEIGHTS, TIME)
    with pytest.raises(InputError, match="/faces"):
        write_usd(points, tmp_path / "b.usda")
    assert [path.name for path in tmp_path.iterdir()] == ["a.usda"]


def test_without_usd_core_the_error_names_what_to_install(tmp_path, monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "pxr", None)
    with pytest.raises(FacertError, match=r"pip install 'facert\[usd\]'"):
        write_usd(MORPHS, tmp_path / "a.usda")
    assert not list(tmp_path.iterdir())

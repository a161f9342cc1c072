"""glTF files that are built by hand with pygltflib, as exporters lay them out."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from experiments.foreign.face import (
    FACES,
    NAMES,
    SHAPES,
    TIME,
    VERTICES,
    WEIGHTS,
    rig_difference,
    weights_difference,
)
from experiments.foreign.trial import Trial
from facert.data.arrays import FloatArray
from facert.io.formats import read_rig_file, read_take_file

PROGRAM = "pygltflib"
_SHOWN = dict(zip(NAMES, SHAPES, strict=True))
_CODES = {"f4": 5126, "u4": 5125, "u2": 5123, "i2": 5122, "u1": 5121, "i1": 5120}
_TYPES = {(): "SCALAR", (3,): "VEC3", (4,): "VEC4", (4, 4): "MAT4"}
_SINGLE = 5e-7
"""Metres of a vertex in float32, a hundred times as large in its own space."""


def trials() -> list[Trial]:
    """Trials of rigs, and of their animations."""

    def trial(compared: str, make: Callable[[Path], float], tolerance: float = _SINGLE) -> Trial:
        return Trial(PROGRAM, "head.glb", compared, make, tolerance)

    return [
        trial("vertices, plain", _plain),
        trial("vertices, placed by parents", _placed),
        trial("vertices, skin of an armature at scale 0.01, turned", _skinned),
        trial("vertices, skin of two joints out of their bind pose", _bent),
        trial("vertices, weights of joints in bytes", _byte_weights),
        trial("vertices, 16 bits normalised", _quantised, 1e-5),
        trial("vertices, sparse targets", _sparse),
        trial("names in the primitive's extras", _primitive_names),
        trial("names of accessors", _accessor_names),
        trial("nameless targets of two meshes", _nameless),
        trial("names that two meshes share", _shared_names),
        Trial(PROGRAM, "head.vrm", "vertices", _vrm, _SINGLE),
        trial("weights in bytes, normalised", _byte_keys, 0.5 / 255 + 1e-6),
        trial("weights at 23.976 frames/s", _film, 1e-5),
        trial("weights, animation of a node with a skin", _skinned_keys, 1e-6),
    ]


class Builder:
    """A document in the making."""

    def __init__(self) -> None:
        import pygltflib as gltf

        self.gltf = gltf
        self.document = gltf.GLTF2(scene=0, scenes=[gltf.Scene(nodes=[])])
        self.content = b""

    def view(self, array: NDArray[Any]) -> int:
        """Append bytes; return the number of their view."""
        content = array.tobytes()
        place = self.gltf.BufferView(
            buffer=0, byteOffset=len(self.content), byteLength=len(content)
        )
        self.document.bufferViews.append(place)
        self.content += content + b"\0" * (-len(content) % 4)
        return len(self.document.bufferViews) - 1

    def accessor(self, array: NDArray[Any], **others: Any) -> int:
        """Append an array; return the number of its accessor."""
        given = {"bufferView": self.view(array)} if "sparse" not in others else {}
        one = self.gltf.Accessor(
            componentType=_CODES[array.dtype.str[1:]],
            count=len(array),
            type=_TYPES[array.shape[1:]],
            **given,
            **others,
        )
        self.document.accessors.append(one)
        return len(self.document.accessors) - 1

    def single(self, array: FloatArray, **others: Any) -> int:
        """Append an array as float32."""
        return self.accessor(array.astype("<f4"), **others)

    def mesh(
        self,
        vertices: FloatArray,
        shapes: FloatArray,
        extras: Mapping[str, Any],
        attributes: Mapping[str, int] | None = None,
        primitive: Mapping[str, Any] | None = None,
    ) -> int:
        """Append a mesh with the triangles of the face; return its number."""
        targets = [{"POSITION": self.single(shape)} for shape in shapes]
        one = self.gltf.Primitive(
            attributes=self.gltf.Attributes(**{"POSITION": self.single(vertices)}),
            indices=self.accessor(FACES.astype("<u2").ravel()),
            targets=targets,
        )
        for name, accessor in (attributes or {}).items():
            setattr(one.attributes, name, accessor)
        for name, value in (primitive or {}).items():
            setattr(one, name, value)
        self.document.meshes.append(self.gltf.Mesh(primitives=[one], extras=dict(extras)))
        return len(self.document.meshes) - 1

    def node(self, parent: int | None = None, **facts: Any) -> int:
        """Append a node below another one, or to the scene; return its number."""
        self.document.nodes.append(self.gltf.Node(**facts))
        number = len(self.document.nodes) - 1
        above = self.document.scenes[0].nodes if parent is None else self._children(parent)
        above.append(number)
        return number

    def _children(self, parent: int) -> list[int]:
        children: list[int] = self.document.nodes[parent].children
        return children

    def skin(self, joints: Sequence[int], inverse_bind: FloatArray) -> int:
        """Append a skin; matrices are stored by columns."""
        matrices = self.single(inverse_bind.transpose(0, 2, 1))
        self.document.skins.append(
            self.gltf.Skin(joints=list(joints), inverseBindMatrices=matrices)
        )
        return len(self.document.skins) - 1

    def animate(self, node: int, time: FloatArray, output: int) -> None:
        """Append an animation of a node's weights."""
        sampler = self.gltf.AnimationSampler(input=self.single(time), output=output)
        target = self.gltf.AnimationChannelTarget(node=node, path="weights")
        channel = self.gltf.AnimationChannel(sampler=0, target=target)
        animation = self.gltf.Animation(samplers=[sampler], channels=[channel])
        self.document.animations.append(animation)

    def save(self, path: Path) -> Path:
        """Write the file."""
        self.document.buffers = [self.gltf.Buffer(byteLength=len(self.content))]
        self.document.set_binary_blob(self.content)
        self.document.save_binary(str(path))
        return path


_NAMED = {"targetNames": list(NAMES)}
_TURN = Rotation.from_euler("x", -90, degrees=True)
_ARMATURE = {"rotation": _TURN.as_quat().tolist(), "scale": [0.01] * 3}


def _difference(builder: Builder, folder: Path, name: str = "head.glb") -> float:
    return rig_difference(read_rig_file(builder.save(folder / name)), VERTICES, _SHOWN)


def _plain(folder: Path) -> float:
    builder = Builder()
    builder.node(mesh=builder.mesh(VERTICES, SHAPES, _NAMED))
    return _difference(builder, folder)


def _placed(folder: Path) -> float:
    builder = Builder()
    armature = builder.node(**_ARMATURE)
    own = 100 * _TURN.inv().apply(VERTICES - [0, 0, 1])
    shapes = 100 * _TURN.inv().apply(SHAPES.reshape(-1, 3)).reshape(SHAPES.shape)
    offset = 100 * _TURN.inv().apply([0, 0, 1])
    mesh = builder.mesh(own, shapes, _NAMED)
    builder.node(armature, mesh=mesh, translation=offset.tolist())
    return _difference(builder, folder)


def _matrix(turn: Rotation, scale: float, place: Sequence[float] = (0, 0, 0)) -> FloatArray:
    matrix = np.eye(4)
    matrix[:3, :3] = scale * turn.as_matrix()
    matrix[:3, 3] = place
    return matrix


def skinned_builder(binding: str = "<f4") -> tuple[Builder, int]:
    """A head under an armature of centimetres that lies on its back, as from FBX, and its node."""
    builder = Builder()
    armature = builder.node(**_ARMATURE, name="Armature")
    joint = builder.node(armature, name="head", translation=[0, 0, 150.0])
    world = _matrix(_TURN, 0.01) @ _matrix(Rotation.identity(), 1, (0, 0, 150))
    own = 100 * _TURN.inv().apply(VERTICES)
    shapes = 100 * _TURN.inv().apply(SHAPES.reshape(-1, 3)).reshape(SHAPES.shape)
    bind = np.linalg.inv(world) @ _matrix(_TURN, 0.01)
    joints = builder.accessor(np.zeros((len(own), 4), dtype="<u1"))
    one = np.tile(np.float64([1, 0, 0, 0]), (len(own), 1))
    weights = builder.accessor((one * 255).astype("<u1"), normalized=True)
    if binding == "<f4":
        weights = builder.single(one)
    skin = builder.skin([joint], bind[None])
    mesh = builder.mesh(own, shapes, _NAMED, {"JOINTS_0": joints, "WEIGHTS_0": weights})
    node = builder.node(armature, mesh=mesh, skin=skin, translation=[9.0, 8.0, 7.0])
    return builder, node


def _skinned(folder: Path) -> float:
    return _difference(skinned_builder()[0], folder)


def _byte_weights(folder: Path) -> float:
    return _difference(skinned_builder("<u1")[0], folder)


def _bent(folder: Path) -> float:
    """Two joints share every vertex; the mesh was bound half a metre below where they stand."""
    builder = Builder()
    root = builder.node(name="root", translation=[0, 0.5, 0])
    jaw = builder.node(
        root, name="jaw", rotation=Rotation.from_euler("y", 180, degrees=True).as_quat().tolist()
    )
    share = np.linspace(0, 1, len(VERTICES))
    weights = np.zeros((len(VERTICES), 4))
    weights[:, 0], weights[:, 1] = share, 1 - share
    joints = np.tile(np.uint16([0, 1, 0, 0]), (len(VERTICES), 1))
    bind = np.stack([np.eye(4), _matrix(Rotation.from_euler("y", 180, degrees=True).inv(), 1)])
    attributes = {"JOINTS_0": builder.accessor(joints), "WEIGHTS_0": builder.single(weights)}
    mesh = builder.mesh(VERTICES - [0, 0.5, 0], SHAPES, _NAMED, attributes)
    builder.node(mesh=mesh, skin=builder.skin([root, jaw], bind), scale=[7.0] * 3)
    return _difference(builder, folder)


def _quantised(folder: Path) -> float:
    """16 bits between -1 and 1, which the node makes metres: as gltf-transform lays it out."""
    builder = Builder()
    centre, size = VERTICES.mean(axis=0), np.abs(VERTICES - VERTICES.mean(axis=0)).max()
    whole = np.rint((VERTICES - centre) / size * 32767).astype("<i2")
    moved = np.rint(SHAPES / size * 32767).astype("<i2")
    mesh = builder.mesh(VERTICES, SHAPES[:0], _NAMED)
    primitive = builder.document.meshes[mesh].primitives[0]
    primitive.attributes.POSITION = _padded(builder, whole)
    primitive.targets = [{"POSITION": _padded(builder, one)} for one in moved]
    builder.document.extensionsUsed = ["KHR_mesh_quantization"]
    builder.document.extensionsRequired = ["KHR_mesh_quantization"]
    builder.node(mesh=mesh, translation=centre.tolist(), scale=[float(size)] * 3)
    return _difference(builder, folder)


def _padded(builder: Builder, array: NDArray[np.int16]) -> int:
    """An accessor of three numbers in eight bytes."""
    padded = np.zeros((len(array), 4), dtype="<i2")
    padded[:, :3] = array
    accessor = builder.accessor(array, normalized=True)
    builder.document.accessors[accessor].bufferView = builder.view(padded)
    builder.document.bufferViews[-1].byteStride = 8
    return accessor


def _sparse(folder: Path) -> float:
    builder = Builder()
    mesh = builder.mesh(VERTICES, SHAPES[:0], _NAMED)
    targets = [{"POSITION": _few(builder, shape)} for shape in SHAPES]
    builder.document.meshes[mesh].primitives[0].targets = targets
    builder.node(mesh=mesh)
    return _difference(builder, folder)


def _few(builder: Builder, shape: FloatArray) -> int:
    """A sparse accessor, zero but for the vertices that move."""
    rows = np.flatnonzero(np.abs(shape).max(axis=1))
    gltf, values = builder.gltf, shape[rows].astype("<f4")
    sparse = gltf.Sparse(
        count=len(rows),
        indices=gltf.AccessorSparseIndices(
            bufferView=builder.view(rows.astype("<u2")), componentType=_CODES["u2"]
        ),
        values=gltf.AccessorSparseValues(bufferView=builder.view(values)),
    )
    return builder.single(shape, sparse=sparse)


def _primitive_names(folder: Path) -> float:
    builder = Builder()
    primitive = {"extras": _NAMED}
    builder.node(mesh=builder.mesh(VERTICES, SHAPES, {}, primitive=primitive))
    return _difference(builder, folder)


def _accessor_names(folder: Path) -> float:
    builder = Builder()
    mesh = builder.mesh(VERTICES, SHAPES, {})
    for target, name in zip(
        builder.document.meshes[mesh].primitives[0].targets, NAMES, strict=True
    ):
        builder.document.accessors[target["POSITION"]].name = name
    builder.node(mesh=mesh)
    return _difference(builder, folder)


def _nameless(folder: Path) -> float:
    """Of two meshes with two targets each, four shapes come out, each of one mesh."""
    builder, away = Builder(), np.array([0.5, 0, 0])
    for offset, shapes in ((0 * away, SHAPES[:2]), (away, SHAPES[2:])):
        builder.node(mesh=builder.mesh(VERTICES + offset, shapes, {}))
    rig = read_rig_file(builder.save(folder / "head.glb"))
    moved = np.abs(rig.shapes).max(axis=2) > 0
    right = rig.neutral[:, 0] > 0.25
    both = [
        name
        for name, one in zip(rig.names, moved, strict=True)
        if right[one].any() and (~right)[one].any()
    ]
    if both or len(rig.names) != len(SHAPES):
        raise ValueError(f"shapes {', '.join(rig.names)}, merged: {', '.join(both) or 'none'}")
    sizes = np.sort(np.abs(rig.shapes).max(axis=(1, 2)))
    return float(np.abs(sizes - np.sort(np.abs(SHAPES).max(axis=(1, 2)))).max())


def _shared_names(folder: Path) -> float:
    builder, away = Builder(), np.array([0.5, 0, 0])
    for offset in (0 * away, away):
        builder.node(mesh=builder.mesh(VERTICES + offset, SHAPES, _NAMED))
    vertices = np.concatenate([VERTICES, VERTICES + away])
    shapes = {name: np.concatenate([shape, shape]) for name, shape in _SHOWN.items()}
    return rig_difference(read_rig_file(builder.save(folder / "head.glb")), vertices, shapes)


def _vrm(folder: Path) -> float:
    builder = Builder()
    node = builder.node(mesh=builder.mesh(VERTICES, SHAPES, _NAMED))
    bind = {"node": node, "index": 1, "weight": 1.0}
    happy = {"morphTargetBinds": [bind, bind | {"index": 2}]}
    facts = {"specVersion": "1.0", "expressions": {"preset": {"happy": happy}}}
    builder.document.extensionsUsed = ["VRMC_vrm"]
    builder.document.extensions = {"VRMC_vrm": facts}
    path = builder.save(folder / "head.vrm")
    rig = read_rig_file(path)
    own = [name for name in rig.names if name in NAMES]  # expressions may stand beside them
    if own != list(NAMES):
        raise ValueError(f"shapes {', '.join(rig.names)}")
    return float(
        np.abs(rig.shapes[[rig.names.index(n) for n in NAMES]]).max() - np.abs(SHAPES).max()
    )


def _byte_keys(folder: Path) -> float:
    builder = Builder()
    node = builder.node(mesh=builder.mesh(VERTICES, SHAPES, _NAMED))
    keys = np.rint(WEIGHTS * 255).astype("<u1").ravel()
    builder.animate(node, TIME, builder.accessor(keys, normalized=True))
    return weights_difference(read_take_file(builder.save(folder / "head.glb")), TIME, WEIGHTS)


def _film(folder: Path) -> float:
    builder, time = Builder(), np.arange(len(WEIGHTS)) * 1001 / 24000
    node = builder.node(mesh=builder.mesh(VERTICES, SHAPES, _NAMED))
    builder.animate(node, time, builder.single(WEIGHTS.ravel()))
    take = read_take_file(builder.save(folder / "head.glb"))
    return max(weights_difference(take, time, WEIGHTS), abs(take.fps * 1001 / 24000 - 1))


def _skinned_keys(folder: Path) -> float:
    builder, node = skinned_builder()
    builder.animate(node, TIME, builder.single(WEIGHTS.ravel()))
    return weights_difference(read_take_file(builder.save(folder / "head.glb")), TIME, WEIGHTS)

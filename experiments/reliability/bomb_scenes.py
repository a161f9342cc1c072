"""Hostile glTF scenes; see `bomb_registry`."""

from __future__ import annotations

import base64
import json
import struct
import zlib
from typing import Any

import numpy as np

from experiments.reliability.bomb_registry import RIG, each

GLTF = (*RIG, "convert FILE DIR/out.csv")


class Scene:
    """A glTF document in the making: a face of three vertices with one target, and its bytes."""

    def __init__(self, **root: Any) -> None:
        self.content = b""
        self.root: dict[str, Any] = {"asset": {"version": "2.0"}, "bufferViews": [],
                                     "accessors": []}  # fmt: skip
        face = self.array(np.float32([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0]]))
        moved = self.array(np.float32([[0, 0, 0.01]] * 3))
        primitive = {"attributes": {"POSITION": face}, "targets": [{"POSITION": moved}]}
        self.root |= {
            "meshes": [{"primitives": [primitive], "extras": {"targetNames": ["jawOpen"]}}],
            "nodes": [{"mesh": 0}],
            "scenes": [{"nodes": [0]}],
        }
        self.root |= root

    @property
    def primitive(self) -> dict[str, Any]:
        """That of the face."""
        found: dict[str, Any] = self.root["meshes"][0]["primitives"][0]
        return found

    def accessor(self, **described: Any) -> int:
        """Add an accessor as it is."""
        self.root["accessors"].append(described)
        return len(self.root["accessors"]) - 1

    def array(self, values: np.ndarray, **changed: Any) -> int:
        """Add numbers and their accessor."""
        codes = {"f4": 5126, "u4": 5125, "u2": 5123, "u1": 5121}
        kinds = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}
        view = {"buffer": 0, "byteOffset": len(self.content), "byteLength": values.nbytes}
        self.root["bufferViews"].append(view)
        self.content += values.tobytes() + b"\0" * (-values.nbytes % 4)
        plain = {
            "bufferView": len(self.root["bufferViews"]) - 1,
            "componentType": codes[values.dtype.str[1:]],
            "count": len(values),
            "type": kinds[1 if values.ndim == 1 else values.shape[1]],
        }
        return self.accessor(**(plain | changed))

    def animated(self, time: np.ndarray, weights: np.ndarray, **sampler: Any) -> Scene:
        """Add an animation of the weight."""
        given = {"input": self.array(np.float32(time)), "output": self.array(np.float32(weights))}
        channel = {"sampler": 0, "target": {"node": 0, "path": "weights"}}
        self.root["animations"] = [{"samplers": [given | sampler], "channels": [channel]}]
        return self

    def glb(self) -> bytes:
        """The file."""
        root = {"buffers": [{"byteLength": len(self.content)}]} | self.root
        text = json.dumps(root).encode()
        text += b" " * (-len(text) % 4)
        body = struct.pack("<II", len(text), 0x4E4F534A) + text
        body += struct.pack("<II", len(self.content), 0x004E4942) + self.content
        return struct.pack("<III", 0x46546C67, 2, 12 + len(body)) + body


def scene_with(change: Any) -> Any:
    """A function that makes a scene, changes it, and gives its file."""

    def make() -> bytes:
        scene = Scene()
        changed = change(scene)
        return (changed or scene).glb()

    return make


def one_accessor_as_targets(scene: Scene, vertices: int, targets: int) -> None:
    values = np.zeros((vertices, 3), np.float32)
    values[:, 0] = np.arange(vertices) / vertices
    place = scene.array(values)
    scene.primitive["attributes"]["POSITION"] = place
    scene.primitive["targets"] = [{"POSITION": place}] * targets
    scene.root["meshes"][0]["extras"]["targetNames"] = [f"t{i}" for i in range(targets)]


def sparse(scene: Scene, count: int) -> None:
    place = scene.accessor(componentType=5126, count=count, type="VEC3")
    scene.primitive["attributes"]["POSITION"] = place
    scene.primitive["targets"] = [{"POSITION": place}]


def many_nodes(scene: Scene, count: int, deep: bool, **node: Any) -> None:
    nodes = [{"children": [i + 1]} if deep and i + 1 < count else {} for i in range(count)]
    nodes = [one | node for one in nodes]
    nodes[-1] |= {"mesh": 0}
    scene.root["nodes"] = nodes
    scene.root["scenes"] = [{"nodes": [0] if deep else list(range(count))}]


def many_channels(scene: Scene, count: int) -> Scene:
    scene.animated(np.arange(5) / 25, np.arange(5) / 5)
    channels = scene.root["animations"][0]["channels"]
    scene.root["animations"][0]["channels"] = channels * count
    return scene


def many_meshes(scene: Scene, count: int, names: bool) -> None:
    mesh = scene.root["meshes"][0]
    named = [mesh | {"extras": {"targetNames": [f"t{i}"]}} for i in range(count)]
    scene.root["meshes"] = named if names else [mesh] * count
    scene.root["nodes"] = [{"mesh": i} for i in range(count)]
    scene.root["scenes"] = [{"nodes": list(range(count))}]


def skinned(scene: Scene, joints: int, nodes: int) -> None:
    bound = scene.array(np.uint8([[0, 0, 0, 0]] * 3))
    weights = scene.array(np.float32([[1, 0, 0, 0]] * 3))
    scene.primitive["attributes"] |= {"JOINTS_0": bound, "WEIGHTS_0": weights}
    scene.root["skins"] = [{"joints": [0] * joints}]
    scene.root["nodes"] = [{"mesh": 0, "skin": 0} for _ in range(nodes)]
    scene.root["scenes"] = [{"nodes": list(range(nodes))}]


def meshopt(scene: Scene, count: int, mode: str) -> None:
    packed = {"buffer": 0, "byteOffset": 0, "byteLength": 60, "byteStride": 4, "count": count,
              "mode": mode}  # fmt: skip
    view = {"buffer": 0, "byteLength": 4 * count, "extensions": {"EXT_meshopt_compression": packed}}
    scene.root["bufferViews"].append(view)
    place = scene.accessor(bufferView=2, componentType=5126, count=count // 3, type="VEC3")
    scene.primitive["attributes"]["POSITION"] = place


def png(width: int, height: int) -> bytes:
    """A picture of so many pixels in a few bytes."""

    def chunk(kind: bytes, content: bytes) -> bytes:
        return (
            struct.pack(">I", len(content))
            + kind
            + content
            + struct.pack(">I", zlib.crc32(kind + content))
        )

    head = struct.pack(">IIBBBBB", width, height, 1, 0, 0, 0, 0)
    rows = zlib.compress(bytes((1 + (width + 7) // 8) * min(height, 5000)), 9)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", rows) + chunk(b"IEND", b"")


def textured(scene: Scene, width: int, height: int) -> None:
    uv = scene.array(np.float32([[0, 0], [1, 0], [0, 1]]))
    body = {"attributes": {"POSITION": 0, "TEXCOORD_0": uv}, "material": 0}
    scene.root["meshes"].append({"primitives": [body]})
    scene.root["nodes"].append({"mesh": 1})
    scene.root["scenes"][0]["nodes"].append(1)
    uri = "data:image/png;base64," + base64.b64encode(png(width, height)).decode()
    scene.root |= {"images": [{"uri": uri}], "textures": [{"source": 0}]}
    texture = {"baseColorTexture": {"index": 0}}
    scene.root["materials"] = [{"pbrMetallicRoughness": texture}] * 1


def repeated_buffers(scene: Scene, count: int) -> None:
    uri = "data:a;base64," + base64.b64encode(bytes(30_000)).decode()
    scene.root["buffers"] = [{"byteLength": len(scene.content)}] + [
        {"byteLength": 30_000, "uri": uri}
    ] * count


def values(name: str, change: Any) -> None:
    """Register scenes in which one number is absurd."""
    numbers = {"inf": np.inf, "nan": np.nan, "1e38": 3e38, "denormal": 1e-45}
    each(name, ".glb", {case: scene_with(lambda s, v=v: change(s, v)) for case, v in
                        numbers.items()}, GLTF)  # fmt: skip


def position(scene: Scene, value: float) -> None:
    values = np.float32([[0, 0, 0], [value, 0, 0], [0, 0.1, 0]])
    scene.primitive["attributes"]["POSITION"] = scene.array(values)


def target(scene: Scene, value: float) -> None:
    scene.primitive["targets"] = [{"POSITION": scene.array(np.float32([[value, 0, 0]] * 3))}]


def matrix(scene: Scene, value: float) -> None:
    scene.root["nodes"][0]["matrix"] = [value, *np.eye(4).ravel()[1:].tolist()]


def bind(scene: Scene, value: float) -> None:
    skinned(scene, 1, 1)
    inverse = np.eye(4, dtype=np.float32).reshape(1, 16)
    inverse[0, 0] = value
    scene.root["skins"][0]["inverseBindMatrices"] = scene.array(inverse)


values("glb position", position)
values("glb target", target)
values("glb matrix", matrix)
values("glb inverse bind", bind)
values("glb weight", lambda s, v: s.animated(np.arange(9) / 25, np.r_[np.arange(8), v]))
values("glb time", lambda s, v: s.animated(np.r_[np.arange(8) / 25, v], np.arange(9)))
values("glb only time", lambda s, v: s.animated(np.array([0.0, v]), np.arange(2)))
values("glb shown weight", lambda s, v: s.root["nodes"][0].update(weights=[v]))
each("glb take", ".glb", {
    "two keys a year apart": scene_with(
        lambda s: s.animated(np.array([0, 0.01, 3e7]), np.arange(3))
    ),
    "a million channels": scene_with(lambda s: many_channels(s, 1_000_000)),
    "20,000 channels": scene_with(lambda s: many_channels(s, 20_000)),
    "40,000 meshes of a name each": scene_with(
        lambda s: (many_meshes(s, 40_000, True), s.animated(np.arange(5) / 25, np.arange(5)))[1]
    ),
}, ("convert FILE DIR/out.csv", "inspect FILE", "convert FILE DIR/out.glb --rig FILE"))  # fmt: skip
each("glb", ".glb", {
    "one accessor as 1,000 targets": scene_with(lambda s: one_accessor_as_targets(s, 10_000, 1000)),
    "one accessor as 100,000 targets": scene_with(
        lambda s: one_accessor_as_targets(s, 3, 100_000)
    ),
    "a sparse accessor of 1 GiB": scene_with(lambda s: sparse(s, 2**25)),
    "a sparse accessor of 100 MB": scene_with(lambda s: sparse(s, 8_000_000)),
    "100,000 nodes": scene_with(lambda s: many_nodes(s, 100_000, False)),
    "100,000 nodes, turned": scene_with(
        lambda s: many_nodes(s, 100_000, False, rotation=[0, 0, 0, 1])
    ),
    "a chain of 100,000 nodes": scene_with(lambda s: many_nodes(s, 100_000, True)),
    "a chain of scales": scene_with(lambda s: many_nodes(s, 2_000, True, scale=[10, 10, 10])),
    "10,000 meshes": scene_with(lambda s: many_meshes(s, 10_000, False)),
    "10,000 meshes of a name each": scene_with(lambda s: many_meshes(s, 10_000, True)),
    "100,000 joints for 1,000 meshes": scene_with(lambda s: skinned(s, 100_000, 1000)),
    "children a million times": scene_with(
        lambda s: s.root["nodes"].append({"children": [0] * 1_000_000})
    ),
    "meshopt of 4 GB": scene_with(lambda s: meshopt(s, 2**30, "ATTRIBUTES")),
    "meshopt of 60 kB": scene_with(lambda s: meshopt(s, 15_000, "ATTRIBUTES")),
    "a texture of 4 gigapixels": scene_with(lambda s: textured(s, 65_000, 65_000)),
    "a texture of 30 megapixels": scene_with(lambda s: textured(s, 6_000, 5_000)),
    "1,000 buffers": scene_with(lambda s: repeated_buffers(s, 1000)),
    "JSON 10^5 deep": lambda: struct.pack("<IIIII", 0x46546C67, 2, 200_020, 200_000, 0x4E4F534A)
    + b"[" * 200_000,
}, RIG)  # fmt: skip

"""Hostile files of meshes, scenes, captures and settings; see `bomb_files`."""

from __future__ import annotations

import base64
import json
import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np

from experiments.reliability.bomb_files import BOMBS, RIG, TAKE, Bomb, each, honest, markers

GLTF = (*RIG, "convert FILE DIR/out.csv")
MESH = ("drive DIR/points.csv DIR/out.h5 --mesh FILE",)


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

# ---- captures and other meshes


def trc(value: object = 1.0, rate: object = 25, time: object = None, count: int = 3) -> str:
    """Markers of 30 frames."""
    rows = [[f + 1, f / 25, *[f % 5 + 0.1] * (3 * count)] for f in range(30)]
    rows[20][3] = value
    rows[29][1] = rows[29][1] if time is None else time
    names = "\t\t\t".join(f"m{i}" for i in range(count))
    head = ["PathFileType\t4\t(X/Y/Z)\tx.trc", "DataRate\tNumMarkers\tNumFrames\tUnits",
            f"{rate}\t{count}\t99999999999\tmm", f"Frame#\tTime\t{names}", ""]  # fmt: skip
    return "\n".join([*head, *("\t".join(map(str, row)) for row in rows)])


each("trc", ".trc", {
    "value 1e300": trc("1e300"), "value inf": trc("inf"), "rate 1e300": trc(rate="1e300"),
    "rate 1e-300": trc(rate="1e-300"), "rate 0": trc(rate=0), "rate nan": trc(rate="nan"),
    "time 1e300": trc(time="1e300"), "time nan": trc(time="nan"),
}, TAKE)  # fmt: skip
each(
    "trc",
    ".trc",
    {
        "20,000 markers": lambda: trc(count=20_000),
        "20 MB of tabs": lambda: trc() + "\t" * 20_000_000,
    },
)


def c3d(points: int = 4, last: int = 10, rate: float = 25.0, scale: float = -1.0,
        value: float = 1.0) -> bytes:  # fmt: skip
    """A C3D file without parameters but what its header says."""
    head = bytearray(512)
    struct.pack_into("<BBHHHHHfHHf", head, 0, 2, 0x50, points, 0, 1, last, 0, scale, 3, 0, rate)
    parameters = bytearray(512)
    parameters[:4] = bytes([0, 0, 1, 84])
    frame = np.zeros((points, 4), "<f4")
    frame[:, :3] = np.arange(3 * points).reshape(-1, 3)
    frame[0, 0] = value
    return bytes(head) + bytes(parameters) + frame.tobytes() * min(last, 10)


each("c3d", ".c3d", {
    "plain": c3d(), "65,000 frames": c3d(last=65_000), "65,000 points": lambda: c3d(65_000, 4),
    "rate 1e30": c3d(rate=1e30), "rate 0": c3d(rate=0), "value 1e38": c3d(value=3e38),
})  # fmt: skip


def face_cap(count: int = 3, clock: object = 1000, value: object = 0.5) -> str:
    """A Face Cap recording of 30 frames."""
    names = ",".join(f"s{i}" for i in range(count))
    rows = [["k", f * 40, *[0] * 10, *[f % 5 / 5] * count] for f in range(30)]
    rows[29][1], rows[20][12] = clock, value
    return f"info,x\nbs,{names}\n" + "\n".join(",".join(map(str, row)) for row in rows)


each("face cap", ".txt", {
    "100,000 shapes": lambda: face_cap(100_000), "clock 1e300": face_cap(clock="1e300"),
    "clock nan": face_cap(clock="nan"), "value 1e300": face_cap(value="1e300"),
}, ("inspect FILE", "convert FILE DIR/out.h5", "suggest FILE -n 3"))  # fmt: skip


def live_link(code: str = "{0:02}:00:{1:02}:{2:02}.{2:03}", value: object = 0.5) -> str:
    """A recording of Live Link Face with timecodes of a pattern."""
    rows = [f"{code.format(1, f // 30, f % 30)},2,{value},{f % 7 / 7}" for f in range(60)]
    return "\n".join(["Timecode,BlendShapeCount,EyeBlinkLeft,JawOpen", *rows])


each("live link", ".csv", {
    "garbage": live_link("{0}{1}{2}"), "hours of 10^20": live_link("9" * 20 + ":00:{1:02}:{2:02}"),
    "frames of 10^20": live_link("01:00:{1:02}:" + "9" * 20), "nan": live_link("nan:nan:nan:nan"),
    "negative": live_link("-1:-1:-1:-1"),
    "subframes 10^300": live_link("01:00:{1:02}:{2:02}." + "9" * 300),
    "value 1e300": live_link(value="1e300"),
}, ("inspect FILE", "convert FILE DIR/out.h5", "suggest FILE -n 3"))  # fmt: skip


def with_points(content: Any, ending: str) -> Any:
    """A mesh beside a capture that drives it."""

    def make(folder: Path) -> Path:
        (folder / "points.csv").write_text(markers(6, 10))
        made = content() if callable(content) else content
        path = folder / f"bomb{ending}"
        path.write_bytes(made if isinstance(made, bytes) else made.encode())
        return path

    return make


def ply(vertices: int, body: bytes = b"", faces: int = 0, kind: str = "float",
        form: str = "binary_little_endian") -> bytes:  # fmt: skip
    """A header, and what comes after it."""
    return (
        f"ply\nformat {form} 1.0\nelement vertex {vertices}\nproperty {kind} x\n"
        f"property {kind} y\nproperty {kind} z\nelement face {faces}\n"
        "property list uchar int vertex_indices\nend_header\n"
    ).encode() + body


SPHERE = np.random.default_rng(0).normal(size=(50, 3)).astype("<f4")
MESHES: dict[str, tuple[str, Any]] = {
    "ply of 10^18 vertices": (".ply", ply(10**18)),
    "ply of 10^9 faces": (".ply", ply(50, SPHERE.tobytes(), 10**9)),
    "ply of ragged faces": (".ply", lambda: ply(
        50, SPHERE.tobytes() + (b"\x03" + bytes(12) + b"\x04" + bytes(16)) * 500_000, 1_000_000)),
    "ply with no properties": (".ply", b"ply\nformat ascii 1.0\nelement vertex 999999999\n"
                               b"element a 9999999999\nend_header\n"),
    "ply of 1e300": (".ply", ply(50, (SPHERE.astype("<f8") * 1e300).tobytes(), kind="double")),
    "ply of nan": (".ply", ply(50, (SPHERE * np.nan).tobytes())),
    "ply text of 20 MB": (".ply", lambda: ply(10**6, b"0 " * 10_000_000, form="ascii")),
    "obj of one face of 10^6 corners": (".obj", lambda: "v 0 0 0\nv 1 0 0\nv 0 1 0\nf " +
                                        "1 2 3 " * 400_000),
    "obj of 1e300": (".obj", "v 1e300 0 0\nv 0 1e300 0\nv 0 0 1e300\nf 1 2 3\n"),
    "obj of inf": (".obj", "v inf 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\n"),
    "obj in one point": (".obj", "v 0 0 0\n" * 30 + "f 1 2 3\n"),
    "obj of a face of 10^5 digits": (".obj", "v 0 0 0\nf 1 2 " + "9" * 100_000),
    "obj of a million vertices": (".obj", lambda: "v 0 0 0\nv 1 2 3\n" * 500_000),
    "hole .obj": (".obj", lambda: bytes(100_000_000)),
    "hole .ply": (".ply", lambda: b"ply\n" + bytes(100_000_000)),
}  # fmt: skip
for name, (ending, content) in MESHES.items():
    BOMBS[name] = Bomb(with_points(content, ending), MESH)


def with_toml(content: Any) -> Any:
    """A TOML file beside a table that is learned by it."""

    def make(folder: Path) -> Path:
        (folder / "take.csv").write_text(honest())
        (folder / "face.glb").write_bytes(Scene().glb())
        path = folder / "bomb.toml"
        path.write_text(content() if callable(content) else content)
        return path

    return make


TOML = ("train DIR/take.csv -m DIR/out.m --regions FILE", "inspect DIR/face.glb --drivers FILE")
TOMLS: dict[str, Any] = {
    "lists 10^5 deep": "a = " + "[" * 100_000 + "]" * 100_000,
    "tables 10^5 deep": "a = " + "{a = " * 100_000 + "1" + "}" * 100_000,
    "dots 10^5 deep": "[" + ".".join("a" * 100_000) + "]\nb = 1",
    "dotted keys": lambda: "\n".join(f"{'.'.join('a' * 500)}.b{i} = 1" for i in range(2_000)),
    "an integer of 10^5 digits": "a = " + "9" * 100_000,
    "100,000 tables": lambda: "\n".join(f'[t{i}]\nmarkers=["a"]' for i in range(100_000)),
    "numbers of 1e300": '[[jawOpen]]\nnode = "n"\nrotate = [1e300, 0, inf]',
}
for name, content in TOMLS.items():
    BOMBS[f"toml {name}"] = Bomb(with_toml(content), TOML)


def gif(width: int, height: int) -> bytes:
    """A GIF of one picture that declares a size."""
    head = b"GIF89a" + struct.pack("<HHBBB", width, height, 0x80, 0, 0) + bytes(6)
    frame = b"\x2c" + struct.pack("<HHHHB", 0, 0, width, height, 0) + b"\x02\x02\x44\x01\x00"
    return head + frame + b"\x3b"


def with_video(content: bytes, ending: str) -> Any:
    def make(folder: Path) -> Path:
        (folder / "take.csv").write_text(honest())
        path = folder / f"bomb{ending}"
        path.write_bytes(content)
        return path

    return make


VIDEO = ("render DIR/take.csv DIR/out.png --video FILE",)
BOMBS["gif of 4 gigapixels"] = Bomb(with_video(gif(65535, 65535), ".gif"), VIDEO)
BOMBS["gif of 130 megapixels"] = Bomb(with_video(gif(13000, 10000), ".gif"), VIDEO)
BOMBS["gif of nothing"] = Bomb(with_video(gif(0, 0), ".gif"), VIDEO)
BOMBS["png as a video"] = Bomb(with_video(png(65000, 65000), ".mp4"), VIDEO)

"""Hostile captures, meshes, settings and videos; see `bomb_registry`."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import numpy as np

from experiments.reliability.bomb_registry import BOMBS, TAKE, Bomb, each
from experiments.reliability.bomb_scenes import Scene, png
from experiments.reliability.bomb_tables import honest, markers

MESH = ("drive FILE DIR/points.csv DIR/out.h5 --auto",)


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


TOML = (
    "train DIR/take.csv -o DIR/out.safetensors --regions FILE",
    "convert DIR/face.glb DIR/out.h5 --drivers FILE",
)
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

"""Hostile archives of arrays, .npz; see `bomb_registry`."""

from __future__ import annotations

import io
import struct
import zipfile
from typing import Any

import numpy as np

from experiments.reliability.bomb_registry import RIG, TAKE, each


def archive(compression: int = zipfile.ZIP_DEFLATED, **arrays: Any) -> bytes:
    """An archive of arrays, or of members that are bytes."""
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", compression, allowZip64=True) as file:
        for name, array in arrays.items():
            member = array
            if not isinstance(array, bytes):
                held = io.BytesIO()
                np.save(held, array)
                member = held.getvalue()
            file.writestr(f"{name}.npy", member)
    return content.getvalue()


def npy(shape: tuple[int, ...], dtype: str, size: int) -> bytes:
    """A member whose header declares what its zeros may not hold."""
    head = f"{{'descr': '{dtype}', 'fortran_order': False, 'shape': {shape}, }}"
    text = head.ljust(117) + "\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text.encode() + bytes(size)


NAMES = np.array([f"m{i}" for i in range(4)])
TRACK = np.random.default_rng(0).normal(size=(40, 4, 3))


def track(**changed: Any) -> bytes:
    plain = {"markers": TRACK, "marker_names": NAMES, "fps": np.array(25.0)}
    return archive(**(plain | changed))


def spiked(value: float) -> np.ndarray:
    changed = TRACK.copy()
    changed[20, 1, 1] = value
    return changed


def rig(**changed: Any) -> bytes:
    vertices = np.random.default_rng(0).normal(size=(30, 3))
    plain = {
        "neutral": vertices,
        "faces": np.arange(30).reshape(10, 3),
        "deltas": np.random.default_rng(1).normal(size=(3, 30, 3)) * 0.01,
        "names": np.array(["jawOpen", "b", "c"]),
    }
    return archive(**(plain | changed))


def lied(content: bytes, size: int) -> bytes:
    """The archive with another size for its first member in the central directory."""
    place = content.index(b"PK\x01\x02")
    return content[: place + 24] + struct.pack("<I", size) + content[place + 28 :]


def repeated(count: int) -> bytes:
    """An archive whose directory names one member's bytes again and again."""
    content = archive(a=npy((8_000_000,), "<f8", 64_000_000))
    place = content.index(b"PK\x01\x02")
    entry, end = content[place : content.index(b"PK\x05\x06")], content[-22:]
    entries = b"".join(entry.replace(b"a.npy", b"%05d" % i) for i in range(count))
    tail = struct.pack("<HHIIH", count, count, len(entries), place, 0)
    return content[:place] + entries + end[:8] + tail


each(
    "npz",
    ".npz",
    {
        "1 GB of zeros": lambda: track(markers=npy((40, 1_000_000, 3), "<f8", 960_000_000)),
        "bytes as floats": lambda: track(markers=npy((40, 1_000_000, 3), "|i1", 120_000_000)),
        "shape without bytes": track(markers=npy((40, 10**9, 3), "<f8", 100)),
        "shape of 0 by 10^18": track(markers=npy((0, 10**18, 3), "<f8", 100)),
        "a negative shape": track(markers=npy((-40, -4, 3), "<f8", 100_000)),
        "strings of 10^8 letters": track(marker_names=npy((4,), "<U100000000", 100)),
        "strings of 50 MB": lambda: track(marker_names=npy((4,), "<U3000000", 48_000_000)),
        "a million names": lambda: track(marker_names=npy((1_000_000,), "<U1", 4_000_000)),
        "a size that lies": lied(track(), 2**31),
        "a size of 0": lied(track(), 0),
        "200 members that are one": lambda: repeated(200),
        "100,000 members": lambda: archive(
            zipfile.ZIP_STORED, **{f"k{i}": b"" for i in range(100_000)}
        ),
        "1,000 targets": lambda: track(
            **{f"k{i}": np.zeros((40, 2)) for i in range(1000)},
            **{f"k{i}_names": np.array(["a", "b"]) for i in range(1000)},
        ),
        "a header of 10 MB": lambda: track(
            markers=b"\x93NUMPY\x02\x00" + struct.pack("<I", 10_000_000) + b"(" * 10_000_000
        ),
        "an archive within": track(markers=track()),
        "a frame of no marker": track(markers=np.zeros((40, 0, 3)), marker_names=np.array([], "U")),
    },
)
each(
    "npz value",
    ".npz",
    {
        "1e300": track(markers=spiked(1e300)),
        "inf": track(markers=spiked(np.inf)),
        "all 1e300": track(markers=TRACK * 1e300),
        "all denormal": track(markers=TRACK * 1e-310),
        "fps 1e300": track(fps=np.array(1e300)),
        "fps 1e-300": track(fps=np.array(1e-300)),
        "fps nan": track(fps=np.array(np.nan)),
        "fps -1": track(fps=np.array(-1.0)),
        "time 1e300": track(time=np.arange(40) * 1e300),
        "time 1e-320": track(time=np.arange(40) * 1e-320),
        "last time 1e300": track(time=np.r_[np.arange(39) / 25, 1e300]),
        "complex": track(markers=TRACK.astype(complex)),
        "float128": track(markers=TRACK.astype(np.longdouble) * np.longdouble("1e4000")),
    },
    TAKE,
)
each(
    "npz rig",
    ".npz",
    {
        "neutral 1e300": rig(neutral=np.full((30, 3), 1e300)),
        "one vertex 1e300": rig(neutral=np.r_[np.zeros((29, 3)), [[1e300, 0, 0]]]),
        "deltas 1e300": rig(deltas=np.full((3, 30, 3), 1e300)),
        "no extent": rig(neutral=np.zeros((30, 3)), deltas=np.zeros((3, 30, 3))),
        "denormal": rig(neutral=np.full((30, 3), 5e-324)),
        "faces 2^62": rig(faces=np.full((10, 3), 2**62)),
        "faces of uint64": rig(faces=np.full((10, 3), 2**64 - 1, dtype=np.uint64)),
        "a million vertices": lambda: rig(
            neutral=np.zeros((1_000_000, 3), np.float32) + np.arange(3),
            deltas=npy((3, 1_000_000, 3), "<f4", 36_000_000),
        ),
        "10,000 shapes": lambda: rig(
            deltas=np.zeros((10_000, 30, 3)), names=np.array([f"s{i}" for i in range(10_000)])
        ),
    },
    RIG,
)

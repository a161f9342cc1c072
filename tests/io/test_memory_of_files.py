"""Files of a few bytes that declare, repeat or unpack to what would fill the memory."""

from __future__ import annotations

import json
import struct
import tracemalloc
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gltf_files import FACE, Builder, glb

from facert.errors import InputError
from facert.io.formats import read_any

MEBIBYTE = 1 << 20


def scene(**changed: Any) -> bytes:
    """A face of one target, whose JSON is changed."""
    content = FACE.tobytes()
    view = {"buffer": 0, "byteLength": len(content)}
    accessor = {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}
    primitive = {"attributes": {"POSITION": 0}, "targets": [{"POSITION": 0}]}
    root = {
        "asset": {"version": "2.0"},
        "buffers": [view | {"buffer": 0}],
        "bufferViews": [view],
        "accessors": [accessor],
        "meshes": [{"primitives": [primitive]}],
        "nodes": [{"mesh": 0}],
    }
    return glb(root | changed, content)


def sparse(count: int) -> bytes:
    """Positions without bytes, which are zeros."""
    return scene(accessors=[{"componentType": 5126, "count": count, "type": "VEC3"}])


def one_accessor_many_times(targets: int) -> bytes:
    primitive = {"attributes": {"POSITION": 0}, "targets": [{"POSITION": 0}] * targets}
    return scene(
        accessors=[{"componentType": 5126, "count": 100_000, "type": "VEC3"}],
        meshes=[{"primitives": [primitive]}],
    )


def far_keys(path: Path) -> None:
    builder = Builder()
    builder.mesh(FACE, {"smile": FACE})
    builder.animate(np.array([0, 0.01, 3e7]), np.arange(3))
    builder.save(path)


def curves_of_other_times(count: int) -> str:
    return json.dumps([{"Name": f"c{i}", f"{i}.5": 1.0} for i in range(count)])


def packed(**arrays: Any) -> Any:
    return lambda path: np.savez_compressed(path, **arrays)


def hole(path: Path) -> None:
    with path.open("wb") as file:
        file.truncate(100 * MEBIBYTE)


BOMBS: dict[str, tuple[str, Any, str]] = {
    "a sparse accessor": (".glb", sparse(10**8), "accessors: .*--max-memory"),
    "an accessor as many targets": (".glb", one_accessor_many_times(200), "--max-memory"),
    "keys a year apart": (".glb", far_keys, "animations: .*--max-memory"),
    "a mesh of many views": (".npz", packed(markers=np.zeros((10, 300_000, 3))), "--max-memory"),
    "integers of a byte": (".npz", packed(weights=np.zeros((10, 10**6), np.int8)), "--max-memory"),
    "curves with a time each": (".json", curves_of_other_times(3000), "--max-memory"),
    "a hole, as CSV": (".csv", hole, "a hole of zeros"),
    "a hole, as JSON": (".json", hole, "a hole of zeros"),
    "a hole, as TRC": (".trc", hole, "a hole of zeros"),
    "a hole, as glTF": (".gltf", hole, "a hole of zeros"),
    "commas": (".csv", "time,a\n" + "," * 3_000_000, "file: .*--max-memory"),
    "an open list": (".json", "[" * 3_000_000, "file: .*--max-memory"),
    "shapes": (".txt", "info,x\nbs," + "a," * 60_000 + "\n", "at most 49216 columns"),
    "markers": (
        ".trc",
        "PathFileType\t4\t(X/Y/Z)\tx\nDataRate\n25\nFrame#\tTime" + "\ta" * 60_000,
        "at most 49216 columns",
    ),
    "columns": (".csv", ",".join(map(str, range(60_000))) + "\n1\n", "at most 49216 columns"),
}


@pytest.mark.parametrize("name", BOMBS)
def test_a_bomb_is_refused_before_it_takes_memory(tmp_path: Path, name: str) -> None:
    ending, content, message = BOMBS[name]
    path = tmp_path / f"bomb{ending}"
    if callable(content):
        content(path)
    else:
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
    tracemalloc.start()
    try:
        with pytest.raises(InputError, match=message):
            read_any(path, kind="take" if "keys" in name else None)
        assert tracemalloc.get_traced_memory()[1] < 150 * MEBIBYTE
    finally:
        tracemalloc.stop()


def test_the_user_may_allow_more(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    np.savez_compressed(
        tmp_path / "a.npz", weights=np.eye(1200), weight_names=np.arange(1200).astype(str), fps=25.0
    )
    monkeypatch.setenv("FACERT_MAX_MEMORY", "15M")
    with pytest.raises(InputError, match="at most 15 MiB of memory, found 22"):
        read_any(tmp_path / "a.npz")
    monkeypatch.setenv("FACERT_MAX_MEMORY", "200M")
    assert len(read_any(tmp_path / "a.npz")) == 1200  # type: ignore[arg-type]


def test_a_buffer_that_is_named_often_is_read_once(tmp_path: Path) -> None:
    (tmp_path / "a.bin").write_bytes(FACE.tobytes().ljust(MEBIBYTE))
    view = {"uri": "a.bin", "byteLength": MEBIBYTE}
    root = json.loads(scene()[20 : 20 + struct.unpack_from("<I", scene(), 12)[0]])
    path = tmp_path / "a.gltf"
    path.write_text(json.dumps(root | {"buffers": [view] * 300}))
    tracemalloc.start()
    try:
        read_any(path)
        assert tracemalloc.get_traced_memory()[1] < 20 * MEBIBYTE
    finally:
        tracemalloc.stop()

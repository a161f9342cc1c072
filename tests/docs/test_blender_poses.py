"""The script of the phone's guide for Blender writes poses that facert reads."""

from __future__ import annotations

import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest
from following import DOCS, blocks_of, inside

from facert.io.poses import read_poses


class Scene:
    """A scene in which each shape's value is a tenth of the frame's number."""

    def __init__(self, names: list[str]) -> None:
        self.blocks = [SimpleNamespace(name=name, value=0.0) for name in names]

    def frame_set(self, frame: int) -> None:
        for block in self.blocks:
            block.value = frame / 10


@pytest.fixture
def script(monkeypatch: pytest.MonkeyPatch) -> str:
    scene = Scene(["Basis", "jaw_open", "smile"])
    shape_keys = SimpleNamespace(key_blocks=scene.blocks)
    face = SimpleNamespace(data=SimpleNamespace(shape_keys=shape_keys))
    blender = ModuleType("bpy")
    blender.context = SimpleNamespace(active_object=face, scene=scene)
    monkeypatch.setitem(sys.modules, "bpy", blender)
    (text,) = [b.text for b in blocks_of(DOCS / "phone-to-blender.md") if "bpy" in b.text]
    return text


def test_poses_are_written_with_the_frames_of_the_recording(script: str, tmp_path: Path) -> None:
    with inside(tmp_path):
        exec(compile(script, "export_poses.py", "exec"), {})
    poses = read_poses(tmp_path / "poses.csv")
    assert poses.names == ("jaw_open", "smile")
    assert poses.frames is not None
    assert poses.frames.tolist() == [5, 41, 121]
    assert poses.values[:, 0].tolist() == [0.6, 4.2, 12.2]  # Blender counts from 1

"""A disk that is full, whatever is written: an error about the output, and nothing left behind."""

from __future__ import annotations

import gc
import os
import resource
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from facert.cli.shared.files import save_json, save_picture
from facert.data.names import ARKIT_SHAPES
from facert.data.rig import Mesh
from facert.data.take import Controls, Source, Take
from facert.errors import InputError
from facert.io.claims import claims_kept
from facert.io.importers.shared import Pose, ScriptError, write_poses
from facert.io.journal import Journal
from facert.io.mesh_sequence import new_mesh_sequence
from facert.io.registry import require_replaceable, write
from facert.io.tensors import write_tensors
from facert.io.video import write_clip
from facert.mesh.morphs import Morphs
from facert.models.optim.optimiser import State
from facert.retarget.checkpoint import CurveLog

FRAMES = 400
RNG = np.random.default_rng(0)
TIME = np.arange(FRAMES) / 30.0
WEIGHTS = RNG.random((FRAMES, len(ARKIT_SHAPES)))
TAKE = Take(TIME, Source(WEIGHTS, ARKIT_SHAPES), Controls(ARKIT_SHAPES), WEIGHTS, fps=30.0)
MESH = Mesh(RNG.random((300, 3)), np.arange(300).reshape(-1, 3), units="cm")
MORPHS = Morphs(MESH, RNG.random((3, 300, 3)), ("a", "b", "c"), RNG.random((FRAMES, 3)), TIME)


@dataclass(frozen=True)
class Facts:
    """No metadata."""


def mesh_sequence(path: Path) -> None:
    with new_mesh_sequence(path, MESH, TIME, 30.0) as new:
        for _ in range(FRAMES // 10):
            new.append(RNG.random((10, 300, 3)))


def picture(path: Path) -> None:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6, 6))
    figure.subplots().imshow(RNG.random((200, 200)))
    save_picture(figure, path, overwrite=False)


def clip(path: Path) -> None:
    noise = RNG.integers(0, 255, (20, 64, 64, 3)).astype(np.uint8)
    write_clip(iter(noise), path, 25.0)


def curve(path: Path) -> None:
    log = CurveLog(path, overwrite=False)
    log.resume("")
    try:
        for number in range(4000):
            log.iteration(State(np.zeros(1), 0.1, 0.1, number, {}))
    finally:
        assert path.read_bytes().endswith(b"\n")  # whole lines, of work that was done
        path.unlink()


def journal(path: Path) -> None:
    kept = Journal(path, "work")
    kept.begin()
    try:
        for number in range(2000):
            kept.add({"cell": number, "text": "x" * 20})
    finally:
        lines = path.read_text().splitlines(keepends=True)
        assert len(lines) > 10
        assert lines[-1].endswith("\n")
        path.unlink()


def poses_of_the_add_on(path: Path) -> None:
    poses = [Pose(frame, frame / 30, dict.fromkeys(ARKIT_SHAPES, 0.1 / 3)) for frame in range(200)]
    try:
        write_poses(str(path), poses, 30.0)
    except ScriptError as error:
        raise InputError("output", "room", str(error), "") from error


WRITERS: dict[str, Callable[[Path], None]] = {
    "take.h5": lambda path: write("take", TAKE, path),
    "take.csv": lambda path: write("take", TAKE, path),
    "take.livelink.csv": lambda path: write("take", TAKE, path),
    "take.curvetable.csv": lambda path: write("take", TAKE, path),
    "take.curvetable.json": lambda path: write("take", TAKE, path),
    "take.json": lambda path: write("take", TAKE, path),
    "sequence.h5": mesh_sequence,
    "morphs.glb": lambda path: write("morphs", MORPHS, path),
    "morphs.usda": lambda path: write("morphs", MORPHS, path),
    "morphs.usdc": lambda path: write("morphs", MORPHS, path),
    "model.safetensors": lambda path: write_tensors(path, {"a": WEIGHTS}, Facts(), "x"),
    "picture.png": picture,
    "picture.svg": picture,
    "picture.pdf": picture,
    "clip.gif": clip,
    "clip.mp4": clip,
    "report.json": lambda path: save_json({"a": ["text"] * 9000}, path, overwrite=False),
    "curve.csv": curve,
    "cells.jsonl": journal,
    "poses.csv": poses_of_the_add_on,
    "poses.h5": poses_of_the_add_on,
}
ROOM = 20_000
"""Bytes that there is room for."""
ON_DISK = (
    "take.h5",
    "sequence.h5",
    "take.csv",
    "morphs.usda",
    "morphs.usdc",
    "clip.mp4",
    "curve.csv",
)
"""One of each way in which files are written."""


@contextmanager
def at_most(size: int) -> Iterator[None]:
    """A limit to the size of files, which any user may set."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.fixture(scope="module")
def small_disk(tmp_path_factory) -> Iterator[Path]:
    """A file system with room for a few pages."""
    place = tmp_path_factory.mktemp("disk")
    mount = ["mount", "-t", "tmpfs", "-o", "size=24k", "none", str(place)]
    if (
        sys.platform != "linux"
        or os.geteuid() != 0
        or subprocess.run(mount, check=False).returncode
    ):
        pytest.skip("only root may mount a file system here")
    yield place
    subprocess.run(["umount", str(place)], check=True)


def require_usd(name: str) -> None:
    if "usd" in name:
        pytest.importorskip("pxr")


@pytest.mark.parametrize("name", WRITERS)
def test_a_file_that_may_not_grow_ends_in_an_error_about_it(name, tmp_path):
    require_usd(name)
    with at_most(ROOM), pytest.raises(InputError, match="output"):
        WRITERS[name](tmp_path / name)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ON_DISK)
def test_a_full_disk_ends_in_an_error_about_it(name, small_disk):
    require_usd(name)
    with pytest.raises(InputError, match="output"):
        WRITERS[name](small_disk / name)
    assert list(small_disk.iterdir()) == []


def test_an_output_that_is_there_stays_whole(tmp_path):
    path = tmp_path / "take.h5"
    write("take", TAKE, path)
    before = path.read_bytes()
    with at_most(ROOM), pytest.raises(InputError):
        write("take", TAKE, path, overwrite=True)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_a_process_that_could_not_write_hdf5_ends_as_it_should(tmp_path):
    text = (
        "import sys, test_full_disk as all\n"
        "from pathlib import Path\n"
        "for name in ('take.h5', 'sequence.h5', 'poses.h5'):\n"
        "    try:\n"
        "        with all.at_most(all.ROOM): all.WRITERS[name](Path(sys.argv[1]) / name)\n"
        "    except all.InputError as error: print(error.field)\n"
    )
    path = os.pathsep.join([str(Path(__file__).parent), *sys.path])
    command = [sys.executable, "-c", text, str(tmp_path)]
    done = subprocess.run(
        command, env={**os.environ, "PYTHONPATH": path}, capture_output=True, check=False
    )
    assert (done.returncode, done.stdout.split()) == (0, [b"output"] * 3), done.stderr


def test_where_nothing_can_be_written_a_run_says_so_before_it_works(small_disk):
    path = small_disk / "take.csv"
    gc.collect()  # files of errors that earlier tests still refer to keep the disk busy
    subprocess.run(["mount", "-o", "remount,ro", str(small_disk)], check=True)
    try:
        with pytest.raises(InputError, match="Read-only file system"), claims_kept():
            require_replaceable(path, overwrite=False)
        with pytest.raises(InputError, match="Read-only file system"):
            write("take", TAKE, path)
    finally:
        subprocess.run(["mount", "-o", "remount,rw", str(small_disk)], check=True)

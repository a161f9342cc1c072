"""What a phone tracked is seen on facert's own face, and beside the performer's video."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread
from PIL import Image

from facert.data.names import ARKIT_SHAPES
from facert.data.rig import Rig
from facert.data.take import Controls, Source, Take
from facert.io.rig import write_rig
from facert.io.take import write_take
from facert.io.video import write_clip

VERTICES = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
RIG = Rig(VERTICES, VERTICES[None] * 0.5, ("up",), np.array([[0, 1, 2], [0, 2, 3]]))
TIME = np.arange(24) / 24
SOURCE = Source(np.abs(np.random.default_rng(0).normal(0, 0.3, (24, 52))), ARKIT_SHAPES)


@pytest.fixture(name="folder")
def _folder(tmp_path: Path) -> Path:
    write_rig(RIG, tmp_path / "rig.h5")
    write_take(Take(TIME, SOURCE, fps=24.0), tmp_path / "raw.h5")
    posed = Take(TIME, SOURCE, Controls(("up",)), np.sin(TIME)[:, None], fps=24.0)
    write_take(posed, tmp_path / "posed.h5")
    other = Source(SOURCE.values[:, :2], ("smile", "open"))
    write_take(Take(TIME, other, fps=24.0), tmp_path / "other.h5")
    return tmp_path


@pytest.fixture(name="video", scope="module")
def _video(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("filmed") / "face.mp4"
    red = np.zeros((32, 32, 3), dtype=np.uint8)
    red[..., 0] = 220
    write_clip(iter([red] * 12), path, 24.0)
    return path


def size(path: Path) -> tuple[int, int]:
    return imread(path).shape[:2]


def reds(path: Path) -> float:
    """The share of a picture that shows the video."""
    picture = imread(path)[..., :3]
    return float(((picture[..., 0] > 0.7) & (picture[..., 1:] < 0.2).all(axis=2)).mean())


def test_a_recording_without_poses_is_drawn_on_the_stand_in(facert, folder: Path) -> None:
    arguments = ("render", folder / "raw.h5", folder / "faces.png", "--size", "64")
    done = facert(*arguments)
    assert (done.code, len(done.out.split("frames ")[1].split(","))) == (0, 6)
    assert "stand-in" in done.err
    assert "--actor none" in done.err
    assert imread(folder / "faces.png").std() > 0.02
    refused = facert(*arguments, "--overwrite", "--actor", "none")
    assert (refused.code, "--rig: expected" in refused.err) == (3, True)


def test_the_actor_stands_above_the_character_unless_left_out(facert, folder: Path) -> None:
    arguments = ("render", folder / "posed.h5", "--rig", folder / "rig.h5", "--size", "64")
    for name, more in (("both", ()), ("one", ("--actor", "none"))):
        done = facert(*arguments, folder / f"{name}.png", "--frames", "2,9", *more)
        assert done.code == 0
        assert ("stand-in" in done.err) == (name == "both")
    assert size(folder / "both.png")[0] > 1.8 * size(folder / "one.png")[0]


def test_weights_of_other_names_need_a_rig(facert, folder: Path) -> None:
    sheet = folder / "sheet.png"
    for command in (("render", folder / "other.h5", sheet),
                    ("suggest", folder / "other.h5", "-n", 2, "--sheet", sheet)):  # fmt: skip
        refused = facert(*command)
        assert refused.code == 3
        assert "not ARKit's: to see the actor's face, --actor RIG" in refused.err
        assert "--rig: expected" in refused.err


def test_suggested_frames_are_seen_without_a_rig(facert, folder: Path, video: Path) -> None:
    arguments = ("suggest", folder / "raw.h5", "-n", 2, "--sheet")
    assert facert(*arguments, folder / "a.png").code == 0
    assert facert(*arguments, folder / "b.png", "--video", video).code == 0
    assert size(folder / "b.png")[0] > 1.6 * size(folder / "a.png")[0]
    alone = facert(*arguments, folder / "c.png", "--video", video, "--actor", "none")
    assert (alone.code, "stand-in" in alone.err) == (0, False)


def test_the_video_stands_beside_by_time(facert, folder: Path, video: Path) -> None:
    arguments = ("render", folder / "raw.h5", "--video", video, "--size", "64")
    done = facert(*arguments, folder / "a.png", "--frames", "3")
    assert (done.code, "face.mp4 begins at 0.00 s" in done.err) == (0, True)
    late = (folder / "b.png", "--frames", "3", "--video-start", "0.4")
    assert facert(*arguments, *late).code == 0
    assert reds(folder / "a.png") > 0.1 > reds(folder / "b.png")
    assert facert(*arguments, folder / "a.gif", "--frames", "0..5").code == 0
    with Image.open(folder / "a.gif") as clip:
        assert clip.width == 2 * 64


def test_what_is_no_video_is_refused(facert, folder: Path, video: Path) -> None:
    arguments = ("render", folder / "raw.h5", folder / "a.png")
    refused = facert(*arguments, "--video", folder / "rig.h5")
    assert (refused.code, "rig.h5: --video: expected a video" in refused.err) == (3, True)
    refused = facert(*arguments, "--video-start", "2")
    assert (refused.code, "--video-start: expected the video" in refused.err) == (3, True)
    refused = facert(*arguments, "--video", video, "--video-start", "60")
    assert (refused.code, "some of the take's 0.00 to 0.96 s" in refused.err) == (3, True)
    assert not (folder / "a.png").exists()

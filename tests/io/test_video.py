"""Clips hold the pictures that they were given."""

from __future__ import annotations

import subprocess
from pathlib import Path

import imageio_ffmpeg
import numpy as np
import pytest
from PIL import Image

from facert.errors import FacertError, InputError, OutputExistsError
from facert.io.video import write_clip

SHADES = np.arange(6) * 40
PICTURES = np.stack([np.full((32, 64, 3), shade, dtype=np.uint8) for shade in SHADES])


def test_a_gif_has_every_picture_for_its_time_and_loops(tmp_path: Path) -> None:
    first = PICTURES[0].copy()
    first[:, :, :] = np.arange(64)[None, :, None] * 4  # the colours of all that follow
    write_clip(iter([first, *PICTURES[1:]]), tmp_path / "clip.gif", 20.0)
    with Image.open(tmp_path / "clip.gif") as clip:
        assert (clip.n_frames, clip.info["duration"], clip.info["loop"]) == (6, 50, 0)
        for number in range(1, 6):
            clip.seek(number)
            assert np.mean(clip.convert("RGB")) == pytest.approx(SHADES[number], abs=6)


def test_an_mp4_has_every_picture_at_its_rate(tmp_path: Path) -> None:
    write_clip(iter(PICTURES), tmp_path / "clip.mp4", 25.0)
    program = [imageio_ffmpeg.get_ffmpeg_exe(), "-hide_banner", "-i", str(tmp_path / "clip.mp4")]
    raw = [*program, "-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    decoded = subprocess.run(raw, capture_output=True, check=True)
    shades = np.frombuffer(decoded.stdout, np.uint8).reshape(PICTURES.shape).mean(axis=(1, 2, 3))
    np.testing.assert_allclose(shades, SHADES, atol=6)
    for fact in (b"h264", b"yuv420p", b"64x32", b"25 fps"):
        assert fact in decoded.stderr


@pytest.mark.parametrize("ending", [".gif", ".mp4"])
def test_a_clip_that_fails_leaves_no_file(tmp_path: Path, ending: str) -> None:
    def pictures():
        yield from PICTURES[:2]
        raise FacertError("no more")

    with pytest.raises(FacertError, match="no more"):
        write_clip(pictures(), tmp_path / f"clip{ending}", 25.0)
    assert not list(tmp_path.iterdir())


def test_another_ending_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"\.avi"):
        write_clip(iter(PICTURES), tmp_path / "clip.avi", 25.0)


def test_an_existing_clip_is_kept(tmp_path: Path) -> None:
    (tmp_path / "clip.gif").write_text("mine")
    with pytest.raises(OutputExistsError):
        write_clip(iter(PICTURES), tmp_path / "clip.gif", 25.0)
    assert (tmp_path / "clip.gif").read_text() == "mine"

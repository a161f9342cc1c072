"""A performer's video is shown by time, whatever its spacing and turn; anything else is refused."""

from __future__ import annotations

import subprocess
from dataclasses import replace
from pathlib import Path

import imageio_ffmpeg
import numpy as np
import pytest

from facert.data.take import Source, Take
from facert.errors import InputError
from facert.io.video import write_clip
from facert.io.video_frames import VideoFrames, open_video

SHADES = np.arange(40) * 6
TAKE = Take(np.arange(40) / 20, Source(np.ones((40, 1)), ("jawOpen",)), fps=20.0)


def made(source: Path, output: Path, *options: str, before: tuple[str, ...] = ()) -> Path:
    """A video by ffmpeg from another one."""
    program = [imageio_ffmpeg.get_ffmpeg_exe(), "-v", "error", *before, "-i", str(source)]
    subprocess.run([*program, *options, str(output)], check=True)
    return output


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two seconds at 20 frames a second, each brighter than the one before."""
    path = tmp_path_factory.mktemp("video") / "face.mp4"
    pictures = (np.full((32, 64, 3), shade, dtype=np.uint8) for shade in SHADES)
    write_clip(pictures, path, 20.0)
    return path


def test_each_moment_shows_its_frame(recorded: Path) -> None:
    video = VideoFrames(recorded, start=0.5)
    for frame in (0, 1, 17, 39, 16, 15):
        picture = video.at(0.5 + frame / 20)
        assert picture is not None
        assert picture.shape == (32, 64, 3)
        assert picture.mean() == pytest.approx(SHADES[frame], abs=4)
    assert video.at(0.4) is None
    assert video.at(2.6) is None


def test_frames_at_uneven_times_of_a_turned_phone(recorded: Path, tmp_path: Path) -> None:
    part = ("-vf", "select='lt(n,10)+not(mod(n,4))'", "-fps_mode", "vfr")
    uneven = made(recorded, tmp_path / "uneven.mp4", *part)
    turned = made(uneven, tmp_path / "t.mov", "-c", "copy", before=("-display_rotation", "90"))
    video = VideoFrames(turned, pixels=16)
    for frame in (5, 12, 24):  # those that were kept
        picture = video.at(frame / 20)
        assert picture is not None
        assert picture.shape == (16, 8, 3)
        assert picture.mean() == pytest.approx(SHADES[frame], abs=4)


def test_memory_is_bounded(recorded: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("facert.io.video_frames._KEPT", 1)
    video = VideoFrames(recorded)
    assert [video.at(seconds) is None for seconds in (0.0, 1.0, 1.8, 0.1)] == [False] * 4
    assert len(video._lots) == 1


def test_timecodes_place_a_video(
    recorded: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    coded = made(recorded, tmp_path / "f.mov", "-c", "copy", "-timecode", "00:00:00:10")
    take = replace(TAKE, start_timecode="23:59:59:40.500")
    with caplog.at_level("INFO"):
        assert open_video(coded, take).start == pytest.approx(0.5 + 19.5 / 60)
        assert open_video(coded, TAKE).start == 0
        assert open_video(coded, take, -1.5).start == -1.5
    assert "--video-start" in caplog.records[0].message
    with pytest.raises(InputError, match="--video-start"):
        open_video(coded, TAKE, 50.0)


def test_what_is_no_video_is_refused(tmp_path: Path) -> None:
    tone = [imageio_ffmpeg.get_ffmpeg_exe(), "-v", "error", "-f", "lavfi", "-i", "sine"]
    subprocess.run([*tone, "-t", "0.1", str(tmp_path / "sound.mp4")], check=True)
    with pytest.raises(InputError, match="found only sound"):
        VideoFrames(tmp_path / "sound.mp4")
    (tmp_path / "list.mp4").write_text("#EXTM3U\n#EXTINF:1,\n/etc/hostname\n")
    (tmp_path / "list.txt").write_text("ffconcat version 1.0\nfile /etc/hostname\n")
    (tmp_path / "sound.wav").write_bytes(b"RIFF\x24\0\0\0WAVEfmt " + bytes(40))
    for name in ("list.mp4", "list.txt", "sound.wav"):
        with pytest.raises(InputError, match=rf"{name}: --video: expected a video"):
            VideoFrames(tmp_path / name)
    with pytest.raises(InputError, match="an existing file"):
        VideoFrames(tmp_path / "nothing.mp4")

"""Frames of a recorded video by time: the performer beside the face, by ffmpeg of imageio-ffmpeg.

Phones write frames at uneven times and turned by metadata: ffmpeg spaces the frames evenly by
their times and turns them.
"""

from __future__ import annotations

import logging
import math
import re
import subprocess
from collections import OrderedDict
from pathlib import Path
from threading import Lock

import numpy as np
from numpy.typing import NDArray

from facert.data.moments import Timed
from facert.data.rate import whole_count
from facert.data.text import printable
from facert.data.timecode import (
    LIVE_LINK_RATE,
    TICKS,
    has_thousandths,
    parse_timecode,
)
from facert.errors import InputError, reading
from facert.io.guarded import existing_file

log = logging.getLogger("facert")

PIXELS = 480
MAX_HOURS = 12
_MAX_PIXELS = 2**27  # of a frame of the file
_FORMATS = "mov,matroska,avi,mpegts,mpeg,mxf,gif"  # none that names other files
_FASTEST = 60.0  # frames a second that are distinguished
_AT_ONCE, _KEPT = 16, 8  # frames that are decoded together, and how many such lots are kept
_SECONDS = 60  # that ffmpeg may take for one of them
_DAY = 24 * 3600

_DURATION = re.compile(r"Duration: (\d+):(\d\d):(\d\d(?:\.\d+)?)")
_STREAM = re.compile(r"Stream #.*: Video: .*")
_RATE = re.compile(r"([\d.]+)(k?) (?:fps|tbr)\b")
_TIMECODE = re.compile(r"^\s*timecode\s*: (\d\d[:;]\d\d[:;]\d\d[:;.]\d\d)\s*$", re.MULTILINE)
_HEADER = re.compile(rb"P6\s(\d{1,5})\s(\d{1,5})\s255\s")

Pixels = NDArray[np.uint8]


class VideoFrames:
    """Frames of a video by the time of a take; few of them are in memory.

    Parameters
    ----------
    path : Path
        MP4, MOV, MKV, WebM, AVI, MPEG, MXF or GIF.
    start : float
        Seconds of the take at which the video begins.
    pixels : int
        Most of width and height; larger frames are made smaller.

    Raises
    ------
    InputError
        When it is no video, or one of more than `MAX_HOURS` hours.
    """

    def __init__(self, path: Path, start: float = 0.0, pixels: int = PIXELS) -> None:
        self.path, self.start, self._pixels = existing_file(Path(path)), start, pixels
        self._lots: OrderedDict[int, Pixels] = OrderedDict()
        self._lock = Lock()
        about = _run(self.path, [], [])[1]
        stream = _STREAM.search(about)
        if stream is None:
            raise _no_video(self.path, "only sound" if "Input #" in about else "something else")
        found = _DURATION.search(about)
        self.duration = _seconds(found) if found else math.inf
        """Seconds; infinite where the file does not state it."""
        if found and self.duration > 3600 * MAX_HOURS:
            expected, fix = f"a video of at most {MAX_HOURS} hours", "Cut it to the take."
            raise InputError("--video", expected, f"{self.duration:.0f} s", fix, str(path))
        rates = [float(rate) * (1000 if k else 1) for rate, k in _RATE.findall(stream[0])]
        self.fps = min(max(rates, default=30.0), _FASTEST) or 30.0
        """Frames a second that are distinguished."""
        code = _TIMECODE.search(about)
        self.start_timecode = code[1] if code else ""
        """As ``HH:MM:SS:FF``; empty where the file has none."""
        if not len(self._lot(0)):
            raise _no_video(self.path, "no frame that can be decoded")

    def at(self, seconds: float) -> Pixels | None:
        """The frame nearest to a time of the take, (H, W, 3) from 0 to 255.

        None before the video begins and after it has ended.
        """
        number = round((seconds - self.start) * self.fps)
        if number < 0 or number > self.duration * self.fps:
            return None
        with self._lock:
            lot = self._lot(number // _AT_ONCE)
        return lot[min(number % _AT_ONCE, len(lot) - 1)] if len(lot) else None

    def _lot(self, place: int) -> Pixels:
        """Frames from `place` * `_AT_ONCE` on, (n, H, W, 3); those asked for last are kept."""
        if place not in self._lots:
            self._lots[place] = self._decoded(place)
            while len(self._lots) > _KEPT:
                self._lots.popitem(last=False)
        self._lots.move_to_end(place)
        return self._lots[place]

    def _decoded(self, place: int) -> Pixels:
        # A quarter of a frame before the first one, so that no rounding of times loses it.
        begin = max((place * _AT_ONCE - 0.25) / self.fps, 0.0)
        box = f"scale=w='min({self._pixels},iw)':h='min({self._pixels},ih)'"
        picture = f"fps={self.fps}:start_time=0,{box}:force_original_aspect_ratio=decrease"
        wanted = ["-map", "0:v:0", "-vf", picture, "-frames:v", str(_AT_ONCE)]
        content, errors = _run(
            self.path, ["-ss", f"{begin:.6f}"], [*wanted, "-f", "image2pipe", "-c:v", "ppm", "-"]
        )
        header = _HEADER.match(content)
        if header is None:
            if errors:
                log.warning("%s: at %.2f s: %s", self.path.name, begin, _last_line(errors))
            return np.empty((0, 0, 0, 3), dtype=np.uint8)
        width, height, skipped = int(header[1]), int(header[2]), header.end()
        row = skipped + 3 * width * height
        count = len(content) // row
        lots = np.frombuffer(content, np.uint8, count * row).reshape(count, row)
        return lots[:, skipped:].reshape(count, height, width, 3)


def open_video(
    path: Path, take: Timed, start: float | None = None, pixels: int = PIXELS
) -> VideoFrames:
    """Open the video of a performance by the take's time, and log when it begins.

    Parameters
    ----------
    path : Path
    take : Timed
        A take, or a mesh in motion.
    start : float, optional
        Seconds of the take at which the video begins; else by their timecodes if both have one,
        and 0 if not.
    pixels : int
        Most of width and height.

    Raises
    ------
    InputError
        When it is no video, or shows no moment of the take.
    """
    video = VideoFrames(path, 0.0, pixels)
    how = "as given"
    if start is None:
        start = _between(take, video)
        how = "by the timecodes of both; --video-start SECONDS overrules that"
    if start is None:
        start, how = 0.0, "one of the two has no timecode; --video-start SECONDS overrules that"
    video.start = start
    with reading(path):
        _require_overlap(take, video)
    log.info("%s begins at %.2f s of the take: %s", video.path.name, start, how)
    return video


def _between(take: Timed, video: VideoFrames) -> float | None:
    """Seconds from the take's start to the video's by their timecodes, at most half a day."""
    ours = _ticks(take.start_timecode, take.fps)
    theirs = _ticks(video.start_timecode, video.fps)
    if ours is None or theirs is None:
        return None
    return ((theirs - ours) / TICKS + _DAY / 2) % _DAY - _DAY / 2


def _ticks(code: str, fps: float) -> int | None:
    return parse_timecode(code, LIVE_LINK_RATE if has_thousandths(code) else whole_count(fps))


def _require_overlap(take: Timed, video: VideoFrames) -> None:
    first, last = float(take.time[0]), float(take.time[-1])
    if last >= video.start and first <= video.start + video.duration:
        return
    expected = f"a video of some of the take's {first:.2f} to {last:.2f} s"
    found = f"one from {video.start:.2f} to {video.start + video.duration:.2f} s"
    raise InputError("--video", expected, found, "Say when it begins: --video-start SECONDS.")


def _run(path: Path, before: list[str], after: list[str]) -> tuple[bytes, str]:
    """Output and messages of ffmpeg, which reads no file but this one."""
    from imageio_ffmpeg import get_ffmpeg_exe

    guards = ["-protocol_whitelist", "file,pipe", "-format_whitelist", _FORMATS]
    guards += ["-max_pixels", str(_MAX_PIXELS), "-nostdin", "-hide_banner"]
    quiet = ["-loglevel", "error"] if after else []
    source = ["-i", f"file:{path.resolve()}"]
    command = [get_ffmpeg_exe(), *guards, *quiet, *before, *source, *after]
    try:
        done = subprocess.run(command, capture_output=True, timeout=_SECONDS)
    except (OSError, RuntimeError, subprocess.TimeoutExpired) as error:
        raise _no_video(path, f"ffmpeg failed: {error}") from error
    return done.stdout, done.stderr.decode("utf-8", errors="replace")


def _seconds(found: re.Match[str]) -> float:
    return 3600 * int(found[1]) + 60 * int(found[2]) + float(found[3])


def _last_line(text: str) -> str:
    return printable(text.strip().splitlines()[-1])


def _no_video(path: Path, found: str) -> InputError:
    expected = "a video (MP4, MOV, MKV, WebM, AVI)"
    return InputError("--video", expected, found, "Give the performer's video.", str(path))

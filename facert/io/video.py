"""Clips: an animated GIF by Pillow, or an MP4 (H.264) by the ffmpeg of imageio-ffmpeg."""

from __future__ import annotations

import ctypes
import errno
import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import suppress
from fractions import Fraction
from io import BytesIO
from itertools import chain
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from facert.data.version import CREATED_BY
from facert.errors import InputError
from facert.io.atomic import replacing, write_bytes
from facert.io.registry import require_replaceable

ENDINGS = (".gif", ".mp4")
_COLOURS = 128
_QUALITY = "15"  # the constant rate factor of H.264: 0 is lossless, 51 worst

Pictures = Iterator[NDArray[np.uint8]]


def write_clip(pictures: Pictures, path: Path, fps: float, overwrite: bool = False) -> None:
    """Write a clip in the format of the name's ending.

    Parameters
    ----------
    pictures : iterator of arrays of uint8, shape (H, W, 3)
        At least one; all of the same size, which is even for MP4.
    path : Path
        Its ending is one of `ENDINGS`.
    fps : float
        Frames a second; a GIF counts in hundredths of a second.
    overwrite : bool
        Allow to replace an existing file.

    Raises
    ------
    InputError
        For another ending.
    OutputExistsError
        When `path` exists and `overwrite` is not set.
    """
    writers = {".gif": _write_gif, ".mp4": _write_mp4}
    writer = writers.get(path.suffix.lower())
    if writer is None:
        known = " or ".join(ENDINGS)
        raise InputError("output", known, repr(path.suffix), "Give another name.", str(path))
    require_replaceable(path, overwrite)
    writer(pictures, path, fps, overwrite)


def _write_gif(pictures: Pictures, path: Path, fps: float, overwrite: bool) -> None:
    """Write a GIF with the colours of the first picture in all, so that nothing flickers."""
    from PIL import Image

    images = (Image.fromarray(picture) for picture in pictures)
    first = next(images).quantize(_COLOURS)
    others = (image.quantize(palette=first, dither=Image.Dither.NONE) for image in images)
    duration = max(20, 10 * round(100 / fps))  # milliseconds; viewers slow down shorter ones
    content = BytesIO()
    options = {"duration": duration, "loop": 0, "comment": CREATED_BY.encode()}
    first.save(content, "GIF", save_all=True, append_images=others, **options)
    write_bytes(content.getvalue(), path, overwrite)


def _write_mp4(pictures: Pictures, path: Path, fps: float, overwrite: bool) -> None:
    with replacing(path, overwrite) as temporary:
        _code(pictures, temporary, fps)


def _code(pictures: Pictures, path: Path, fps: float) -> None:
    """Have ffmpeg write an MP4; raises OSError with what it says when it cannot."""
    from imageio_ffmpeg import get_ffmpeg_exe

    first = next(pictures)
    height, width, _ = first.shape
    rate = str(Fraction(fps).limit_denominator())
    raw = ("-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r", rate)
    coded = ("-c:v", "libx264", "-pix_fmt", "yuv420p", "-crf", _QUALITY)
    mark = ("-metadata", f"comment={CREATED_BY}")
    to = f"file:{path.absolute()}"  # a name alone might be taken for an option or a protocol
    command = (get_ffmpeg_exe(), "-v", "error", "-y", *raw, "-i", "-", *coded, *mark, to)
    with subprocess.Popen(
        command,
        stdin=subprocess.PIPE,
        stderr=subprocess.PIPE,
        process_group=0,
        preexec_fn=_end_with_parent if sys.platform == "linux" else None,
    ) as process:
        assert process.stdin is not None
        assert process.stderr is not None
        try:
            with suppress(BrokenPipeError), process.stdin:  # ffmpeg says why it ended
                for picture in chain([first], pictures):
                    process.stdin.write(np.ascontiguousarray(picture).data)
            message = process.stderr.read().decode(errors="replace")
        except BaseException:
            process.kill()
            raise
    if process.returncode:
        said = re.sub(r"\[.*?\] ", "", message.partition("\n")[0]).replace(to, "it")
        if process.returncode == -getattr(signal, "SIGXFSZ", 0):
            raise OSError(errno.EFBIG, os.strerror(errno.EFBIG))
        raise OSError(errno.EIO, f"ffmpeg: {said or f'status {process.returncode}'}")


def _end_with_parent() -> None:
    """Let Linux end this process with its parent: alone it would still write its file."""
    set_death_signal = 1  # PR_SET_PDEATHSIG
    ctypes.CDLL(None).prctl(set_death_signal, signal.SIGKILL)

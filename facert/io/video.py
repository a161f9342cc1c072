"""Clips: an animated GIF by Pillow, or an MP4 (H.264) by the ffmpeg of imageio-ffmpeg."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from facert.errors import FacertError, InputError
from facert.io.atomic import replacing

ENDINGS = (".gif", ".mp4")
_COLOURS = 128
_QUALITY = 7  # of 10

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
    with replacing(path, overwrite) as temporary:
        writer(pictures, temporary, fps)


def _write_gif(pictures: Pictures, path: Path, fps: float) -> None:
    """Write a GIF with the colours of the first picture in all, so that nothing flickers."""
    from PIL import Image

    images = (Image.fromarray(picture) for picture in pictures)
    first = next(images).quantize(_COLOURS)
    others = (image.quantize(palette=first, dither=Image.Dither.NONE) for image in images)
    duration = max(20, 10 * round(100 / fps))  # milliseconds; viewers slow down shorter ones
    first.save(path, save_all=True, append_images=others, duration=duration, loop=0)


def _write_mp4(pictures: Pictures, path: Path, fps: float) -> None:
    from imageio_ffmpeg import write_frames

    first = next(pictures)
    height, width, _ = first.shape
    writer = write_frames(
        str(path), (width, height), fps=fps, quality=_QUALITY, macro_block_size=2,
        codec="libx264", ffmpeg_log_level="error",
    )  # fmt: skip
    try:
        writer.send(None)
        for picture in chain([first], pictures):
            writer.send(np.ascontiguousarray(picture))
    except (OSError, RuntimeError) as error:
        raise FacertError(f"{path.name}: ffmpeg could not write the video: {error}") from error
    finally:
        writer.close()

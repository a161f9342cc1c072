"""Faces in motion: the pictures of a clip, faces side by side, each with its name below."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial

import numpy as np
from PIL import Image, ImageDraw, ImageFont, ImageOps

from facert.data.arrays import FloatArray, IntArray
from facert.data.moments import frame_label
from facert.errors import InputError
from facert.render.faces import (
    INK,
    Face,
    FrameAt,
    Pixels,
    frame_faces,
    require_same_length,
)
from facert.render.shade import Camera

PIXELS = 300
CAPTION = 28
MOST_FRAMES = 2**20
"""Nine hours, which nobody looks at; a clock that was set anew makes a pause of years."""
_AT_ONCE = 8  # frames that are drawn in parallel


def sampled_frames(time: FloatArray, part: range, fps: float) -> IntArray:
    """The frames (n,) nearest to the evenly spaced moments of a clip.

    Parameters
    ----------
    time : array, shape (T,)
        Seconds of the frames, with gaps perhaps.
    part : range
        The frames from which the clip is cut.
    fps : float
        Frames a second of the clip.

    Raises
    ------
    InputError
        When there would be more than `MOST_FRAMES`.
    """
    seconds = time[part.start : part.stop]
    count = (seconds[-1] - seconds[0]) * fps
    if count > MOST_FRAMES:
        found, fix = f"{count:.3g}", "Give a part of the take by --frames, or a lower --fps."
        raise InputError("clip", f"at most {MOST_FRAMES} frames", found, fix)
    moments = np.arange(seconds[0], seconds[-1] + 0.5 / fps, 1 / fps)
    return part.start + np.searchsorted((seconds[1:] + seconds[:-1]) / 2, moments)


def draw_clip(
    faces: Sequence[Face], frames: IntArray, pixels: int = PIXELS, video: FrameAt | None = None
) -> Iterator[Pixels]:
    """Pictures (H, W, 3) from 0 to 255 of some frames, one after the other, each with its number.

    Parameters
    ----------
    faces : sequence of Face
        With the same number of frames.
    frames : array of int, shape (n,)
    pixels : int
        Width and height of each face; even, as video wants it.
    video : callable, optional
        The performer's, to the left of the faces.

    Raises
    ------
    InputError
        When lengths do not fit together.
    """
    require_same_length(faces)
    cameras = frame_faces(faces, [int(frame) for frame in frames])
    with ThreadPoolExecutor(min(_AT_ONCE, os.cpu_count() or 1)) as pool:
        for start in range(0, len(frames), _AT_ONCE):
            numbers = frames[start : start + _AT_ONCE]
            strips = [
                pool.map(partial(_draw, face, camera, pixels), face.motion.fetch(numbers))
                for face, camera in zip(faces, cameras, strict=True)
            ]
            for frame, pictures in zip(numbers, zip(*strips, strict=True), strict=True):
                columns = [(f.label, p) for f, p in zip(faces, pictures, strict=True)]
                if video is not None:
                    filmed = video(float(faces[0].motion.time[frame]))
                    columns.insert(0, ("video", _squared(filmed, pixels)))
                yield _side_by_side(columns, frame_label(faces[0].motion, int(frame)))


def _draw(face: Face, camera: Camera, pixels: int, vertices: FloatArray) -> Pixels:
    """Draw one face on white."""
    picture = face.picture(vertices, camera, pixels)
    if picture is None:
        return np.full((pixels, pixels, 3), 255, dtype=np.uint8)
    on_white = 1 + picture[..., 3:] * (picture[..., :3] - 1)
    return np.round(255 * on_white).astype(np.uint8)


def _squared(filmed: Pixels | None, pixels: int) -> Pixels:
    """A frame of a video in the middle of a white square; all white where there is none."""
    square = Image.new("RGB", (pixels, pixels), "white")
    if filmed is not None:
        picture = ImageOps.contain(Image.fromarray(filmed), (pixels, pixels))
        square.paste(picture, ((pixels - picture.width) // 2, (pixels - picture.height) // 2))
    return np.asarray(square)


def _side_by_side(columns: Sequence[tuple[str, Pixels]], label: str) -> Pixels:
    pixels = len(columns[0][1])
    sheet = Image.new("RGB", (pixels * len(columns), pixels + CAPTION), "white")
    text, font = ImageDraw.Draw(sheet), ImageFont.load_default(14)
    names = [name for name, _ in columns]
    names[0] = f"{label}   {names[0]}"
    for place, (name, (_, picture)) in enumerate(zip(names, columns, strict=True)):
        sheet.paste(Image.fromarray(picture), (place * pixels, 0))
        middle = (place * pixels + pixels // 2, pixels + CAPTION // 2)
        text.text(middle, name, INK, font, anchor="mm")
    return np.asarray(sheet)

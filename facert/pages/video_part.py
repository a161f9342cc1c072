"""The performer's video on the stage, by the time of the take."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from facert.data.arrays import FloatArray
from facert.io.video_frames import VideoFrames
from facert.pages.stage import Part

if TYPE_CHECKING:
    from viser import ViserServer

_TOWARDS_FRONT = (0.0, 1.0, 0.0, 0.0)  # viser's pictures look the other way, with y downwards


class VideoPart(Part):
    """A picture of a video, as tall as a face or as wide.

    Parameters
    ----------
    server : ViserServer
    video : VideoFrames
    time : array, shape (T,)
        Seconds of the take's frames.
    """

    def __init__(self, server: ViserServer, video: VideoFrames, time: FloatArray) -> None:
        self._video, self._time = video, time
        first = video.at(video.start)
        picture = np.zeros((9, 16, 3), dtype=np.uint8) if first is None else first
        height, width = picture.shape[:2]
        corners = np.array([[0.0, 0.0, 0.0], [width, height, 0.0]])
        super().__init__(server, "video", corners)
        scale = 1.0 / max(width, height)
        self._image = server.scene.add_image(
            "/video/picture",
            picture,
            width * scale,
            height * scale,
            format="jpeg",
            wxyz=_TOWARDS_FRONT,
        )

    def draw(self, frame: int) -> None:
        """Show the picture at the time of a frame; none where the video has none."""
        picture = self._video.at(float(self._time[frame]))
        self._image.visible = picture is not None
        if picture is not None and picture is not self._image.image:
            self._image.image = picture

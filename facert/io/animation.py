"""Old animation of a character in any file: poses that no recorded frame belongs to."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from facert.data.take import Controls, Source, Take
from facert.errors import reading
from facert.io.formats import read_any, require_take
from facert.io.poses import numbers_frames, read_poses

ANY_RATE = 30.0
"""Frames a second of a file that states none: poses without a frame have no time."""


def read_animation(path: Path, target: str | None = None) -> Take:
    """Read poses: of a table that numbers frames, its rows in any order; else of a take.

    Raises `InputError` when the file cannot be read, or holds a rig.
    """
    with reading(path):
        if target is not None or not numbers_frames(path):
            found = read_any(path, target=target, kind="take", or_fps=ANY_RATE, sparse=True)
            return require_take(found, path)
        poses = read_poses(path)
        known = poses.values[~np.isnan(poses.values).any(axis=1)]
        time = np.arange(len(known), dtype=np.float64)
        source = Source(known, poses.names)
        return Take(time, source, Controls(poses.names, poses.limits), known)

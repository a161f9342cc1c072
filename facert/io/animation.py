"""Old animation of a character in any file: poses that no recorded frame belongs to."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from facert.data.take import Controls, Source, Take
from facert.errors import reading
from facert.io.formats import read_any, require_take
from facert.io.poses import read_poses

TABLES = (".csv", ".tsv", ".tab", ".json")
ANY_RATE = 30.0
"""Frames a second of a file that states none: poses without a frame have no time."""


def read_animation(path: Path, target: str | None = None) -> Take:
    """Read poses: rows of a table, with or without a column of frames or times; else of a take.

    Raises `InputError` when the file cannot be read, or holds a rig.
    """
    if target is not None or path.suffix.lower() not in TABLES:
        found = read_any(path, target=target, kind="take", or_fps=ANY_RATE)
        return require_take(found, path)
    poses = read_poses(path)
    with reading(path):
        known = poses.values[~np.isnan(poses.values).any(axis=1)]
        time = np.arange(len(known), dtype=np.float64)
        source = Source(known, poses.names)
        return Take(time, source, Controls(poses.names, poses.limits), known)

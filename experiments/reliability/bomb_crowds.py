"""Honest takes of very many markers: what takes the square of their number shows here."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.spatial import ConvexHull

from experiments.reliability.bomb_registry import BOMBS, Bomb
from facert.data.rig import Rig
from facert.io.rig import write_rig

RIG = "--rig DIR/rig.h5"
ALONE = ("clean FILE DIR/out.h5", "stabilise FILE DIR/out.h5", "suggest FILE -n 3",
         f"render FILE DIR/out.png {RIG}", "plot FILE DIR/out.png",
         "propagate FILE DIR/out.h5", "points suggest DIR/rig.h5 -n 5",
         "train FILE -o DIR/model.safetensors --method ridge",
         "retarget FILE DIR/out.h5 --model DIR/model.safetensors",
         "eval FILE --methods ridge --labels 10")  # fmt: skip


def crowd(folder: Path, markers: int, frames: int, gaps: float) -> Path:
    """Markers on a sphere that ten smooth factors move."""
    rng = np.random.default_rng(0)
    places = rng.normal(size=(markers, 3))
    places *= 100 / np.linalg.norm(places, axis=1, keepdims=True)
    near = [np.exp(-((places - one) ** 2).sum(axis=1) / 3200) for one in places[:10]]
    ways = 10 * np.stack(near)[:, :, None] * rng.normal(size=(10, 1, 3))
    time = np.arange(frames) / 25
    factors = np.sin(2 * np.pi * time[:, None] * rng.uniform(0.2, 1.5, 10) + np.arange(10))
    values = places + np.einsum("tk,kmi->tmi", factors, ways)
    values += 0.05 * rng.normal(size=values.shape)
    values[rng.random(values.shape[:2]) < gaps] = np.nan
    poses = factors[:, :2].copy()
    poses[np.arange(frames) % (frames // 12) > 0] = np.nan
    shapes = np.stack([np.outer(near[0], ways[0, 0]), np.outer(near[1], ways[1, 0])])
    hull = ConvexHull(places).simplices
    write_rig(Rig(places, shapes, ("a", "b"), hull), folder / "rig.h5")
    path = folder / "bomb.npz"
    names = np.array([f"m{i}" for i in range(markers)])
    source = {"markers": values.astype(np.float32), "marker_names": names, "fps": np.array(25.0)}
    np.savez(path, **source, poses=poses, pose_names=np.array(["a", "b"]))
    return path


for markers, frames, gaps in ((2_000, 300, 0.0), (2_000, 300, 0.01), (16_000, 12, 0.0)):
    name = f"crowd of {markers} markers in {frames} frames, {gaps:.0%} gaps"
    BOMBS[name] = Bomb(lambda folder, of=(markers, frames, gaps): crowd(folder, *of), ALONE)

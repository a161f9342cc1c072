"""Fixtures that every test may use."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

# Before NumPy is loaded: on small problems several threads only get in each other's way.
os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
import pytest
from hypothesis import settings

from facert.data.take import Controls, Source, Take

# How long an example takes depends on the machine and on what else it does. Every run draws the
# same examples; pytest --hypothesis-profile=random draws others, and `make fuzz` more of them.
settings.register_profile("facert", deadline=None, derandomize=True)
settings.register_profile("random", deadline=None)
settings.load_profile("facert")

DEFAULT_DATA = Path(__file__).resolve().parents[1].parent / "shared" / "data"


@pytest.fixture(autouse=True)
def level_of_log() -> None:
    """No level of facert's log that an earlier command has set for its process."""
    logging.getLogger("facert").setLevel(logging.NOTSET)


@pytest.fixture(scope="session")
def real_data() -> Path:
    """The folder of real recordings; tests that use it are marked `real`."""
    folder = Path(os.environ.get("FACERT_DATA", DEFAULT_DATA))
    if not (folder / "tracks").is_dir():
        pytest.skip(f"no real recordings in {folder}: set FACERT_DATA to their folder")
    return folder


@pytest.fixture(scope="session")
def make_take() -> Callable[..., Take]:
    """A synthetic take: a smooth walk in two dimensions moves markers and controls alike."""

    def make(
        frames: int = 60, posed: int = 12, animation: int = 20, markers: int = 5, seed: int = 0
    ) -> Take:
        rng = np.random.default_rng(seed)
        to_markers = rng.normal(size=(5, 3 * markers))
        to_controls = rng.normal(size=(5, 4)) / 4.0

        time = np.arange(frames) / 30.0
        walk = _walk(time)
        params = np.full((frames, 4), np.nan)
        labels = rng.permutation(frames)[:posed]
        params[labels] = (walk @ to_controls)[labels]
        others = _walk(rng.uniform(0.0, time[-1], animation)) @ to_controls
        return Take(
            time=time,
            source=Source(
                (walk @ to_markers).reshape(frames, markers, 3), [f"m{i}" for i in range(markers)]
            ),
            controls=Controls(["jaw", "smile", "brow", "blink"]),
            params=params if posed else None,
            animation=others if animation else None,
            units="cm",
        )

    return make


def _walk(time: np.ndarray) -> np.ndarray:
    """A walk in the plane with its products, (T, 5): what it moves, it moves nonlinearly."""
    a, b = np.sin(5.0 * time), np.cos(3.1 * time + 0.5)
    return np.stack([a, b, a * b, a * a, b * b], axis=1)


@pytest.fixture(scope="session")
def pose_few() -> Callable[[Take, int], Take]:
    """Makes the same take with so many of its poses, at random."""

    def make(truth: Take, count: int) -> Take:
        params = np.full_like(truth.params, np.nan)
        labels = np.random.default_rng(0).permutation(len(truth))[:count]
        params[labels] = truth.params[labels]
        return replace(truth, params=params)

    return make

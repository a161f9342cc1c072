"""A face that moves, and a head that moves it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from facert.data.take import Source, Take
from facert.mesh.rigid import RigidMotion


@pytest.fixture(scope="session")
def face() -> np.ndarray:
    """Markers (400, 20, 3): the first eight hardly move, the others by a few smooth factors."""
    rng = np.random.default_rng(0)
    places = rng.normal(size=(20, 3)) * [5.0, 7.0, 2.0]
    time = np.arange(400) / 30.0
    factors = np.sin(2 * np.pi * time[:, None] * [0.3, 0.5, 0.9, 1.4] + rng.uniform(0, 6, 4))
    motion = 0.5 * np.einsum("tk,kmi->tmi", factors, rng.normal(size=(4, 20, 3)))
    motion[:, :8] *= 0.01
    return places + motion


@pytest.fixture(scope="session")
def head() -> RigidMotion:
    """A head that turns up to some 20 degrees and wanders by some units."""
    time = np.arange(400) / 30.0
    way = np.sin(2 * np.pi * time[:, None] * [0.1, 0.17, 0.23, 0.11, 0.19, 0.3] + np.arange(6))
    return RigidMotion(Rotation.from_rotvec(0.2 * way[:, :3]).as_matrix(), 3.0 * way[:, 3:])


@pytest.fixture(scope="session")
def as_take() -> Callable[[np.ndarray], Take]:
    """A take of markers."""

    def make(markers: np.ndarray, units: str = "cm") -> Take:
        names = [f"m{i}" for i in range(markers.shape[1])]
        return Take(np.arange(len(markers)) / 30.0, Source(markers, names), units=units)

    return make

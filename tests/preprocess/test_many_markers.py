"""Scans of thousands of markers take memory and time in proportion to their markers."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

from facert.data.memory import VARIABLE
from facert.data.take import Source
from facert.models.gaussian import Gaussian, fill_gaps
from facert.preprocess.faults import find_faults
from facert.preprocess.head_motion import stable_markers

MEBIBYTE = 1 << 20


@pytest.fixture(scope="module")
def scan() -> np.ndarray:
    """A grid of 20 x 20 markers that some smooth factors move, (40, 400, 3)."""
    rng = np.random.default_rng(0)
    places = np.stack([*np.indices((20, 20)), np.zeros((20, 20))], axis=-1).reshape(-1, 3)
    ways = np.stack([np.exp(-((places - one) ** 2).sum(axis=1) / 60) for one in places[::90]])
    factors = np.sin(np.arange(40)[:, None] / 30 * rng.uniform(2, 9, len(ways)))
    return places + 0.4 * np.einsum("tk,km,i->tmi", factors, ways, [0.3, 0.2, 1.0])


def test_faults_among_many_markers_are_found_by_their_neighbours(
    scan: np.ndarray, monkeypatch: pytest.MonkeyPatch
) -> None:
    markers = scan.copy()
    markers[20, 130] += [0.0, 0.0, 6.0]
    markers[10:18, [57, 77]] = markers[10:18, [77, 57]]
    markers[25:, 333] = markers[25:, 20] + 0.2
    monkeypatch.setenv(VARIABLE, "40M")  # less than a covariance of 1200 coordinates takes
    found = find_faults(Source(markers, [f"m{i}" for i in range(400)]))
    assert found.spiked[20, 130]
    assert found.swapped[10:18, [57, 77]].all()
    assert found.strayed[26:, 333].all()
    assert found.any.sum() <= 1 + 16 + 15 + 2


def test_stable_markers_of_a_scan_are_sought_among_some(scan: np.ndarray) -> None:
    rng = np.random.default_rng(0)
    markers = np.tile(scan[:, :350], (1, 2, 1)) + 0.1 * rng.normal(size=(40, 700, 3))
    markers[:, 300:400] = markers[:1, 300:400]
    tracemalloc.start()
    try:
        chosen = stable_markers(markers)
        assert tracemalloc.get_traced_memory()[1] < 100 * MEBIBYTE
    finally:
        tracemalloc.stop()
    assert len(chosen) == 180
    assert np.isin(np.linspace(0, 699, 600).round()[260:340], chosen).all()


def test_gaps_of_many_columns_are_filled_by_those_beside(
    scan: np.ndarray, monkeypatch: pytest.MonkeyPatch
) -> None:
    X = scan.reshape(40, -1)[:, :600]
    gaps = np.random.default_rng(0).random(X.shape) < 0.02
    shown = np.where(gaps, np.nan, X)
    whole = Gaussian.of(shown).fill(shown)
    monkeypatch.setenv(VARIABLE, "8M")  # less than a covariance of all takes
    filled = fill_gaps(shown)
    np.testing.assert_array_equal(filled[~gaps], X[~gaps])
    errors = [np.sqrt(np.mean((one - X)[gaps] ** 2)) for one in (filled, whole)]
    assert errors[0] < 1.05 * errors[1]


def test_a_hidden_region_of_many_markers_is_filled_by_the_others() -> None:
    rng = np.random.default_rng(0)
    frames = rng.normal(size=(120, 6)) @ rng.normal(size=(6, 3 * 130))
    gappy = frames.copy()
    gappy[:60, : 3 * 70] = np.nan
    strays = (fill_gaps(gappy) - frames)[:60, : 3 * 70]
    assert np.sqrt(np.mean(strays**2)) < 0.3 * frames.std()

"""Long takes are mapped in parts, and one frame after the other in blocks."""

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

import facert
from facert.retarget import retargeter

NEAR = {"rtol": 1e-9, "atol": 1e-9}


@pytest.fixture(name="take", scope="module")
def _take(make_take):
    return make_take(frames=150, posed=12, animation=20)


@pytest.fixture(name="model", scope="module")
def _model(take):
    return facert.train(take, facert.Settings(method="ssgpr"))


@pytest.mark.parametrize("mode", ["offline", "online"])
def test_parts_make_the_same_take(take, model, mode, monkeypatch):
    whole = model.retarget(take, mode)
    monkeypatch.setattr(retargeter, "PART", 17)
    monkeypatch.setattr(retargeter, "TOGETHER", 7)
    parts = model.retarget(take, mode)
    np.testing.assert_allclose(parts.params, whole.params, **NEAR)
    np.testing.assert_allclose(parts.std, whole.std, **NEAR)
    np.testing.assert_allclose(parts.source.values, whole.source.values, **NEAR)


def test_memory_grows_with_frames_and_no_faster(take, model):
    """Four times as many frames: less than five times the memory beside what they hold."""
    most = []
    for times in (1, 4):
        values = np.tile(take.source.values, (times, 1, 1))
        rng = np.random.default_rng(times)
        values = values + 1e-3 * rng.standard_normal(values.shape)
        long = replace(
            take,
            time=np.arange(len(values)) / 60.0,
            source=replace(take.source, values=values),
            params=None,
        )
        tracemalloc.start()
        model.retarget(long)
        most.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert most[1] < 5 * most[0]

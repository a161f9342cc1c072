"""The same training gives the same model file, byte by byte, at any time."""

from __future__ import annotations

import time

import pytest

import facert
from facert import Settings
from facert.data.regions import Region, Regions
from facert.methods.registry import REGISTRY

YEAR = 365.0 * 86400.0
SMALL = {"latent_dim": 2, "neighbours": 3, "max_iterations": 20, "unlabelled": 8}


@pytest.fixture(name="take", scope="module")
def _take(make_take):
    return make_take(frames=24, posed=9, animation=8, markers=4)


def regions(take):
    markers, controls = take.source.names, take.controls.names
    upper, lower = (
        Region("upper", markers[:2], controls[:2]),
        Region("lower", markers[2:], controls[2:]),
    )
    return Regions((upper, lower))


@pytest.mark.parametrize(
    ("method", "apart"), [*((name, False) for name in REGISTRY), ("ridge", True)]
)
def test_a_model_trained_twice_is_the_same_file(take, tmp_path, monkeypatch, method, apart):
    settings = Settings(method=method, regions=regions(take) if apart else None, **SMALL)
    files = [tmp_path / name for name in ("one.safetensors", "two.safetensors")]
    facert.train(take, settings).save(files[0])
    now = time.time
    monkeypatch.setattr(time, "time", lambda: now() + YEAR)
    trained = facert.train(take, settings)
    assert trained.figures["seconds"] > 0.0
    trained.save(files[1])
    assert files[0].read_bytes() == files[1].read_bytes()

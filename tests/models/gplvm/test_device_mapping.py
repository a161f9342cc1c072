"""The formulas on a torch device, against those in NumPy; on a GPU as well where there is one."""

import numpy as np
import pytest
import torch

from facert.models.gp.posterior import Posterior
from facert.models.gplvm import source_mapping
from facert.models.gplvm.source_mapping import Observation, SourceMapping
from facert.models.gplvm.target_mapping import map_to_target
from facert.models.kernels import KERNELS

DEVICES = [
    "cpu",
    pytest.param(
        "cuda", marks=pytest.mark.skipif(not torch.cuda.is_available(), reason="needs a GPU")
    ),
]


def make_view(columns, noise, seed, kernel):
    rng = np.random.default_rng(seed)
    Z = np.random.default_rng(0).normal(size=(30, 3))
    return Posterior(Z, np.sin(Z @ rng.normal(size=(3, columns))), kernel(1.3, 0.4, noise))


@pytest.fixture(scope="module", params=KERNELS)
def source(request):
    return make_view(12, 0.01, 1, KERNELS[request.param])


@pytest.fixture(scope="module")
def observed(source):
    rng = np.random.default_rng(2)
    frames = source.predict(rng.normal(size=(40, 3))).mean + rng.normal(0.0, 0.05, (40, 12))
    frames[rng.random(frames.shape) < 0.3] = np.nan
    return Observation.of(frames, 0.05)


@pytest.fixture(params=DEVICES)
def device(request):
    return torch.device(request.param)


def test_the_objective_and_its_derivatives_are_the_same(source, observed, device):
    z = np.random.default_rng(3).normal(size=(40, 3))
    plain, there = SourceMapping(source), SourceMapping(source.on(device))
    here, away = plain._expand(z, observed), there._expand(z, observed)
    for name in ("energy", "gradient", "hessian"):
        ours, theirs = getattr(away, name), getattr(here, name)
        np.testing.assert_allclose(ours, theirs, rtol=0.0, atol=1e-12 * np.abs(theirs).max())
    for ours, theirs in zip(there._look(z, observed), plain._look(z, observed), strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=1e-12, atol=1e-12)
    np.testing.assert_array_equal(there.start(observed), plain.start(observed))


@pytest.mark.parametrize("chunk", [7, 4096])
def test_frames_end_at_the_same_optimum_however_they_are_cut(
    source, observed, device, chunk, monkeypatch
):
    monkeypatch.setattr(source_mapping, "DEVICE_CHUNK", chunk)
    plain = SourceMapping(source).solve(observed)
    there = SourceMapping(source.on(device)).solve(observed)
    assert there.converged.all()
    for name in ("z", "x", "energy"):
        ours, theirs = getattr(there, name), getattr(plain, name)
        np.testing.assert_allclose(ours, theirs, rtol=1e-8, atol=1e-8)


@pytest.mark.parametrize("chunk", [7, 4096])
def test_poses_and_their_spread_are_the_same(source, observed, device, chunk, monkeypatch):
    monkeypatch.setattr(source_mapping, "DEVICE_CHUNK", chunk)
    target = make_view(5, 0.05, 4, type(source.kernel))
    mapped = SourceMapping(source).solve(observed)
    there = map_to_target(target.on(device), mapped)
    for ours, theirs in zip(there, map_to_target(target, mapped), strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=1e-12, atol=1e-12)

"""The regression of propagation, written out from its formula, point by point."""

import numpy as np
import pytest

from facert.topology import local_ridge as room
from facert.topology.affine import scaled_source
from facert.topology.keyed import KeyedPerformance, even_keys
from facert.topology.local_ridge import _trusts, local_ridge

FRAMES, POINTS = 30, 5


@pytest.fixture
def take():
    """Points that move smoothly, and a target that follows nonlinearly."""
    rng = np.random.default_rng(0)
    walk = np.sin(np.arange(FRAMES)[:, None] / 30.0 * [2.0, 3.1, 4.3] + rng.uniform(0, 6, 3))
    rest, shapes = 3.0 * rng.normal(size=(POINTS, 3)), rng.normal(size=(3, POINTS, 3))
    source = rest + np.tensordot(walk, shapes, axes=1)
    target = 2.0 * (rest + np.tensordot(walk + 0.3 * walk**2, shapes, axes=1))
    keys = even_keys(FRAMES, 4)
    return KeyedPerformance(source, keys, target[keys])


def weights(take):
    """w_pq: it falls with the distance at rest, within .3 of the face's radius, to .003."""
    rest = take.source.mean(axis=0)
    radius = np.sqrt(np.mean(np.sum((rest - rest.mean(axis=0)) ** 2, axis=1)))
    away = np.linalg.norm(rest[:, None] - rest, axis=2) / radius
    return np.exp(-away / 0.3) + 0.003


def kernel_ridge(take, first, w, curvature, penalty):
    """y = first + c + k(t, keys) (k(keys, keys) + λ)⁻¹ (Ŷ - first - c) with one λ and one κ."""
    keys, centred = take.keys, take.source - take.source[take.keys].mean(axis=0)
    left = take.labels[:, 0] - first[keys]
    linear = np.einsum("q,tqc,uqc->tu", w, centred, centred)
    size, own = linear[keys, keys].mean(), linear.diagonal()
    squared = (own[:, None] + own - 2.0 * linear) / size
    k = (linear / size + curvature * np.exp(-squared / (2.0 * 2.0**2)))[:, keys]
    k = k - k.mean(axis=1, keepdims=True)  # no mean over the keys, as x(t) has none
    k = k - k[keys].mean(axis=0)
    solved = np.linalg.solve(k[keys] + penalty * np.eye(len(keys)), left - left.mean(axis=0))
    return first + left.mean(axis=0) + k @ solved


@pytest.mark.parametrize(("curvature", "penalty"), [(0.3, 1e-2), (0.03, 1e-4), (5.0, 1e-3)])
def test_a_regression_with_one_penalty_and_one_curvature_is_its_formula(
    take, curvature, penalty, monkeypatch
):
    monkeypatch.setattr(room, "CURVATURES", (curvature,))
    monkeypatch.setattr(room, "PENALTIES", (penalty,))
    monkeypatch.setattr(room, "trust_in_path", lambda *_: 0.0)
    found, scaled, w = local_ridge(take), scaled_source(take), weights(take)
    for p in range(POINTS):
        own = KeyedPerformance(take.source, take.keys, take.labels[:, p : p + 1])
        expected = kernel_ridge(own, scaled[:, p], w[p], curvature, penalty)
        np.testing.assert_allclose(found[:, p], expected, atol=1e-8)
        # The controls of a rig follow all points alike, from their mean.
        nothing = np.zeros((FRAMES, 3))
        expected = kernel_ridge(own, nothing, np.ones(POINTS), curvature, penalty)
        np.testing.assert_allclose(local_ridge(own)[:, 0], expected, atol=1e-8)


def test_a_regression_is_trusted_less_the_more_it_misses_and_more_so_with_many_keys():
    """By the power K/10 of the errors."""
    errors = np.array([[1.0, 2.0], [4.0, 8.0]])
    for keys in (5, 10, 40):
        shares = _trusts(errors, keys)
        assert shares.sum() == pytest.approx(1.0)
        np.testing.assert_allclose(shares[0, 0] / shares, errors ** (keys / 10.0))

"""What other units, the last digits or the seed change in training is not seen in the poses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import facert
from facert import Settings
from facert.methods.registry import REGISTRY

SMALL = {"latent_dim": 3, "neighbours": 5, "unlabelled": 50}


@pytest.fixture(name="take", scope="module")
def _take(make_take):
    return make_take(frames=24, posed=9, animation=12)


def poses(take, method, scale=1.0, seed=0):
    model = facert.train(take, Settings(method=method, seed=seed, **SMALL))
    return model.retarget(take).params / scale


def changed(take, markers, controls):
    return replace(
        take,
        source=take.source.with_matrix(markers * take.source.matrix),
        params=controls * take.params,
        animation=controls * take.animation,
    )


@pytest.fixture(name="usual", scope="module", params=REGISTRY)
def _usual(request, take):
    return request.param, poses(take, request.param)


def assert_same(found, expected):
    assert (np.abs(found - expected) / np.ptp(expected, axis=0)).max() < 1e-4


@pytest.mark.parametrize(("markers", "controls"), [(2.54, 1e6), (1e6, 2.54)])
def test_other_units_make_no_difference(take, usual, markers, controls):
    method, expected = usual
    assert_same(poses(changed(take, markers, controls), method, controls), expected)


def test_the_last_digits_make_no_difference(take, usual):
    method, expected = usual
    rng = np.random.default_rng(0)
    noise = 1.0 + 1e-12 * rng.standard_normal(take.source.matrix.shape)
    assert_same(poses(changed(take, noise, 1.0), method), expected)


def test_another_seed_makes_no_difference_where_nothing_is_drawn(take, usual):
    """All unlabelled frames and poses are learned from."""
    method, expected = usual
    assert_same(poses(take, method, seed=1), expected)

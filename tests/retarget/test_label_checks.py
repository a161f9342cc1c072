"""Mistakes that would go unnoticed are told."""

from __future__ import annotations

import logging
from dataclasses import replace

import numpy as np
import pytest

import facert
from facert.errors import InputError
from facert.methods.base import Labelled, Unlabelled
from facert.methods.registry import make_method
from facert.retarget.label_checks import CONSTANT, check_poses, warn_if_constant
from facert.settings import Settings


@pytest.fixture(name="predicted")
def _predicted(make_take):
    """What retargeting gives: a pose and its standard deviation for every frame."""
    take = make_take(posed=60, animation=0)
    return replace(take, std=np.full_like(take.params, 0.1))


def test_a_result_is_not_learned_from(predicted) -> None:
    with pytest.raises(InputError, match=r"/target/std: .* for all 60: a model predicted them"):
        check_poses(predicted)
    check_poses(replace(predicted, std=None))


def test_a_few_predicted_poses_among_labels_are_told(predicted, caplog) -> None:
    std = predicted.std.copy()
    std[::2] = np.nan  # set by somebody
    std[1] = 0.0  # given exactly
    check_poses(replace(predicted, std=std))
    assert "29 poses with a standard deviation" in caplog.text
    caplog.clear()
    check_poses(replace(predicted, std=np.zeros_like(std)))
    assert not caplog.records


def test_a_take_without_poses_has_nothing_to_check(predicted) -> None:
    check_poses(replace(predicted, params=None))


@pytest.mark.parametrize("name", ["auto", "gpr", "ridge", "nearest"])
def test_a_model_that_learned_needs_no_word(make_take, name: str, caplog) -> None:
    caplog.set_level(logging.WARNING, "facert")
    take = make_take(frames=60, posed=30, animation=0)
    model = facert.train(take, Settings(method=name))
    caplog.clear()
    frames = model.source_units.apply(take.source.matrix)
    warn_if_constant(model.method, frames, model.target_units.apply(take.params[take.labels]))
    assert not caplog.records


def test_a_model_of_labels_that_frames_do_not_tell_apart_is_constant(caplog) -> None:
    """Poses at random: the most likely Gaussian process takes them for noise about their mean."""
    rng = np.random.default_rng(1)
    X, Y = rng.normal(size=(40, 30)), rng.normal(size=(8, 5))
    method = make_method(Settings(method="gpr"))
    method.fit(Labelled(X[:8], Y), Unlabelled(X[8:], Y[:0]))
    said = method.predict(X).Y
    assert said.std() < CONSTANT * Y.std()
    warn_if_constant(method, X, Y)
    assert "nearly the same pose of every frame" in caplog.text


def test_it_looks_at_a_part_of_many_frames(caplog) -> None:
    rng = np.random.default_rng(0)
    X = rng.normal(size=(2003, 3))
    method = make_method(Settings(method="ridge"))
    method.fit(Labelled(X[:20], X[:20]), Unlabelled(X[:0], X[:0]))
    warn_if_constant(method, X, X[:20])
    assert not caplog.records

"""Methods that learned next to nothing are warned about."""

from __future__ import annotations

import logging

import numpy as np
import pytest

import facert
from facert.methods.base import Labelled, Unlabelled
from facert.methods.registry import make_method
from facert.regions.learning import CONSTANT, warn_if_constant
from facert.settings import Settings


@pytest.mark.parametrize("name", ["auto", "gpr", "ridge", "nearest"])
def test_a_model_that_learned_is_not_warned_about(make_take, name: str, caplog) -> None:
    caplog.set_level(logging.WARNING, "facert")
    take = make_take(frames=60, posed=30, animation=0)
    model = facert.train(take, Settings(method=name))
    caplog.clear()
    frames = model.source_units.apply(take.source.matrix)
    warn_if_constant(model.method, frames, model.target_units.apply(take.params[take.labels]))
    assert not caplog.records


def test_a_model_of_labels_that_frames_do_not_explain_is_constant(caplog) -> None:
    """Poses at random: the most likely Gaussian process takes them for noise about their mean."""
    rng = np.random.default_rng(1)
    X, Y = rng.normal(size=(40, 30)), rng.normal(size=(8, 5))
    method = make_method(Settings(method="gpr"))
    method.fit(Labelled(X[:8], Y), Unlabelled(X[8:], Y[:0]))
    predicted = method.predict(X).Y
    assert predicted.std() < CONSTANT * Y.std()
    warn_if_constant(method, X, Y)
    assert "nearly the same pose for every frame" in caplog.text
    assert "Another method (auto), or more poses, may help" in caplog.text


def test_users_of_auto_are_not_advised_to_try_auto(caplog) -> None:
    method = make_method(Settings(method="auto"))
    X = np.random.default_rng(1).normal(size=(20, 4))
    method.fit(Labelled(X, 1.0 + 0.0 * X), Unlabelled(X, X[:0]))
    warn_if_constant(method, X, X)
    assert "nearly the same pose" in caplog.text
    assert "auto" not in caplog.text


def test_it_looks_at_a_part_of_many_frames(caplog) -> None:
    rng = np.random.default_rng(0)
    X = rng.normal(size=(2003, 3))
    method = make_method(Settings(method="ridge"))
    method.fit(Labelled(X[:20], X[:20]), Unlabelled(X[:0], X[:0]))
    warn_if_constant(method, X, X[:20])
    assert not caplog.records

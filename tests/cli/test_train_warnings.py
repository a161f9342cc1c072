"""``facert train`` warns of what it has no use for."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import facert as package


@pytest.fixture(name="take")
def _take(make_take, tmp_path: Path) -> Path:
    package.write_take(make_take(), tmp_path / "take.h5")
    return tmp_path / "take.h5"


def test_settings_of_the_shared_models_are_named_in_one_line_for_others(facert, take: Path) -> None:
    config = take.with_name("config.toml")
    config.write_text("tolerance = 1e-3\n")
    given = ("--latent-dim", 4, "--optimizer", "scg", "--config", config)
    done = facert("train", take, "-o", take.with_name("a.safetensors"), "--method", "ridge", *given)
    assert done.code == 0
    warning = "ridge does not use latent_dim, optimizer, tolerance: settings of the shared models"
    assert done.err.count(warning) == done.err.count("latent_dim") == 1


def test_settings_that_are_used_need_no_word(facert, take: Path) -> None:
    config = take.with_name("config.toml")
    config.write_text("max_iterations = 3\n")
    model = take.with_name("a.safetensors")
    given = ("--method", "sgplvm", "--latent-dim", 2, "--config", config)
    done = facert("train", take, "-o", model, *given)
    assert done.code == 0, done.err
    assert "does not use" not in done.err
    assert "does not use" not in facert("train", take, "-o", model, "--overwrite").err


def test_poses_that_a_model_predicted_are_learned_from_when_asked(facert, make_take, take) -> None:
    posed = make_take(posed=60)
    result = replace(posed, std=np.full_like(posed.params, 0.1))
    package.write_take(result, take, overwrite=True)
    model = take.with_name("a.safetensors")
    done = facert("train", take, "-o", model, "--method", "ridge", "--allow-predicted")
    assert done.code == 0
    assert "deviation" not in done.err

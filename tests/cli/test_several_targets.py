"""Takes in .npz files with several targets, where a command needs one of them or none."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import facert as package
from facert.data.take import Take


@pytest.fixture(name="truth")
def _truth(make_take) -> Take:
    return make_take(frames=60, posed=60, animation=0)


@pytest.fixture(name="track")
def _track(truth: Take, tmp_path: Path) -> Path:
    """The same take for two characters, of which the second has other controls."""
    path = tmp_path / "track.npz"
    np.savez(
        path, markers=truth.source.values, marker_names=truth.source.names, time=truth.time,
        mine=truth.params, mine_names=truth.controls.names,
        other=truth.params[:, :2], other_names=["left", "right"],
    )  # fmt: skip
    return path


@pytest.fixture(name="model")
def _model(truth: Take, tmp_path: Path) -> Path:
    path = tmp_path / "model.safetensors"
    package.train(truth, package.Settings(method="ridge", labels=20)).save(path)
    return path


def test_inspect_lists_them(facert, track: Path) -> None:
    shown = facert("inspect", track, "--json")
    assert shown.code == 0
    facts = json.loads(shown.out)
    assert facts["controls_of_targets"] == {"mine": 4, "other": 2}
    assert facts["target"] is None
    assert "--target" in shown.err
    assert "mine" in facert("inspect", track).out


def test_inspect_shows_the_one_that_is_asked_for(facert, track: Path) -> None:
    facts = json.loads(facert("inspect", track, "--target", "other", "--json").out)
    assert facts["target"]["names"] == ["left", "right"]
    assert "controls_of_targets" not in facts


def test_retarget_compares_with_that_of_its_model(facert, track: Path, model: Path) -> None:
    done = facert("retarget", track, track.with_name("out.h5"), "-m", model)
    assert done.code == 0, done.err
    assert "RMS against" in done.out
    assert "the model's is mine" in done.err


def test_retarget_does_without_the_truth(facert, truth: Take, track: Path, tmp_path: Path) -> None:
    names = [f"another {name}" for name in truth.controls.names]
    renamed = replace(truth, controls=package.Controls(names))
    package.train(renamed, package.Settings(method="ridge")).save(tmp_path / "m.safetensors")
    done = facert("retarget", track, tmp_path / "out.h5", "-m", tmp_path / "m.safetensors")
    assert done.code == 0, done.err
    assert "RMS" not in done.out
    assert "has several targets (mine, other): none is read" in done.err


def test_suggest_and_clean_need_none(facert, track: Path, tmp_path: Path) -> None:
    assert facert("suggest", track, "-n", 3).code == 0
    assert facert("clean", track, tmp_path / "clean.h5").code == 0
    assert package.read_take(tmp_path / "clean.h5").params is None


def test_poses_are_asked_for_where_they_are_needed(facert, track: Path) -> None:
    for command in (("suggest", track, "--have", "labels"), ("train", track), ("eval", track)):
        refused = facert(*command)
        assert refused.code == 3
        assert "--target: expected one of: mine, other" in refused.err

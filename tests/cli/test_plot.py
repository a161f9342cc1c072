"""Curves are drawn over the truth of the same take."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from facert.data.take import Controls, Take
from facert.io.take import write_take


@pytest.fixture(name="take")
def _take(make_take) -> Take:
    return make_take(frames=40, posed=40, animation=0)


@pytest.fixture(name="path")
def _path(take: Take, tmp_path: Path) -> Path:
    path = tmp_path / "shot.h5"
    write_take(take, path)
    return path


def stored(take: Take, path: Path, **targets: tuple[np.ndarray, list[str]]) -> Path:
    arrays = {key: values for key, (values, _) in targets.items()}
    names = {f"{key}_names": found for key, (_, found) in targets.items()}
    np.savez(
        path, markers=take.source.values, marker_names=take.source.names, time=take.time,
        **arrays, **names,
    )  # fmt: skip
    return path


def test_the_target_is_chosen_in_the_file_that_has_several(facert, take, path, tmp_path) -> None:
    others = (take.params[:, :1], ["other"])
    mine = (take.params, list(take.controls.names))
    truth = stored(take, tmp_path / "truth.npz", mine=mine, theirs=others)
    picture = tmp_path / "curves.png"
    done = facert("plot", path, picture, "--truth", truth, "--target", "mine")
    assert done.code == 0, done.err
    assert "4 controls" in done.out
    refused = facert("plot", path, tmp_path / "b.png", "--truth", truth, "--target", "theirs")
    assert refused.code == 3
    assert f"{truth}: --truth: expected poses of some of the take's controls" in refused.err
    refused = facert("plot", path, tmp_path / "b.png", "--target", "mine")
    assert (refused.code, "--target" in refused.err) == (3, True)


def test_what_only_one_of_them_has_is_not_drawn(facert, take, path, tmp_path) -> None:
    truth = tmp_path / "truth.h5"
    write_take(replace(take, controls=Controls(["jaw", "Smile", "x", "y"])), truth)
    done = facert("plot", path, tmp_path / "curves.png", "--truth", truth)
    assert "2 controls" in done.out
    assert "not compared: x, y (only in the truth); brow, blink (only" in done.err
    options = ("--truth", truth, "--controls", "brow")
    refused = facert("plot", path, tmp_path / "b.png", *options)
    assert refused.code == 3
    assert f"{truth}: --truth: expected poses of 'brow', found none" in refused.err


def test_the_truth_of_another_take_is_refused(facert, make_take, path, tmp_path) -> None:
    other = tmp_path / "other.h5"
    write_take(make_take(frames=80, posed=80, animation=0), other)
    refused = facert("plot", path, tmp_path / "curves.png", "--truth", other)
    assert refused.code == 3
    assert f"{other}: --truth: expected 40 frames, found 80" in refused.err
    assert not (tmp_path / "curves.png").exists()


def test_names_of_controls_are_drawn_as_text(tmp_path, make_take, facert):
    """No mathematics, which may be wrong, and no longer than leaves room for curves."""
    take = make_take(frames=20, posed=20)
    assert take.controls is not None
    names = (r"$\frac{$", "x" * 200, *take.controls.names[2:])
    path = tmp_path / "a.h5"
    write_take(replace(take, controls=replace(take.controls, names=names)), path)
    done = facert("plot", path, tmp_path / "a.png")
    assert (done.code, (tmp_path / "a.png").exists()) == (0, True)
    assert "UserWarning" not in done.err

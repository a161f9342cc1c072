"""``facert train``, ``suggest`` and ``eval`` with several takes, and old animation."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import facert as api
from facert.data.take import Controls, Source

PLAIN = ("--method", "nearest", "--no-smooth", "--no-detect")


@pytest.fixture(name="files")
def _files(make_take, tmp_path: Path) -> list[Path]:
    """A posed take, and a second one without a pose."""
    takes = make_take(animation=0), replace(make_take(frames=40, animation=0), params=None)
    paths = [tmp_path / "a.h5", tmp_path / "b.h5"]
    for take, path in zip(takes, paths, strict=True):
        api.write_take(take, path)
    return paths


def test_a_model_is_trained_on_several_takes_and_old_animation(facert, files, tmp_path):
    names = api.read_take(files[0]).controls.names
    header, rows = ",".join(["time", *names]), ["0,0,0,0,0", "0.5,1,1,1,1", "1,.5,0,.5,.2"]
    (tmp_path / "old.csv").write_text("\n".join([header, *rows]) + "\n")
    model = tmp_path / "model.safetensors"
    old = ("--animation", tmp_path / "old.csv", "--animation", files[0])
    done = facert("train", *files, *old, *PLAIN, "-o", model)
    assert done.code == 0, done.err
    assert "old.csv: 3 poses of old animation" in done.err
    assert "a.h5: 12 poses of old animation" in done.err
    figures = api.load(model).figures
    assert figures["takes"] == "a.h5 (12 poses), b.h5 (0 poses)"
    assert "b.h5 (0 poses)" in " ".join(done.out.split())


def test_each_take_names_its_rest(facert, files, tmp_path):
    model = tmp_path / "model.safetensors"
    rest = ("--neutral", "b.h5:3", "--neutral", "a.h5:0..4")
    assert facert("train", *files, *PLAIN, *rest, "-o", model).code == 0
    assert api.load(model).settings.neutral == "b.h5:3; a.h5:0..4"
    unknown = facert("train", *files, *PLAIN, "--neutral", "c.h5:3", "-o", model, "--overwrite")
    assert unknown.code == 3
    assert "neutral: expected one of a.h5, b.h5, found 'c.h5'" in unknown.err


def test_messages_name_the_file_that_they_are_about(facert, files, tmp_path):
    take = api.read_take(files[1])
    values = take.source.values.copy()
    values[3, 0] = 0.0
    api.write_take(replace(take, source=Source(values, take.source.names)), files[1], True)
    model = tmp_path / "model.safetensors"
    done = facert("train", *files, "--method", "nearest", "--no-smooth", "-o", model)
    assert "b.h5: bad markers, taken as not observed: 1 zero" in done.err
    other = tmp_path / "c.h5"
    controls = Controls(["jaw", "smile", "brow", "blnk"])
    api.write_take(replace(api.read_take(files[0]), controls=controls), other)
    refused = facert("train", files[0], other, *PLAIN, "-o", model, "--overwrite")
    assert refused.code == 3
    assert "c.h5: /target/names: expected the name 'blink'" in refused.err
    assert "Did you mean 'blnk'?" in refused.err


def test_suggested_frames_are_named_by_file_and_number(facert, files, tmp_path):
    sheet = tmp_path / "sheet.png"
    done = facert("suggest", *files, "-n", 2, "--have", "labels", "--json", "--sheet", sheet)
    assert done.code == 0, done.err
    found = json.loads(done.out)
    assert found["files"] == [str(path) for path in files]
    for row in found["frames"]:
        assert row["name"] == f"{row['file']}:{row['frame']}"
    assert {row["file"] for row in found["frames"]} <= {"a.h5", "b.h5"}
    assert sheet.exists()
    row = found["frames"][0]
    shown = facert("suggest", *files, "-n", 2, "--have", "labels").out
    assert row["name"] in shown
    assert f"in order of time, {row['file']}: " in shown
    assert facert("suggest", *files, "--video", files[0], "--sheet", sheet).code == 2


def test_methods_are_compared_over_all_takes(facert, make_take, files, tmp_path):
    api.write_take(make_take(frames=40, posed=40, animation=0), files[1], True)
    figures = tmp_path / "figures.json"
    few = ("--methods", "nearest", "--repeats", 1, "--labels", "5", "--unlabelled", 0)
    done = facert("eval", *files, *few, "--jobs", 1, "--json", figures)
    assert done.code == 0, done.err
    assert "a.h5 and b.h5" in done.out
    settings = json.loads(figures.read_text())["settings"]
    assert settings["frames"] == 100
    assert settings["take"] == f"{files[0]}, {files[1]}"


def test_old_animation_needs_no_rate(facert, files, tmp_path):
    values = np.random.default_rng(0).random((9, 4))
    names = api.read_take(files[0]).controls.names
    np.savez(tmp_path / "old.npz", weights=values, weight_names=list(names))
    model = tmp_path / "model.safetensors"
    done = facert("train", files[0], "--animation", tmp_path / "old.npz", *PLAIN, "-o", model)
    assert "old.npz: 9 poses of old animation" in done.err, done.err

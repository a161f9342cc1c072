"""What is read is never written over, and forgotten options are named."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import facert as package

TABLE = "time,jawOpen,smile\n0,0.1,0.2\n0.5,0.3,0.4\n1,0.5,0.6\n"


@pytest.fixture(name="table")
def _table(tmp_path: Path) -> Path:
    path = tmp_path / "take.csv"
    path.write_text(TABLE)
    return path


@pytest.mark.parametrize("command", ["convert", "clean", "retarget"])
@pytest.mark.parametrize("link", [None, os.symlink, os.link])
def test_a_file_never_takes_its_own_place(facert, table: Path, command: str, link) -> None:
    output = table
    if link is not None:
        output = table.with_name("linked.csv")
        link(table, output)
    for overwrite in ([], ["--overwrite"]):
        refused = facert(command, table, output, *overwrite)
        assert refused.code == 3
        assert "OUT: expected another file than IN" in refused.err
    assert table.read_text() == TABLE


def test_nor_does_a_link_in_another_folder(facert, table: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    out.mkdir()
    os.link(table, out / "take.csv")
    done = facert("convert", table, "--out-dir", out, "--ending", ".csv", "--overwrite")
    assert done.code == 3
    assert table.read_text() == TABLE


def test_nor_is_another_file_that_is_read_lost(facert, table: Path, tmp_path: Path) -> None:
    poses = tmp_path / "poses.csv"
    poses.write_text("frame,jaw\n0,0.5\n")
    refused = facert("convert", table, poses, "--poses", poses, "--overwrite")
    assert refused.code == 3
    assert f"{poses}: OUT: expected another file than" in refused.err
    assert poses.read_text() == "frame,jaw\n0,0.5\n"


def test_two_takes_without_a_folder_get_its_option_named(facert, table: Path) -> None:
    other = table.with_name("other.csv")
    other.write_text(TABLE)
    refused = facert("retarget", table, other)
    assert refused.code == 3
    message = " ".join(refused.err.split())
    assert "Give another name, or delete it yourself; for two takes, --out-dir DIR." in message
    assert other.read_text() == TABLE
    take = package.read_take(other)
    package.write_take(take, first := table.with_name("first.h5"))
    package.write_take(take, second := table.with_name("second.h5"))
    refused = facert("retarget", first, second)
    assert refused.code == 2
    message = " ".join(refused.err.split())
    assert "the file exists. Give another name, or --overwrite; for two takes, --out-dir" in message


def test_a_model_that_is_not_there_gets_its_option_named(facert, table: Path) -> None:
    refused = facert("retarget", table, table.with_name("out.h5"), "-m", "none.safetensors")
    assert refused.code == 3
    assert "model: expected a file that train wrote, found nothing" in refused.err
    assert "-m" in refused.err


def test_poses_that_a_model_predicted_are_no_labels(facert, make_take, tmp_path: Path) -> None:
    take, result = tmp_path / "take.h5", tmp_path / "result.h5"
    posed = make_take(frames=20, posed=20, animation=0)
    package.write_take(posed, take)
    package.write_take(replace(posed, std=np.full((20, 4), 0.1)), result)
    refused = facert("convert", take, tmp_path / "out.h5", "--poses", result)
    assert refused.code == 3
    assert "a model predicted all" in refused.err
    table = tmp_path / "result.csv"
    assert facert("convert", result, table).code == 0  # the way out that the message names
    assert facert("convert", take, tmp_path / "out.h5", "--poses", table).code == 0

"""``facert report`` as a user calls it."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

import facert as api
from facert.data import Rig


@pytest.fixture
def folder(make_take, tmp_path):
    """A model, a retargeted take, its truth, a rig, and things that are none of it."""
    truth = make_take(posed=60)
    model = api.train(make_take(), api.Settings(method="gpr"))
    model.save(tmp_path / "model.safetensors")
    api.write_take(replace(truth, animation=None), tmp_path / "truth.h5")
    result = model.retarget(truth)
    api.write_take(result, tmp_path / "result.h5")
    rng = np.random.default_rng(0)
    faces = np.array([[0, 1, 2], [1, 2, 3]])
    shapes = rng.normal(size=(4, 4, 3))
    rig = Rig(rng.normal(size=(4, 3)), shapes, truth.controls.names, faces)
    from facert.io.rig import write_rig

    write_rig(rig, tmp_path / "rig.h5")
    (tmp_path / "other.json").write_text("{}")
    (tmp_path / "other.h5").write_bytes(b"nothing")
    (tmp_path / "notes.txt").write_text("mine")
    return tmp_path


def test_a_folder_becomes_a_page_with_all_that_is_in_it(facert, folder) -> None:
    page = folder / "page.html"
    done = facert("report", folder, "-o", page)
    assert done.code == 0, done.err
    text = page.read_text()
    assert text.count("<section") == 2
    assert "Performance: result.h5" in text
    assert "Model: model.safetensors" in text
    assert text.count("data:image/png") == text.count("data:image/svg+xml") == 1
    assert "RMS to the truth" in text
    assert "other.json" in done.err
    assert "2 sections" in done.out


def test_files_can_be_named_one_by_one(facert, folder) -> None:
    page = folder / "page.html"
    asked = ("report", folder / "result.h5", "--title", "Tuesday <3", "-o", page)
    assert facert(*asked).code == 0
    assert "<h1>Tuesday &lt;3</h1>" in page.read_text()
    assert facert(*asked).code == 2
    assert facert(*asked, "--rig", folder / "rig.h5", "--overwrite").code == 0
    assert "data:image/png" in page.read_text()


def test_what_eval_writes_can_be_reported(facert, folder) -> None:
    written, page = folder / "eval.json", folder / "page.html"
    grid = ("--labels", "5,8", "--unlabelled", 0, "--repeats", 1, "--methods", "ridge,nearest")
    done = facert("eval", folder / "truth.h5", *grid, "--jobs", 1, "--json", written)
    assert done.code == 0, done.err
    assert facert("report", written, "-o", page).code == 0
    shown = page.read_text()
    for entry in json.loads(written.read_text())["rows"]:
        assert f"<td>{entry['rms']:.4f}</td>" in shown


@pytest.mark.parametrize(
    ("result", "output", "code", "message"),
    [
        ("none.h5", "page.html", 3, "none.h5"),
        ("other.json", "page.html", 3, "other.json"),
        ("other.h5", "page.html", 3, "other.h5"),
        ("rig.h5", "page.html", 3, "rig.h5"),
        ("result.h5", "page.pdf", 3, "a name that ends in .html"),
    ],
)
def test_what_cannot_be_reported_leaves_no_page(
    facert, folder, result, output, code, message
) -> None:
    done = facert("report", folder / result, "-o", folder / output)
    assert done.code == code
    assert message in done.err
    assert not (folder / output).exists()


def test_an_empty_folder_is_refused(facert, tmp_path) -> None:
    done = facert("report", tmp_path, "-o", tmp_path / "page.html")
    assert done.code == 3
    assert "none" in done.err

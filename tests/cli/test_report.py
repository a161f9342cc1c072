"""``facert report`` as a user calls it."""

from __future__ import annotations

import json
import re
from dataclasses import replace

import numpy as np
import pytest

import facert as api
from facert.data.rig import Rig


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


def test_results_in_columns_are_shown_as_well_once_and_against_the_truth(facert, folder) -> None:
    page, result = folder / "page.html", api.read_take(folder / "result.h5")
    api.write_take(result, folder / "result.json")  # the same result again
    (folder / "result.h5").rename(folder / "result.hdf5")
    api.write_take(result, folder / "table.csv")
    api.write_take(result, folder / "curves.json")
    done = facert("report", folder, "-o", page)
    assert done.code == 0, done.err
    titles = re.findall("<h2>(.*?)</h2>", page.read_text())
    names = ("result.hdf5", "curves.json", "table.csv")
    sections = [f"Performance: {name}" for name in names]
    assert titles == ["Comparison", *sections, "Model: model.safetensors"]
    assert page.read_text().count("data:image/png") == 3  # the rig of the folder fits all
    assert len(set(re.findall("<p>(RMS to the truth .*?)</p>", page.read_text()))) == 1
    assert facert("report", folder / "table.csv", "-o", folder / "one.html").code == 0


def test_what_a_method_without_deviations_wrote_is_not_passed_over(facert, folder) -> None:
    result = api.read_take(folder / "result.h5")
    (folder / "result.h5").unlink()
    (folder / "truth.h5").unlink()
    api.write_take(replace(result, std=None), folder / "plain.h5")
    assert facert("report", folder, "-o", folder / "page.html").code == 0
    assert "Performance: plain.h5" in (folder / "page.html").read_text()


def test_long_curves_make_no_large_page(facert, folder, make_take) -> None:
    sizes = []
    for frames in (2000, 8000):
        take = make_take(frames=frames, posed=frames, animation=0)
        api.write_take(take, folder / "long.h5", overwrite=True)
        page = folder / f"{frames}.html"
        assert facert("report", folder / "long.h5", "-o", page).code == 0
        sizes.append(page.stat().st_size)
    assert sizes[1] < 2 * sizes[0]

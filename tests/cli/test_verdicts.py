import json
from dataclasses import replace

import numpy as np
import pytest

import facert as api
from facert import Settings
from facert.io.rig import write_rig


@pytest.fixture(scope="module")
def day(make_take, pose_few, tmp_path_factory):
    """A folder with a good and a bad take, and much that is none; a model beside it."""
    folder = tmp_path_factory.mktemp("day")
    take = make_take(frames=90, posed=90, animation=0, markers=8)
    places = 20.0 * np.random.default_rng(5).normal(size=(8, 3))
    take = replace(take, source=replace(take.source, values=take.source.values + places))
    retargeter = api.train(pose_few(take, 15), Settings(method="ridge"))
    replace(retargeter, takes=("tuesday.h5",)).save(folder / "ridge.safetensors")
    shots = folder / "shots"
    shots.mkdir()
    plain = replace(take, params=None, controls=None)
    api.write_take(plain, shots / "a_good.h5")
    away = np.random.default_rng(1).normal(size=(8, 3))
    other = replace(plain.source, values=plain.source.values + 4.0 * away)
    api.write_take(replace(plain, source=other), shots / "b_bad.h5")
    rig = api.Rig(
        neutral=np.eye(3), faces=np.array([[0, 1, 2]]), shapes=np.ones((1, 3, 3)), names=("jaw",)
    )
    write_rig(rig, shots / "character.h5")
    (shots / "README.txt").write_text("Notes of the day.")
    (shots / "._a_good.h5").write_bytes(b"\0\5\26\7")
    (shots / ".a_good-1a2b.h5").write_bytes(b"\x89HDF\r\n\x1a\n")
    (shots / ".DS_Store").write_bytes(b"\0")
    (shots / "poses.csv").write_text("frame,jaw,smile\n0,0,0\n12,1,0\n40,0,1\n55,1,1\n")
    return folder


@pytest.fixture(scope="module")
def batch(day):
    from typer.testing import CliRunner

    from facert.cli.app import app

    args = ["retarget", day / "shots", "--out-dir", day / "out", "-m", day / "ridge.safetensors"]
    return CliRunner().invoke(app, [*map(str, args), "--json", str(day / "verdicts.json")])


def test_a_batch_ends_with_a_line_a_take_the_worst_first(batch):
    assert batch.exit_code == 0, batch.output
    bad, good = batch.stdout.splitlines()[-2:]
    assert bad.startswith("bad        b_bad.h5   far from training: ")
    assert "-> another day or actor: --neutral FRAMES" in bad
    assert good.startswith("good       a_good.h5")


def test_what_is_logged_in_a_batch_names_its_file(batch, day):
    lines = [line for line in batch.stderr.splitlines() if "capture noise" in line]
    for name in ("a_good.h5", "b_bad.h5"):
        assert any(line.startswith(f"{day / 'shots' / name}: ") for line in lines)


def test_files_that_are_no_takes_are_passed_over_and_named(batch):
    (line,) = [line for line in batch.stderr.splitlines() if "no takes" in line]
    for name in (".DS_Store", ".a_good-1a2b.h5", "._a_good.h5", "README.txt", "character.h5"):
        assert name in line
    assert "failed" not in batch.output


def test_programs_get_all_of_it(batch, day):
    content = json.loads((day / "verdicts.json").read_text())
    good, bad = content["verdicts"]
    assert good["level"] == "good"
    assert all(reason["level"] == "good" for reason in good["reasons"])
    assert bad["level"] == "bad"
    reason = bad["reasons"][0]
    assert (reason["kind"], reason["frames"]) == ("far from training", [[0, 89]])
    assert reason["seconds"] == [[0.0, pytest.approx(89 / 30, abs=1e-3)]]
    assert all(0 <= one["frame"] < 90 for one in bad["worst"])


def test_a_result_that_is_there_keeps_its_verdict(facert, batch, day):
    again = facert("retarget", day / "shots", "--out-dir", day / "out", "-m", "no.safetensors")
    assert again.out.splitlines()[-2].startswith("bad        b_bad.h5   far from training: ")


def test_a_report_begins_with_the_verdicts(facert, batch, day):
    done = facert("report", day / "out", "-o", day / "page.html")
    assert done.code == 0, done.err
    page = (day / "page.html").read_text()
    assert page.index("<h2>Verdicts") < page.index("<h2>Performance")
    bad = 'b_bad.h5</td><td class="level bad">bad</td><td>far from training'
    assert page.index(bad) < page.index("a_good.h5</td>")
    assert "--neutral FRAMES" in page
    assert "ridge.safetensors: ridge, 15 poses of tuesday.h5" in page


def test_a_model_judges_a_result_that_holds_no_verdict(facert, batch, day, tmp_path):
    result = tmp_path / "bare.h5"
    api.write_take(api.read_take(day / "out" / "b_bad.h5"), result)
    facert("report", result, "-o", tmp_path / "page.html", "-m", day / "ridge.safetensors")
    assert "far from training" in (tmp_path / "page.html").read_text()

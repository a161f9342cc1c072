import json

import pytest

from facert.data.ranges import default_step, parse_range
from facert.errors import InputError
from facert.io.take import write_take
from facert.methods.registry import REGISTRY


@pytest.fixture
def take(make_take, tmp_path):
    path = tmp_path / "take.h5"
    write_take(make_take(frames=100, posed=100, animation=0), path)
    return path


OPTIONS = ("--methods", "ridge", "--labels", "4,6", "--unlabelled", 10, "--repeats", 2)
QUICK = (*OPTIONS, "--test-frames", 30, "--jobs", 1)


@pytest.mark.parametrize("name", ["kept.json", "kept.h5"])
def test_a_take_of_ours_is_not_replaced_by_figures(facert, take, tmp_path, name):
    kept = tmp_path / name
    assert facert("convert", take, kept).code == 0
    before = kept.read_bytes()
    outcome = facert("eval", take, *QUICK, "--json", kept, "--overwrite")
    assert (outcome.code, kept.read_bytes() == before) == (3, True)
    assert "holds something else than a report: it is never replaced" in outcome.err


@pytest.mark.parametrize(
    ("text", "numbers"),
    [
        ("10..40", (10, 20, 30, 40)),
        ("0..200", (0, 50, 100, 150, 200)),
        ("5..20", (5, 10, 15, 20)),
        ("0..200:100", (0, 100, 200)),
        ("10..25:10", (10, 20, 25)),
        ("40, 10,10", (10, 40)),
        ("5,10..12", (5, 10, 11, 12)),
        ("7..7", (7,)),
    ],
)
def test_ranges_and_lists_are_understood(text, numbers):
    assert parse_range(text, "--labels") == numbers


@pytest.mark.parametrize("text", ["", "a", "10..", "40..10", "1..9:0", "-3", "1.5", "0..9999:1"])
def test_anything_else_is_refused(text):
    with pytest.raises(InputError, match="--labels"):
        parse_range(text, "--labels")


def test_the_step_is_round_and_about_a_third():
    assert [default_step(0, high) for high in (1, 3, 15, 30, 100, 1000)] == [1, 1, 5, 10, 50, 500]


def test_table_json_and_picture(facert, take, tmp_path):
    out, picture = tmp_path / "out.json", tmp_path / "out.png"
    outcome = facert("eval", take, *QUICK, "--json", out, "--plot", picture)
    assert outcome.code == 0, outcome.err
    assert "ridge" in outcome.out
    assert outcome.out.splitlines()[-1].startswith("Use ridge for this take")

    content = json.loads(out.read_text())
    assert set(content) == {"settings", "rows"}
    assert [(row["labels"], row["unlabelled"]) for row in content["rows"]] == [(4, 10), (6, 10)]
    wanted = {"method", "labels", "unlabelled", "noise", "missing", "repeats", "rms", "rms_se"}
    assert wanted | {"ratio_to_best"} <= set(content["rows"][0])
    assert len(content["rows"][0]["per_control"]) == len(content["settings"]["controls"])
    assert content["settings"]["labels"] == [4, 6]
    assert content["settings"]["take"] == str(take)
    assert picture.exists()
    assert not list(tmp_path.glob("*.jsonl"))


def test_a_method_that_cannot_run_has_that_in_its_row(facert, take):
    outcome = facert("eval", take, *QUICK, "--labels", "2,4")
    assert outcome.code == 0, outcome.err
    row = next(line for line in outcome.out.splitlines() if line.split()[:1] == ["2"])
    assert "cannot run" in row
    assert "at least 3 posed frames" in outcome.out
    assert "RMS" in outcome.out.splitlines()[-1]


def test_an_unexpected_error_is_in_its_row_and_its_place_in_the_details(
    facert, take, tmp_path, monkeypatch
):
    monkeypatch.setitem(REGISTRY, "broken", ("linear", "NoSuchClass"))
    picture = tmp_path / "out.png"
    outcome = facert("-v", "eval", take, *QUICK, "--methods", "broken", "--plot", picture)
    assert outcome.code == 0, outcome.err
    assert "broken with 4 labels: unexpected AttributeError" in outcome.out
    assert "Traceback" in outcome.err
    assert "4 cells failed unexpectedly" in outcome.err
    assert "out.png: not drawn, as no method could run" in outcome.err
    assert not picture.exists()


def test_another_take_is_tested(facert, take, make_take, tmp_path):
    other = tmp_path / "other.h5"
    write_take(make_take(frames=50, posed=50, animation=0), other)
    outcome = facert("eval", take, *QUICK, "--across", other)
    assert outcome.code == 0, outcome.err
    assert "tested on other.h5" in outcome.out
    assert facert("eval", take, *QUICK, "--across", other, "--split", "block").code == 2


def test_existing_outputs_are_kept(facert, take, tmp_path):
    out = tmp_path / "out.json"
    assert facert("eval", take, *QUICK, "--json", out).code == 0
    before = out.read_text()
    assert facert("eval", take, *QUICK, "--json", out).code == 2
    assert out.read_text() == before
    assert facert("eval", take, *QUICK, "--json", out, "--overwrite").code == 0
    assert json.loads(out.read_text())["rows"]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--methods", "magic"), "--methods: expected all, or some of"),
        (("--labels", "x"), "--labels"),
        (("--labels", "90"), "90 labels, 10 unlabelled frames, 10 unlabelled poses and a test"),
        (("--noise", -1), "noise"),
        (("--noise", "inf"), "noise"),
        (("--missing", 2), "missing"),
        (("--across", "none.h5"), "none.h5"),
    ],
)
def test_bad_options_get_one_line(facert, take, tmp_path, options, message):
    outcome = facert("eval", take, *QUICK, *options, "--json", tmp_path / "out.json")
    assert outcome.code == 3
    assert message in outcome.err
    assert len(outcome.err.splitlines()) == 1
    assert not (tmp_path / "out.json").exists()


def test_a_take_without_poses_is_refused(facert, make_take, tmp_path):
    path = tmp_path / "unposed.h5"
    write_take(make_take(posed=0, animation=0), path)
    outcome = facert("eval", path, *QUICK)
    assert outcome.code == 3
    assert "unposed.h5: /target/params: expected known poses" in outcome.err


@pytest.mark.real
def test_a_real_track_is_evaluated(facert, real_data):
    track = real_data / "tracks" / "utterance_a.npz"
    outcome = facert("eval", track, "--target", "arkit", *QUICK)
    assert outcome.code == 0, outcome.err
    assert "utterance_a.npz (arkit), random split" in outcome.out


@pytest.mark.real
def test_a_rig_is_matched_in_its_own_spelling(facert, real_data):
    track, rig = real_data / "tracks" / "utterance_a.npz", real_data / "rigs" / "ict_face.npz"
    outcome = facert("eval", track, "--target", "arkit", "--rig", rig, *QUICK)
    assert outcome.code == 0, outcome.err
    assert "vertex" in outcome.out
    outcome = facert("eval", track, "--target", "units", "--rig", rig, *QUICK)
    assert outcome.code == 3
    assert "controls that the rig has a shape for, found 'eye-left-closure'" in outcome.err


def test_a_device_that_is_not_there_is_wrong_usage_before_any_cell(facert, take):
    failed = facert("eval", take, "--device", "cuda:99")
    assert failed.code == 2
    assert "--device cuda:99" in failed.err
    assert failed.out == ""


def test_a_take_with_a_few_posed_frames_needs_no_option(facert, make_take, tmp_path):
    path = tmp_path / "posed.h5"
    write_take(make_take(frames=90, posed=12, animation=0), path)
    outcome = facert("eval", path, "--methods", "ridge,nearest", "--repeats", 3, "--jobs", 1)
    assert outcome.code == 0, outcome.err
    assert "learns from 3 or 6 or 9 of 12 posed frames and 78 frames without a pose" in outcome.err
    assert "cannot run" not in outcome.out
    write_take(make_take(frames=90, posed=3, animation=0), path, overwrite=True)
    outcome = facert("eval", path)
    assert outcome.code == 3
    assert "posed.h5: /target/params: expected 4 posed frames at least" in outcome.err

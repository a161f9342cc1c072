import json
import shutil
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

import facert as api
from facert.data.corrections import taken_out
from facert.data.take import Controls

NAMES = ["jawOpen", "mouthSmileLeft", "browInnerUp", "cheekPuff"]
LIMITS = np.tile([-3.0, 3.0], (4, 1))


@pytest.fixture(scope="module")
def take(make_take):
    return replace(make_take(), controls=Controls(NAMES, LIMITS))


@pytest.fixture(scope="module")
def model(take):
    return api.train(take, api.Settings(method="gpr"))


@pytest.fixture(scope="module")
def made(take, model, tmp_path_factory):
    """A folder with a result, its recording and its model; and the result."""
    folder = tmp_path_factory.mktemp("made")
    model.save(folder / "model.safetensors")
    api.write_take(replace(take, params=None, animation=None), folder / "recording.h5")
    result = model.retarget(replace(take, params=None))
    api.write_take(result, folder / "shot.h5")
    return folder, result


@pytest.fixture
def shot(made, tmp_path, monkeypatch):
    """The result, which lies in the working folder with its recording and its model."""
    shutil.copytree(made[0], tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return made[1]


def plain(text):
    return " ".join(text.replace("│", " ").split())


def test_the_set_control_is_met_and_the_others_follow(facert, shot):
    done = facert("correct", "shot.h5", "--frame", 20, "--set", "JawOpen=0.4", "--overwrite")
    assert done.code == 0, done.err
    assert "frame 20 (0.667 s): " in done.out
    made = api.read_take("shot.h5")
    start = replace(
        shot,
        time=shot.time[[20]],
        source=replace(shot.source, values=shot.source.values[[20]], std=None),
        params=shot.params[[20]],
        std=shot.std[[20]],
    )
    expected = api.complete_pose(api.load("model.safetensors"), {"jawOpen": 0.4}, start=start)
    np.testing.assert_allclose(made.params[20], expected.pose, atol=1e-9)
    assert made.params[20, 0] == 0.4
    assert np.isnan(made.std[20]).all()
    changed = np.flatnonzero((made.params != shot.params).any(axis=1))
    assert changed.min() == 13
    assert changed.max() == 27


def test_some_can_be_held_or_all_others_left(facert, shot):
    asked = ("correct", "shot.h5", "--frame", 20, "--set", "jawOpen=0.4")
    assert facert(*asked, "--hold", "mouth*", "-o", "held.h5").code == 0
    held = api.read_take("held.h5").params[20]
    assert held[1] == shot.params[20, 1]
    assert held[2] != shot.params[20, 2]
    assert facert(*asked, "--only", "-m", "no-model.safetensors", "-o", "only.h5").code == 0
    assert (api.read_take("only.h5").params[20, 1:] == shot.params[20, 1:]).all()


def test_several_frames_and_the_width_are_chosen(facert, shot):
    asked = ("--set", "jawOpen=0.4", "--only", "--width", 0, "--overwrite")
    assert facert("correct", "shot.h5", "--frame", "10..12,40", *asked).code == 0
    made = api.read_take("shot.h5")
    assert made.corrections.frames.tolist() == [10, 11, 12, 40]
    changed = (made.params != shot.params).any(axis=1)
    assert np.flatnonzero(changed).tolist() == [10, 11, 12, 40]


def test_corrections_are_listed_and_taken_back_to_the_bit(facert, shot):
    for frame in (20, 26):
        asked = ("--set", "jawOpen=0.4", "--overwrite")
        assert facert("correct", "shot.h5", "--frame", frame, *asked).code == 0
    listed = facert("correct", "shot.h5", "--list").out
    assert [line.split()[:3] for line in listed.splitlines() if line.strip()[:1].isdigit()] == [
        ["20", "0.667", "0.5"],
        ["26", "0.867", "0.5"],
    ]
    assert facert("correct", "shot.h5", "--remove", 20, "--overwrite").code == 0
    assert api.read_take("shot.h5").corrections.frames.tolist() == [26]
    assert facert("correct", "shot.h5", "--remove", "all", "-o", "back.h5").code == 0
    back = api.read_take("back.h5")
    assert back.corrections is None
    assert (back.params == shot.params).all()
    assert (back.std == shot.std).all()
    assert facert("correct", "back.h5", "--list").out.strip() == "no corrections"
    gone = facert("correct", "back.h5", "--remove", 20, "--overwrite")
    assert gone.code == 3
    assert "none in it" in gone.err


def test_whole_poses_come_from_a_table(facert, shot, tmp_path):
    pose = shot.params[30] + 0.05
    rows = [f"{frame}," + ",".join(map(str, pose[[3, 0, 1, 2]])) for frame in (30, 31)]
    table = "frame,cheekPuff,jawOpen,mouthSmileLeft,browInnerUp\n" + "\n".join(rows)
    (tmp_path / "poses.csv").write_text(table + "\n")
    done = facert("correct", "shot.h5", "--poses", "poses.csv", "--overwrite")
    assert done.code == 0, done.err
    made = api.read_take("shot.h5")
    assert made.corrections.frames.tolist() == [30, 31]
    np.testing.assert_allclose(made.params[30], pose)


def test_controls_that_a_table_lacks_follow_or_stay(facert, shot, tmp_path):
    (tmp_path / "poses.csv").write_text("frame,JawOpen\n30,0.4\n")
    done = facert("correct", "shot.h5", "--poses", "poses.csv", "-o", "follow.h5")
    assert done.code == 0, done.err
    asked = ("--frame", 30, "--set", "jawOpen=0.4", "-o", "set.h5")
    assert facert("correct", "shot.h5", *asked).code == 0
    assert (api.read_take("follow.h5").params == api.read_take("set.h5").params).all()
    assert facert("correct", "shot.h5", "--poses", "poses.csv", "--only", "-o", "only.h5").code == 0
    only = api.read_take("only.h5").params[30]
    assert only.tolist() == [0.4, *shot.params[30, 1:]]
    rows = "frame,jawOpen,cheekPuff\n30,0.4,\n31,,0.2\n"  # a blank cell sets nothing
    (tmp_path / "blank.csv").write_text(rows)
    done = facert("correct", "shot.h5", "--poses", "blank.csv", "--only", "-o", "blank.h5")
    assert done.code == 0, done.err
    assert (api.read_take("blank.h5").params[30] == api.read_take("only.h5").params[30]).all()
    (tmp_path / "poses.csv").write_text("frame,jawOpne\n30,0.4\n")
    failed = facert("correct", "shot.h5", "--poses", "poses.csv", "-o", "x.h5")
    assert failed.code == 3
    assert "poses.csv: " in failed.err
    assert "jawOpen" in failed.err


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (("--frame", 60, "--set", "jawOpen=0.1"), 3, "shot.h5: frame: expected 0 to 59, found 60"),
        (("--frame", -1, "--set", "jawOpen=0.1"), 3, "--frame"),
        (("--frame", 3, "--set", "jawOpne=0.1"), 3, "Did you mean 'jawOpen'?"),
        (("--frame", 3, "--only", "--set", "jawOpne=0.1"), 3, "Did you mean 'jawOpen'?"),
        (("--frame", 3, "--set", "jawOpen=3.5"), 3, "jawOpen: expected a value from -3 to 3"),
        (("--frame", 3, "--only", "--set", "jawOpen=3.5"), 3, "expected a value from -3 to 3"),
        (("--frame", 3, "--set", "jawOpen=nan"), 3, "jawOpen: expected a number, found nan"),
        (("--frame", 3, "--set", "jawOpen"), 2, "write it as in --set jawOpen=0.3"),
        (("--frame", 3, "--set", "jawOpen=0.1", "--hold", "mout"), 3, "hold: expected controls"),
        (("--frame", 3), 2, "give both --frame and --set"),
        (("--set", "jawOpen=0.1"), 2, "give both --frame and --set"),
        ((), 2, "give --frame with --set NAME=VALUE, or one of"),
        (("--frame", 3, "--set", "jawOpen=0.1", "--list"), 2, "or one of"),
        (("--list", "--only"), 2, "--hold and --only are for --set"),
        (("--frame", 3, "--set", "jawOpen=0.1", "--width", -1), 2, "--width"),
        (("--frame", 3, "--set", "jawOpen=0.1", "-o", "curves.csv"), 3, "expected .h5"),
        (("--frame", 3, "--set", "jawOpen=0.1", "-m", "none.safetensors"), 3, "none.safetensors"),
    ],
)
def test_what_makes_no_sense_is_refused_and_the_result_stays(
    facert, shot, tmp_path, arguments, code, message
):
    before = (tmp_path / "shot.h5").read_bytes()
    failed = facert("correct", "shot.h5", *arguments, "--overwrite")
    assert failed.code == code
    assert message in plain(failed.err)
    assert (tmp_path / "shot.h5").read_bytes() == before


def test_a_result_is_not_replaced_unasked_nor_a_table_corrected(facert, shot):
    asked = ("--frame", 3, "--set", "jawOpen=0.1")
    assert facert("correct", "shot.h5", *asked).code == 2
    api.write_take(shot, "shot.csv")
    table = facert("correct", "shot.csv", *asked, "--overwrite")
    assert table.code == 3
    assert "Retarget to .h5 and correct that" in table.err
    recording = facert("correct", "recording.h5", *asked, "--overwrite")
    assert recording.code == 3
    assert "expected a result: a pose in every frame" in recording.err


def test_a_writer_that_is_stopped_leaves_the_result_as_it_was(facert, shot, tmp_path, monkeypatch):
    before = (tmp_path / "shot.h5").read_bytes()

    def stop(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("facert.io.take._write_corrections", stop)
    done = facert(
        "correct", "shot.h5", "--frame", 3, "--only", "--set", "jawOpen=0.1", "--overwrite"
    )
    assert done.code == 130
    assert (tmp_path / "shot.h5").read_bytes() == before
    assert not list(tmp_path.glob(".shot*"))


def corrected(facert, path="shot.h5", frame=20):
    asked = ("--frame", frame, "--set", "jawOpen=0.4", "--overwrite")
    done = facert("correct", path, *asked)
    assert done.code == 0, done.err
    return api.read_take(path)


def test_corrections_survive_retargeting_anew(facert, shot, take):
    before = corrected(facert)
    api.train(take, api.Settings(method="nearest")).save("other.safetensors")
    asked = ("retarget", "recording.h5", "shot.h5", "-m", "other.safetensors", "--overwrite")
    done = facert(*asked)
    assert done.code == 0, done.err
    assert "1 correction of shot.h5 put in again, at frame 20" in done.err
    anew = api.read_take("shot.h5")
    assert (anew.params[20] == before.params[20]).all()
    new = api.load("other.safetensors").retarget(api.read_take("recording.h5"))
    np.testing.assert_allclose(taken_out(anew).params, new.params, atol=1e-9)
    assert facert(*asked, "--drop-corrections").code == 0
    assert api.read_take("shot.h5").corrections is None


def test_corrections_survive_in_a_batch_and_where_the_result_is_retargeted(facert, shot, tmp_path):
    (tmp_path / "out").mkdir()
    api.write_take(shot, "out/recording.h5")
    before = corrected(facert, "out/recording.h5")
    done = facert("retarget", "recording.h5", "--out-dir", "out", "--overwrite")
    assert done.code == 0, done.err
    anew = api.read_take("out/recording.h5")
    assert (anew.params[20] == before.params[20]).all()
    assert facert("retarget", "out/recording.h5", "again.h5").code == 0
    again = api.read_take("again.h5")
    assert (again.params[20] == before.params[20]).all()
    assert again.corrections.frames.tolist() == [20]
    assert facert("retarget", "out/recording.h5", "curves.csv").code == 0
    curves = api.read_take("curves.csv").source.values
    np.testing.assert_allclose(curves[20], before.params[20], atol=1e-9)


def test_corrections_of_another_recording_are_not_lost(facert, shot, take, tmp_path):
    corrected(facert)
    half = replace(
        take,
        time=take.time[:30],
        source=replace(take.source, values=take.source.values[:30]),
        params=None,
        animation=None,
    )
    api.write_take(half, "half.h5")
    before = (tmp_path / "shot.h5").read_bytes()
    failed = facert("retarget", "half.h5", "shot.h5", "--overwrite")
    assert failed.code == 3
    assert "shot.h5: frames of the recording: expected 60 frames" in failed.err
    assert "--drop-corrections" in failed.err
    assert (tmp_path / "shot.h5").read_bytes() == before


def test_corrections_of_another_character_are_not_lost(facert, shot, take):
    corrected(facert)
    api.train(
        replace(take, controls=Controls([*NAMES[:3], "noseSneer"])), api.Settings(method="nearest")
    ).save("other.safetensors")
    asked = ("retarget", "recording.h5", "shot.h5", "-m", "other.safetensors", "--overwrite")
    failed = facert(*asked)
    assert failed.code == 3
    assert "'cheekPuff'" in failed.err
    assert "--drop-corrections" in failed.err


def test_predicted_poses_are_no_truth(facert, shot):
    done = facert("retarget", "shot.h5", "again.h5")
    assert done.code == 0
    assert "RMS" not in done.out
    corrected(facert)
    done = facert("retarget", "shot.h5", "again.h5", "--overwrite")
    assert "RMS" not in done.out  # one was corrected here: no truth of the recording


def test_a_pose_of_a_frame_finds_its_frame(facert, shot, take):
    for ending in ("csv", "h5"):
        out = f"pose.{ending}"
        asked = ("--from", "shot.h5:42", "--set", "jawOpen=0.3", "-o", out)
        assert facert("pose", *asked).code == 0
        done = facert("convert", "recording.h5", f"posed-{ending}.h5", "--poses", out)
        assert done.code == 0, done.err
        posed = api.read_take(f"posed-{ending}.h5")
        assert posed.labels.tolist() == [42]
        assert posed.params[42, 0] == pytest.approx(0.3)


def test_a_corrected_frame_is_corrected_again(facert, shot):
    before = corrected(facert)
    asked = ("pose", "--from", "shot.h5:20", "--set", "browInnerUp=0.1", "-o", "pose.json")
    assert facert(*asked).code == 0
    pose = json.loads(Path("pose.json").read_text())
    assert (pose["frame"], pose["time"]) == (20, pytest.approx(before.time[20]))
    done = facert("correct", "shot.h5", "--frame", 20, "--set", "browInnerUp=0.1", "--overwrite")
    assert done.code == 0, done.err
    made = api.read_take("shot.h5")
    assert made.params[20, 2] == 0.1
    np.testing.assert_allclose(made.params[20], list(pose["pose"].values()))


def test_what_was_corrected_is_learned_from_as_if_it_were_posed_in_the_recording(
    facert, shot, take
):
    api.write_take(take, "training.h5")
    assert facert("retarget", "recording.h5", "shot.h5", "--overwrite").code == 0
    corrected(facert, frame=17)
    corrected(facert, frame=33)
    done = facert("convert", "recording.h5", "posed.h5", "--poses", "shot.h5")
    assert done.code == 0, done.err
    assert api.read_take("posed.h5").labels.tolist() == [17, 33]
    for other in ("shot", "posed"):
        asked = ("training.h5", f"{other}.h5", "-o", f"{other}.safetensors", "--method", "gpr")
        done = facert("train", *asked, "--corrections-only")
        assert done.code == 0, done.err
    models = [api.load(f"{other}.safetensors") for other in ("shot", "posed")]
    assert models[0].labels == models[1].labels == 14
    np.testing.assert_allclose(models[0].poses, models[1].poses)
    np.testing.assert_allclose(models[0].labelled, models[1].labelled)


def test_frames_that_are_right_are_confirmed(facert, shot):
    done = facert("correct", "shot.h5", "--frame", "5,40..41", "--confirm", "--overwrite")
    assert done.code == 0, done.err
    made = api.read_take("shot.h5")
    assert (made.params == shot.params).all()
    assert made.corrections.frames.tolist() == [5, 40, 41]
    assert np.isnan(made.std).any(axis=1).sum() == 3
    failed = facert("correct", "shot.h5", "--frame", 60, "--confirm", "--overwrite")
    assert failed.code == 3
    assert "frame: expected 0 to 59, found 60" in failed.err
    both = facert(
        "correct", "shot.h5", "--frame", 5, "--confirm", "--set", "jawOpen=0", "-o", "x.h5"
    )
    assert both.code == 2


def test_a_damaged_recording_in_a_result_is_named(facert, shot):
    assert facert("retarget", "recording.h5", "shot.h5", "--overwrite").code == 0
    with h5py.File("shot.h5", "a") as file:
        values = file["recorded/markers"][:30]
        del file["recorded/markers"]
        file["recorded/markers"] = values
    asked = ("--frame", 3, "--only", "--set", "jawOpen=0.1", "--overwrite")
    failed = facert("correct", "shot.h5", *asked)
    assert failed.code == 3
    assert "shot.h5: /recorded/markers: expected shape (60), found shape (30,)" in failed.err


def test_poses_of_unknown_origin_are_not_taken_for_predicted_unsaid(make_take, shot, caplog):
    """A take that an animator posed as a whole looks like a result without deviations."""
    whole = make_take(posed=60)
    api.correct(shot, {3: {"jawOpen": 0.2}}, only=True)
    assert not caplog.records
    made = api.correct(whole, {3: {"jaw": 0.2}}, only=True)
    assert "count as predicted" in caplog.text
    caplog.clear()
    api.correct(made, {4: {"jaw": 0.2}}, only=True)
    with pytest.raises(api.InputError, match=r"whole numbers of frames, found 3\.5"):
        api.correct(shot, {3.5: {"jawOpen": 0.2}}, only=True)
    assert not caplog.records


def test_others_stay_where_no_known_pose_comes_near_unless_asked(facert, shot):
    asked = ("correct", "shot.h5", "--frame", 20, "--set", "mouthSmileLeft=3", "--overwrite")
    done = facert(*asked, "--set", "browInnerUp=-3", "-o", "far.h5")
    assert "the others stay as predicted; --follow lets them follow" in plain(done.err)
    assert (api.read_take("far.h5").params[20, [0, 3]] == shot.params[20, [0, 3]]).all()
    assert facert(*asked, "--set", "browInnerUp=-3", "-o", "far.h5", "--follow").code == 0
    assert (api.read_take("far.h5").params[20, 3] != shot.params[20, 3]).all()


def test_the_model_that_a_result_names_is_found_beside_it(facert, shot, tmp_path):
    (tmp_path / "model.safetensors").rename(tmp_path / "phone.safetensors")
    named = replace(api.read_take("shot.h5"), model="phone.safetensors: gpr, 12 poses of a.h5")
    api.write_take(named, "named.h5")
    done = facert("correct", "named.h5", "--frame", 20, "--set", "jawOpen=0.4", "--overwrite")
    assert done.code == 0, done.err
    assert "model: phone.safetensors, which named.h5 names" in plain(done.err)

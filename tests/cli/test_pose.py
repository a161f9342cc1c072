import json
from dataclasses import replace

import numpy as np
import pytest

import facert as api
from facert.data.take import Controls

NAMES = ["jawOpen", "mouthSmileLeft", "browInnerUp", "cheekPuff"]
LIMITS = np.tile([-3.0, 3.0], (4, 1))


@pytest.fixture(scope="module")
def take(make_take):
    return replace(make_take(), controls=Controls(NAMES, LIMITS))


@pytest.fixture
def files(take, tmp_path):
    """Model and take."""
    model, path = tmp_path / "model.safetensors", tmp_path / "take.h5"
    api.train(take, api.Settings(method="gpr")).save(model)
    api.write_take(take, path)
    return model, path


def test_the_table_marks_what_was_given(facert, files):
    model, _ = files
    done = facert("pose", "--model", model, "--set", "mouthSmile_L=0.25", "--set", "jawOpen=0.1")
    assert done.code == 0, done.err
    lines = [line for line in done.out.splitlines() if line.strip()]
    assert lines[2].split() == ["mouthSmileLeft", "0.250", "given"]
    assert lines[3].split() == ["jawOpen", "0.100", "given"]
    assert {line.split()[0] for line in lines[4:]} == {"browInnerUp", "cheekPuff"}


def test_poses_are_written_with_their_samples(facert, files, tmp_path):
    model, _ = files
    done = {}
    for ending in ("h5", "json", "csv"):
        out = tmp_path / f"pose.{ending}"
        asked = ("--set", "jawOpen=0.1", "--samples", 2, "--seed", 3)
        assert facert("pose", "-m", model, *asked, "-o", out).code == 0
        done[ending] = out
    take, facts = api.read_take(done["h5"]), json.loads(done["json"].read_text())
    assert take.params.shape == (3, 4)
    assert facts["given"] == {"jawOpen": 0.1}
    named = [facts["pose"], *facts["samples"]]
    assert (take.params == [[pose[name] for name in NAMES] for pose in named]).all()
    assert facts["std"]["jawOpen"] == 0.0 < facts["std"]["cheekPuff"]
    assert (
        done["csv"].read_text().splitlines()[0]
        == '"time",jawOpen,mouthSmileLeft,browInnerUp,cheekPuff'
    )


def test_soft_values_are_met_nearly(facert, files):
    done = facert("pose", "-m", files[0], "--set", "jawOpen=0.4", "--soft", 0.2)
    line = next(line for line in done.out.splitlines() if "near 0.4" in line)
    assert float(line.split()[1]) < 0.4


def test_a_frame_of_a_take_is_corrected(facert, files, take, tmp_path):
    model, path = files
    out = tmp_path / "pose.h5"
    done = facert("pose", "-m", model, "--from", f"{path}:7", "--set", "jawOpen=0.3", "-o", out)
    assert done.code == 0, done.err
    start = api.load(model).retarget(take).params[7]
    pose = api.read_take(out).params[0]
    assert pose[0] == 0.3
    assert (np.abs(pose - start)[1:] <= np.abs(pose - start)[0]).all()


def frame_alone(model, take, frame):
    """What a model predicts for a frame without those around it."""
    source = replace(take.source, values=take.source.values[[frame]])
    one = replace(take, time=take.time[[frame]], source=source, params=None, animation=None)
    return api.load(model).retarget(one).params[0]


def test_a_frame_of_a_result_is_taken_as_it_is(facert, files, take, tmp_path):
    model, _ = files
    result, out = tmp_path / "result.h5", tmp_path / "pose.h5"
    predicted = api.load(model).retarget(take)
    api.write_take(replace(predicted, params=predicted.params + 0.01), result)
    asked = ("--set", f"jawOpen={float(predicted.params[7, 0] + 0.01)!r}", "-o", out)
    done = facert("pose", "-m", model, "--from", f"{result}:7", *asked)
    assert done.code == 0, done.err
    np.testing.assert_allclose(api.read_take(out).params[0], predicted.params[7] + 0.01, atol=1e-9)


def test_the_rest_of_a_corrected_frame_can_be_held(facert, files, take, tmp_path):
    model, path = files
    out = tmp_path / "pose.h5"
    asked = ("pose", "-m", model, "--set", "jawOpen=0.3", "--hold", "mouth*", "--hold", "cheekPuff")
    done = facert(*asked, "--from", f"{path}:7", "-o", out)
    assert done.code == 0, done.err
    pose, start = api.read_take(out).params[0], frame_alone(model, take, 7)
    np.testing.assert_allclose(pose[[1, 3]], start[[1, 3]], atol=1e-12)
    assert pose[2] != start[2]
    assert done.out.count(" held") == 2
    refused = facert(*asked)
    assert refused.code == 2
    assert "--from" in refused.err


def test_a_take_will_do_instead_of_a_model(facert, files, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path / "..")
    model, path = files
    by_take = facert("pose", "--poses", path, "--set", "jawOpen=0.1")
    assert by_take.out == facert("pose", "-m", model, "--set", "jawOpen=0.1").out


@pytest.mark.parametrize(
    ("wanted", "code", "message"),
    [
        ("jawOpenn=0.1", 3, "Did you mean 'jawOpen'?"),
        ("jawOpen=3.5", 3, "jawOpen: expected a value from -3 to 3, found 3.5"),
        ("jawOpen", 2, "write it as in --set jawOpen=0.3"),
        ("jawOpen=wide", 2, "write it as in --set jawOpen=0.3"),
    ],
)
def test_what_cannot_be_set_is_refused_in_a_line(facert, files, tmp_path, wanted, code, message):
    failed = facert("pose", "-m", files[0], "--set", wanted, "-o", tmp_path / "pose.h5")
    assert failed.code == code
    assert message in " ".join(failed.err.replace("│", " ").split())
    assert not (tmp_path / "pose.h5").exists()


@pytest.mark.parametrize(
    ("start", "code", "message"),
    [
        ("take.h5", 2, "write it as in take.h5:120"),
        ("take.h5:-1", 2, "write it as in take.h5:120"),
        ("take.h5:60", 3, "take.h5: --from: expected a frame from 0 to 59, found 60"),
        ("none.h5:1", 3, "none.h5"),
    ],
)
def test_a_frame_that_is_not_there_is_refused(
    facert, files, tmp_path, monkeypatch, start, code, message
):
    monkeypatch.chdir(tmp_path)
    failed = facert("pose", "-m", files[0], "--from", start, "--set", "jawOpen=0.1")
    assert failed.code == code
    assert message in " ".join(failed.err.replace("│", " ").split())


def test_an_existing_output_stays_unless_it_may_be_replaced(facert, files, tmp_path):
    out = tmp_path / "pose.json"
    asked = ("pose", "-m", files[0], "--set", "jawOpen=0.1", "-o", out)
    assert facert(*asked).code == 0
    before = out.read_text()
    assert facert(*asked).code == 2
    assert out.read_text() == before
    assert facert(*asked, "--overwrite").code == 0
    assert "pose" in json.loads(out.read_text())

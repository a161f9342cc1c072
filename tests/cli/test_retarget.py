import json
import pickle
import struct
from dataclasses import replace

import numpy as np
import pytest
from safetensors.numpy import load, save

import facert as api
from facert import Settings
from facert.data.take import Controls, Source


@pytest.fixture(scope="module")
def trained(make_take):
    """A retargeter whose controls have names of ARKit."""
    return api.train(
        arkit(make_take()), Settings(latent_dim=3, neighbours=5, unlabelled=30, max_iterations=30)
    )


def arkit(take):
    return replace(
        take, controls=Controls(["jawOpen", "mouthSmileLeft", "browInnerUp", "cheekPuff"])
    )


@pytest.fixture
def files(trained, make_take, tmp_path):
    """Take, output and model."""
    trained.save(tmp_path / "model.safetensors")
    api.write_take(arkit(make_take(posed=60)), tmp_path / "take.h5")
    return tmp_path / "take.h5", tmp_path / "out.h5", tmp_path / "model.safetensors"


def test_the_result_holds_poses_their_std_and_the_cleaned_source(facert, files, trained):
    take, out, model = files
    assert facert("retarget", take, out, "--model", model).code == 0
    expected, result = trained.retarget(api.read_take(take)), api.read_take(out)
    np.testing.assert_allclose(result.params, expected.params, atol=1e-10)
    np.testing.assert_allclose(result.std, expected.std, atol=1e-10)
    np.testing.assert_allclose(result.source.values, expected.source.values, atol=1e-10)


def test_where_the_truth_is_known_errors_are_printed_by_part_of_the_face(facert, files, trained):
    take, out, model = files
    done = facert("retarget", take, out, "--model", model)
    params = api.read_take(take).params
    known = sum((pose == params).all(axis=1).any() for pose in trained.poses)
    assert known
    assert f"RMS against {60 - known} poses that it was not" in " ".join(done.out.split())
    for word in ("jaw", "mouth", "brows", "cheeks", "all"):
        assert word in done.out


def test_poses_that_it_was_trained_on_give_no_error(facert, files, make_take):
    take, out, model = files
    api.write_take(arkit(make_take()), take, overwrite=True)
    done = facert("retarget", take, out, "--model", model)
    assert "RMS" not in done.out
    assert "may have been, used in training" in done.err
    assert "other controls" not in done.err


def test_without_truth_or_with_that_of_another_character_there_is_no_table(
    facert, files, make_take
):
    take, out, model = files
    for target in (make_take(posed=0, animation=0), make_take(posed=60)):
        api.write_take(target, take, overwrite=True)
        done = facert("retarget", take, out, "--model", model, "--overwrite")
        assert done.code == 0
        assert "RMS" not in done.out


def test_the_mode_is_chosen(facert, files, trained):
    take, out, model = files
    assert facert("retarget", take, out, "--model", model, "--mode", "online").code == 0
    expected = trained.retarget(api.read_take(take), "online")
    np.testing.assert_allclose(api.read_take(out).params, expected.params, atol=1e-10)


def test_a_truth_with_another_control_is_compared_in_those_that_are_shared(
    facert, files, make_take
):
    take, out, model = files
    target = arkit(make_take(posed=60, seed=5))
    names = target.controls.names
    for changed, message in (
        ((*names, "tongueOut"), "not compared: tongueOut (only in the truth)"),
        (names[1:], f"not compared: {names[0]} (only in the result)"),
    ):
        params = np.hstack([target.params, target.params[:, :1]])
        columns = [(*names, "tongueOut").index(name) for name in changed]
        other = replace(
            target, controls=Controls(changed), params=params[:, columns], animation=None
        )
        api.write_take(other, take, overwrite=True)
        done = facert("retarget", take, out, "--model", model, "--overwrite")
        assert done.code == 0, done.err
        assert "RMS against" in done.out
        assert message in done.err


@pytest.mark.parametrize("ending", ["csv", "livelink.csv"])
def test_the_ending_decides_the_format(facert, files, tmp_path, ending):
    take, _, model = files
    out = tmp_path / f"out.{ending}"
    done = facert("retarget", take, out, "--model", model)
    assert done.code == 0, done.err
    header, *rows = out.read_text().splitlines()
    assert "awOpen" in header
    assert len(rows) == 60


def test_an_existing_result_stays_unless_it_may_be_replaced(facert, files):
    take, out, model = files
    assert facert("retarget", take, out, "--model", model).code == 0
    before = out.read_bytes()
    refused = facert("retarget", take, out, "--model", model)
    assert refused.code == 2
    assert "--overwrite" in refused.err
    assert out.read_bytes() == before
    assert facert("retarget", take, out, "--model", model, "--overwrite").code == 0


def test_the_take_is_never_replaced_by_its_result(facert, files):
    take, _, model = files
    before = take.read_bytes()
    assert facert("retarget", take, take, "--model", model, "--overwrite").code == 3
    assert take.read_bytes() == before


def metadata_of(model):
    content = model.read_bytes()
    header = json.loads(content[8 : 8 + struct.unpack("<Q", content[:8])[0]])
    return header["__metadata__"]


def pickled(model):
    model.write_bytes(pickle.dumps({"weights": [1.0]}))


def truncated(model):
    model.write_bytes(model.read_bytes()[:-100])


def header_bomb(model):
    model.write_bytes(struct.pack("<Q", 2**62) + b"{}")


def with_nan(model):
    arrays, metadata = load(model.read_bytes()), metadata_of(model)
    arrays["method.source.mean"] = np.full_like(arrays["method.source.mean"], np.nan)
    model.write_bytes(save(arrays, metadata))


def checkpoint(model):
    arrays, metadata = load(model.read_bytes()), metadata_of(model)
    content = {**json.loads(metadata["facert"]), "format": "facert-checkpoint"}
    model.write_bytes(save(arrays, {"facert": json.dumps(content)}))


def missing(model):
    model.unlink()


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (pickled, "the header: expected a safetensors file"),
        (truncated, "expected a file of"),
        (header_bomb, "the header: expected a safetensors file"),
        (with_nan, "method.source.mean: expected finite float64 numbers"),
        (checkpoint, "format: expected facert-model, found 'facert-checkpoint'"),
        (missing, "expected"),
    ],
)
def test_a_bad_model_gets_one_line_and_leaves_no_file(facert, files, tmp_path, spoil, message):
    take, out, model = files
    spoil(model)
    before = set(tmp_path.iterdir())
    failed = facert("retarget", take, out, "--model", model)
    assert failed.code == 3
    (line,) = failed.err.splitlines()
    assert line.startswith(f"error: {model}: ")
    assert message in line
    assert set(tmp_path.iterdir()) == before


def with_other_names(take):
    return replace(take, source=replace(take.source, names=["m0", "m1", "m2", "m3", "nose"]))


def with_weights(take):
    matrix = take.source.matrix
    return replace(take, source=api.Source(matrix, [f"w{i}" for i in range(matrix.shape[1])]))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (with_other_names, "/source/names: expected"),
        (with_weights, "/source: expected markers, found weights"),
    ],
)
def test_a_take_that_does_not_fit_the_model_is_named(facert, files, make_take, change, message):
    take, out, model = files
    api.write_take(change(make_take()), take, overwrite=True)
    failed = facert("retarget", take, out, "--model", model)
    assert failed.code == 3
    assert f"{take}: {message}" in failed.err
    assert not out.exists()


def test_an_ending_without_a_format_is_refused(facert, files, tmp_path):
    take, _, model = files
    failed = facert("retarget", take, tmp_path / "out.docx", "--model", model)
    assert failed.code == 3
    assert not (tmp_path / "out.docx").exists()


def test_controls_neutral_and_switches_are_passed_on(facert, files, tmp_path):
    take, out, model = files
    (tmp_path / "controls.toml").write_text('[jawOpen]\ngain = 0.0\n["mouth*"]\nsmoothing = 0.0\n')
    options = ("--controls", tmp_path / "controls.toml", "--neutral", "0..5", "--sigma", "0.1")
    for mode in ("offline", "online"):
        done = facert("retarget", take, out, "-m", model, *options, "--mode", mode, "--overwrite")
        assert done.code == 0, done.err
        assert (api.read_take(out).params[:, 0] == 0.0).all()
    plain = facert("retarget", take, out, "-m", model, "--no-detect", "--no-smooth", "--overwrite")
    assert plain.code == 0
    assert "capture noise" not in plain.err


@pytest.mark.parametrize(
    ("text", "word"),
    [("[jawOpne]\ngain = 1.0\n", "jawOpen"), ("gain = 1.0\n", "table"), ("[", "TOML")],
)
def test_a_bad_file_of_controls_is_refused(facert, files, tmp_path, text, word):
    take, out, model = files
    (tmp_path / "controls.toml").write_text(text)
    done = facert("retarget", take, out, "-m", model, "--controls", tmp_path / "controls.toml")
    assert done.code == 3
    assert word in done.err
    assert "controls.toml" in done.err
    assert not out.exists()


def test_a_device_that_is_not_there_is_wrong_usage(facert, files):
    take, out, model = files
    failed = facert("retarget", take, out, "--model", model, "--device", "cuda:99")
    assert failed.code == 2
    assert "--device cuda:99" in failed.err
    assert not out.exists()


@pytest.mark.parametrize("prefix", ["Face1:blendShape1.", "BS_node."])
def test_a_shot_whose_names_have_a_prefix_is_retargeted_as_without(facert, files, prefix, tmp_path):
    take, out, model = files
    shot = api.read_take(take)
    names = [f"{prefix}{name}" for name in shot.source.names]
    api.write_take(replace(shot, source=Source(shot.source.values, names)), tmp_path / "shot.h5")
    done = facert("retarget", tmp_path / "shot.h5", out, "--model", model)
    assert done.code == 0, done.err
    assert done.err.count(f"without the prefix '{prefix}'") == 1
    facert("retarget", take, tmp_path / "plain.h5", "--model", model)
    result, plain = api.read_take(out), api.read_take(tmp_path / "plain.h5")
    np.testing.assert_array_equal(result.params, plain.params)
    assert result.controls.names == plain.controls.names
    assert result.source.names == shot.source.names

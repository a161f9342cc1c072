from dataclasses import replace

import h5py
import numpy as np
import pytest

import facert as api
from facert.cli.commands.train import _shown
from facert.io.tables.csv_table import CURVE
from facert.io.tensors import write_tensors
from facert.retarget.checkpoint import CheckpointMetadata, checkpoint_path

QUICK = ("--latent-dim", 3, "--neighbours", 5, "--unlabelled", 30)
# A method that trains step by step.
SHARED = ("--method", "ssgplvm")


@pytest.fixture
def take(make_take, tmp_path):
    path = tmp_path / "take.h5"
    api.write_take(make_take(), path)
    return path


@pytest.fixture
def model(tmp_path):
    return tmp_path / "model.safetensors"


def test_a_model_is_written_and_a_table_of_how_it_went(facert, take, model):
    done = facert("train", take, "-o", model)
    assert done.code == 0
    assert "auto in " in done.out
    for word in (
        "unlabelled poses",
        "training seconds",
        "weight of factors",
        "training reconstruction",
    ):
        assert word in done.out
    assert api.load(model).figures["labelled frames"] == 12
    assert "warning" not in done.err


def test_of_a_shared_model_the_table_shows_how_the_search_ended(facert, take, model):
    done = facert("train", take, "-o", model, *QUICK, *SHARED)
    assert done.code == 0
    for word in ("objective", "iterations", "converged", "theta1"):
        assert word in done.out
    assert not checkpoint_path(model).exists()


def test_options_are_kept_with_the_model(facert, take, model):
    options = ("--labels", 6, "--seed", 3, "--method", "sgplvm", "--optimizer", "scg")
    assert facert("train", take, "-o", model, *QUICK, *options).code == 0
    settings = api.load(model).settings
    assert (settings.labels, settings.seed) == (6, 3)
    assert (settings.method, settings.optimizer) == ("sgplvm", "scg")


def test_options_come_before_the_config_file(facert, take, model, tmp_path):
    (tmp_path / "c.toml").write_text("latent_dim = 2\nsigma_t = 0.7\nmax_iterations = 5\n")
    assert facert("train", take, "-o", model, "--config", tmp_path / "c.toml", *QUICK).code == 0
    settings = api.load(model).settings
    assert (settings.latent_dim, settings.sigma_t) == (3, 0.7)


def test_the_curve_is_logged(facert, take, model, tmp_path):
    options = ("--log", tmp_path / "curve.csv", *QUICK, *SHARED)
    assert facert("train", take, "-o", model, *options).code == 0
    curve = np.genfromtxt(tmp_path / "curve.csv", delimiter=",", names=True)
    assert curve["objective"][-1] == api.load(model).figures["objective"]
    assert (np.diff(curve["objective"]) < 0).all()


def test_existing_outputs_stay_unless_they_may_be_replaced(facert, take, model, tmp_path):
    assert facert("train", take, "-o", model, *QUICK).code == 0
    before = model.read_bytes()
    refused = facert("train", take, "-o", model, *QUICK)
    assert refused.code == 2
    assert "--overwrite" in refused.err
    assert model.read_bytes() == before
    assert facert("train", take, "-o", model, "--overwrite", *QUICK).code == 0
    (tmp_path / "curve.csv").write_text(CURVE + "\n")
    other = tmp_path / "other.safetensors"
    options = ("--log", tmp_path / "curve.csv", *QUICK, *SHARED)
    assert facert("train", take, "-o", other, *options).code == 2
    assert (tmp_path / "curve.csv").read_text() == CURVE + "\n"
    assert not other.exists()


def test_resuming_without_a_checkpoint_trains_anew(facert, take, model):
    done = facert("train", take, "-o", model, *QUICK, *SHARED, "--resume")
    assert done.code == 0
    assert "training begins anew" in done.err


def idle(options):
    return f"warning: auto learns in one go: nothing to do for {options}"


def test_a_method_that_learns_in_one_go_warns_of_what_it_has_no_use_for(
    facert, take, model, tmp_path
):
    curve = tmp_path / "curve.csv"
    done = facert("train", take, "-o", model, "--log", curve, "--resume")
    assert done.code == 0
    assert done.err.splitlines().count(idle("--resume and --log")) == 1
    assert not curve.exists()
    assert idle("--log") in facert("train", take, "-o", model, "--log", curve, "--overwrite").err


def test_a_method_that_learns_in_one_go_leaves_the_checkpoint_of_another_alone(facert, take, model):
    checkpoint_path(model).write_text("where another run stopped")
    write_tensors(model, {}, CheckpointMetadata(""), "facert-model")
    before = model.read_bytes()

    refused = facert("train", take, "-o", model, "--resume")
    assert refused.code == 2
    assert idle("--resume") in refused.err
    assert model.read_bytes() == before
    assert facert("train", take, "-o", model, "--overwrite").code == 0
    assert checkpoint_path(model).read_text() == "where another run stopped"


def rewrite(path, change):
    """Change the open take file."""
    with h5py.File(path, "r+") as file:
        change(file)


def truncate(path, make_take):
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def link_elsewhere(path, make_take):
    def link(file):
        del file["/time"]
        file["/time"] = h5py.ExternalLink("other.h5", "/time")

    rewrite(path, link)


def hide_everything(path, make_take):
    def hide(file):
        file["/source/markers"][...] = np.nan
        if "/source/valid" in file:
            del file["/source/valid"]

    rewrite(path, hide)


def pose_two(path, make_take):
    api.write_take(make_take(posed=2), path, overwrite=True)


def freeze(path, make_take):
    take = make_take()
    still = take.source.with_matrix(np.ones_like(take.source.matrix))
    api.write_take(replace(take, source=still), path, overwrite=True)


def remove_targets(path, make_take):
    take = replace(make_take(), controls=None, params=None, animation=None)
    api.write_take(take, path, overwrite=True)


def spoil_nothing(path, make_take):
    pass


def remove(path, make_take):
    path.unlink()


@pytest.mark.parametrize(
    ("spoil", "options", "message"),
    [
        (truncate, (), "take.h5: file: expected a whole HDF5 file"),
        (link_elsewhere, (), "take.h5: /time: expected data in the file itself"),
        (hide_everything, (), "take.h5: /source/markers: expected at least one observed value"),
        (pose_two, (), "take.h5: /target/params: expected at least 3 posed frames, found 2"),
        (freeze, (), "take.h5: /source/markers: expected values that change"),
        (remove_targets, (), "take.h5: /target: expected poses"),
        (remove, (), "take.h5"),
        (spoil_nothing, ("--labels", 2), "take.h5: labels: expected at least 3"),
        (spoil_nothing, ("--labels", 99), "take.h5: labels: expected at most 12"),
        (spoil_nothing, ("--latent-dim", 0), "error: --latent-dim: expected at least 1"),
        (spoil_nothing, ("--optimizer", "adam"), "error: --optimizer: expected one of"),
        (spoil_nothing, ("--method", "magic"), "error: method: expected one of auto"),
    ],
)
def test_bad_input_gets_one_line_and_leaves_no_file(
    facert, make_take, take, model, tmp_path, spoil, options, message
):
    spoil(take, make_take)
    before = set(tmp_path.iterdir())
    failed = facert("train", take, "-o", model, "--log", tmp_path / "curve.csv", *options)
    assert failed.code == 3
    (line,) = [line for line in failed.err.splitlines() if line.startswith("error:")]
    assert message in line
    assert "Traceback" not in failed.err
    assert set(tmp_path.iterdir()) == before


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (
            "latent_dims = 8",
            "latent_dims: expected a setting, found an unknown name. Did you mean latent_dim?",
        ),
        ("latent_dim = 'many'", "latent_dim: expected int"),
        ("latent_dim = ", "file: expected TOML"),
        ("sigma_c = inf", "sigma_c: expected a finite number"),
    ],
)
def test_a_slip_in_the_config_file_is_named(facert, take, model, tmp_path, content, message):
    (tmp_path / "c.toml").write_text(content)
    failed = facert("train", take, "-o", model, "--config", tmp_path / "c.toml")
    assert failed.code == 3
    assert f"c.toml: {message}" in failed.err
    assert not model.exists()


@pytest.mark.parametrize("method", ["auto", "ssgplvm", "ridge"])
def test_a_device_that_is_not_there_is_wrong_usage(facert, take, model, method):
    failed = facert("train", take, "-o", model, "--method", method, "--device", "cuda:99")
    assert failed.code == 2
    assert "--device cuda:99" in failed.err
    assert not model.exists()


def test_the_model_needs_its_ending(facert, take, tmp_path):
    failed = facert("train", take, "-o", tmp_path / "model.pt")
    assert failed.code == 3
    assert "--output: expected a name ending in .safetensors" in failed.err


def test_resume_without_a_checkpoint_does_not_replace_a_finished_model(facert, take, model):
    assert facert("train", take, "-o", model).code == 0
    finished = model.read_bytes()

    refused = facert("train", take, "-o", model, "--labels", 5, *SHARED, "--resume")
    assert refused.code == 2
    assert model.read_bytes() == finished


@pytest.mark.parametrize(
    ("value", "shown"),
    [
        (0.0, "0"),
        (0.25, "0.25"),
        (1 / 3, "0.333"),
        (-12345.6789, "-12345.679"),
        (40.0, "40"),
        (1.23456e-5, "1.23e-05"),
        (float("nan"), "-"),
    ],
)
def test_numbers_are_shown_as_short_as_they_can_be(value, shown):
    assert _shown(value) == shown


def test_training_begins_at_a_model_with_its_settings(facert, take, model, tmp_path):
    assert facert("train", take, "-o", model, *QUICK, *SHARED).code == 0
    again = tmp_path / "again.safetensors"
    assert facert("train", take, "-o", again, "--start", model).code == 0
    first, second = api.load(model), api.load(again)
    assert second.settings == first.settings
    assert second.figures["iterations"] < first.figures["iterations"] / 3


def test_options_come_before_the_settings_of_the_start(facert, take, model, tmp_path):
    assert facert("train", take, "-o", model, *QUICK, *SHARED).code == 0
    again = tmp_path / "again.safetensors"
    assert facert("train", take, "-o", again, "--start", model, "--seed", 5).code == 0
    assert api.load(again).settings.seed == 5
    done = facert("train", take, "-o", again, "--start", model, "--latent-dim", 2, "--overwrite")
    assert done.code == 0
    assert "training begins anew: the start has another latent_dim" in done.err


def test_for_a_method_that_learns_in_one_go_a_start_is_idle(facert, take, model, tmp_path):
    assert facert("train", take, "-o", model, "--method", "ridge").code == 0
    done = facert("train", take, "-o", tmp_path / "b.safetensors", "--start", model)
    assert done.code == 0
    assert "ridge learns in one go: nothing to do for --start" in done.err
    assert "does not use" not in done.err  # nobody chose what the start has filled in


def test_what_learns_in_one_go_reports_that_nothing_is_kept(
    facert, make_take, tmp_path, monkeypatch
):
    def interrupted(*_, **__):
        raise KeyboardInterrupt

    take, model = tmp_path / "take.h5", tmp_path / "m.safetensors"
    api.write_take(make_take(), take)
    monkeypatch.setattr(api, "train", interrupted)
    stopped = facert("train", take, "-o", model, "--method", "ridge")
    assert stopped.code == 130
    assert stopped.err.endswith(
        "stopped: nothing is kept of what learns in one go; the same command begins anew\n"
    )
    assert list(tmp_path.iterdir()) == [take]

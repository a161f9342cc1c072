"""Training that is killed, stopped or ended, and goes on where it was."""

import shutil
import signal
import subprocess
import sys
import time

import pytest

import facert as api
from facert.retarget import checkpoint
from facert.retarget.checkpoint import checkpoint_path

SLOW = 'method = "ssgplvm"\ncheckpoint_every = 15\ntolerance = 0.0\nmax_iterations = 100\n'
"""Settings that leave time to stop a run."""


@pytest.fixture(scope="module")
def begun(make_take, tmp_path_factory):
    """A folder with a take, settings, and what a killed run has left."""
    folder = tmp_path_factory.mktemp("begun")
    api.write_take(make_take(frames=100, animation=60), folder / "take.h5")
    (folder / "slow.toml").write_text(SLOW)
    model = folder / "model.safetensors"
    code = stopped_in_training(signal.SIGKILL, arguments(folder), checkpoint_path(model))
    assert code == -signal.SIGKILL
    assert not model.exists()
    return folder


@pytest.fixture
def folder(begun, tmp_path):
    """A copy of it."""
    return shutil.copytree(begun, tmp_path / "copy")


def arguments(folder, name="model"):
    return (
        *("train", folder / "take.h5", "-o", folder / f"{name}.safetensors"),
        *("--config", folder / "slow.toml"),
    )


def stopped_in_training(number, arguments, checkpoint):
    """Exit code of ``facert`` in a process of its own, sent a signal once it has a checkpoint."""
    # A shell may start its background jobs with Ctrl-C ignored.
    code = """
import signal
from facert.cli.app import main
signal.signal(signal.SIGINT, signal.default_int_handler)
main()
"""
    process = subprocess.Popen(
        [sys.executable, "-c", code, *map(str, arguments)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    while not checkpoint.exists() and process.poll() is None:
        time.sleep(0.001)
    process.send_signal(number)
    return process.wait()


def test_a_killed_run_resumes_to_the_same_objective(facert, folder):
    resumed = facert(*arguments(folder), "--resume")
    assert resumed.code == 0, resumed.err
    assert "anew" not in resumed.err
    assert facert(*arguments(folder, "whole")).code == 0
    a, b = (api.load(folder / f"{name}.safetensors").figures for name in ("model", "whole"))
    assert a["iterations"] == b["iterations"]
    assert a["objective"] == pytest.approx(b["objective"], rel=1e-6)


def test_ctrl_c_keeps_the_best_model_and_the_checkpoint(facert, folder):
    model, curve = folder / "other.safetensors", folder / "curve.csv"
    first = (*arguments(folder, "other"), "--optimizer", "scg", "--log", curve)
    assert stopped_in_training(signal.SIGINT, first, checkpoint_path(model)) == 130
    stopped, logged = api.load(model).figures, curve.read_text()
    assert stopped["status"] == "interrupted"
    assert checkpoint_path(model).exists()

    assert facert(*first, "--resume").code == 0
    finished = api.load(model).figures
    assert finished["iterations"] > stopped["iterations"]
    assert finished["objective"] < stopped["objective"]
    assert finished["status"] == "iteration limit"
    assert curve.read_text().startswith(logged)
    assert len(curve.read_text()) > len(logged)

    (folder / "slow.toml").write_text(SLOW.replace("100", "5000").replace("tolerance = 0.0", ""))
    assert facert(*first, "--resume").code == 0
    assert api.load(model).figures["status"] == "converged"
    assert not checkpoint_path(model).exists()


def test_a_run_ended_within_a_stage_resumes_to_the_same_file(facert, make_take, tmp_path):
    take = tmp_path / "take.h5"
    api.write_take(make_take(frames=60, animation=40), take)
    often = tmp_path / "often.toml"
    often.write_text('method = "ssgplvm"\ncheckpoint_seconds = 0.0\nmax_iterations = 120\n')
    (tmp_path / "whole").mkdir()
    ended, whole = tmp_path / "model.safetensors", tmp_path / "whole" / "model.safetensors"
    arguments = ("train", take, "-o", ended, "--config", often, "--log", tmp_path / "curve.csv")
    assert stopped_in_training(signal.SIGTERM, arguments, checkpoint_path(ended)) == 143
    assert api.load(ended).figures["status"] == "interrupted"
    assert facert(*arguments, "--resume").code == 0
    assert facert("train", take, "-o", whole, "--config", often).code == 0
    assert ended.read_bytes() == whole.read_bytes()
    lines = (tmp_path / "curve.csv").read_text().splitlines()
    assert [int(line.partition(",")[0]) for line in lines[1:]] == list(range(1, len(lines)))


def test_a_checkpoint_of_another_version_is_not_used(facert, folder, monkeypatch):
    monkeypatch.setattr(checkpoint, "_program", lambda: "another")
    done = facert(*arguments(folder), "--resume")
    assert done.code == 0
    assert "is of another version of facert: training begins anew" in done.err


def test_a_checkpoint_of_another_take_is_refused(facert, make_take, folder):
    model = folder / "model.safetensors"
    api.write_take(make_take(seed=1), folder / "take.h5", overwrite=True)
    refused = facert(*arguments(folder), "--resume")
    assert refused.code == 3
    assert f"{checkpoint_path(model)}: fingerprint: expected" in refused.err
    assert not model.exists()

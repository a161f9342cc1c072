import logging

import numpy as np
import pytest
from scipy.optimize import rosen, rosen_der, rosen_hess

from facert.errors import InputError, OutputExistsError, OutputKeptError
from facert.io.tensors import write_tensors
from facert.models.optim.arrow import Arrow
from facert.models.optim.conditioned import Conditioned
from facert.models.optim.lbfgs import LBFGS
from facert.models.optim.monitor import Monitor, Progress
from facert.models.optim.optimiser import State
from facert.models.optim.scg import SCG
from facert.retarget.checkpoint import (
    FORMAT,
    CheckpointFile,
    CheckpointMetadata,
    CurveLog,
    Monitors,
    checkpoint_path,
)


def bowl(x):
    return float(x @ x), 2.0 * x


class Valley:
    """Rosenbrock's function, which knows its second derivatives."""

    def __call__(self, x):
        return rosen(x), rosen_der(x)

    def curvature(self, x):
        return Arrow([], np.arange(len(x))).add(np.arange(len(x)), rosen_hess(x))


def go_on(state):
    return False


@pytest.fixture
def progress():
    state = SCG().advance(bowl, SCG().start(bowl, np.arange(3.0)), 1, go_on)
    return Progress(state, (5.0, state.value))


@pytest.fixture
def path(tmp_path):
    return tmp_path / "model.checkpoint.safetensors"


def save(path, progress, fingerprint="a"):
    file = CheckpointFile(path, resume=False)
    file.resume(fingerprint)
    file.checkpoint(progress)


def test_the_checkpoint_lies_beside_the_model(tmp_path):
    assert checkpoint_path(tmp_path / "m.safetensors") == tmp_path / "m.checkpoint.safetensors"


def test_the_progress_of_an_optimiser_comes_back_whole(path, progress):
    save(path, progress)
    found = CheckpointFile(path, resume=True).resume("a")
    assert found.curve == progress.curve
    assert found.state.value == progress.state.value
    assert found.state.iterations == progress.state.iterations
    np.testing.assert_array_equal(found.state.x, progress.state.x)
    assert found.state.memory.keys() == progress.state.memory.keys()
    for name, array in progress.state.memory.items():
        np.testing.assert_array_equal(found.state.memory[name], array)


@pytest.mark.parametrize("inner", [SCG(), LBFGS()])
def test_the_progress_within_a_conditioned_stage_comes_back_whole(path, inner):
    states, search, valley = [], Conditioned(inner), Valley()
    search.advance(valley, search.start(valley, np.linspace(-1.5, -0.5, 6)), 60, states.append)
    within = next(state for state in states if "stage" in state.memory)
    save(path, Progress(within, (5.0, within.value)))
    found = CheckpointFile(path, resume=True).resume("a")
    assert found.state.memory.keys() == within.memory.keys()
    for name, array in within.memory.items():
        np.testing.assert_array_equal(found.state.memory[name], array)


def test_nothing_is_resumed_unless_asked_for(path, progress, caplog):
    save(path, progress)
    assert CheckpointFile(path, resume=False).resume("a") is None
    assert "--resume continues it" in caplog.text


def test_a_missing_checkpoint_is_told_and_training_begins_anew(path, caplog):
    assert CheckpointFile(path, resume=True).resume("a") is None
    assert "training begins anew" in caplog.text


def test_a_checkpoint_of_another_run_is_refused(path, progress):
    save(path, progress)
    with pytest.raises(InputError, match=r"model\.checkpoint\.safetensors: fingerprint"):
        CheckpointFile(path, resume=True).resume("b")


def test_a_checkpoint_without_its_arrays_is_refused(path):
    write_tensors(path, {"x": np.zeros(2)}, CheckpointMetadata("a"), FORMAT)
    with pytest.raises(InputError, match="expected x, curve and 3 scalars"):
        CheckpointFile(path, resume=True).resume("a")


def test_a_finished_run_leaves_no_checkpoint(path, progress):
    save(path, progress)
    CheckpointFile(path, resume=True).remove()
    assert not path.exists()
    CheckpointFile(path, resume=True).remove()


def test_the_curve_is_written_as_training_goes(tmp_path):
    log = CurveLog(tmp_path / "logs" / "curve.csv", overwrite=False)
    log.resume("a")
    for iteration in (1, 2):
        log.iteration(State(np.zeros(1), 0.1 * iteration, 3.0, iteration))
    lines = (tmp_path / "logs" / "curve.csv").read_text().splitlines()
    assert lines[0] == "iteration,objective,gradient_norm,seconds"
    assert lines[1].startswith("1,0.1,3.0,")
    assert len(lines) == 3


def test_an_existing_curve_stays_unless_it_may_be_replaced(tmp_path):
    path = tmp_path / "curve.csv"
    CurveLog(path, overwrite=False).resume("a")
    before = path.read_text()
    with pytest.raises(OutputExistsError):
        CurveLog(path, overwrite=False)
    assert path.read_text() == before


def test_a_recording_is_neither_replaced_nor_added_to(tmp_path):
    path = tmp_path / "curve.csv"
    path.write_text("time,jawOpen\n0,0.5\n")
    for goes_on in (False, True):
        with pytest.raises(OutputKeptError):
            CurveLog(path, overwrite=True, goes_on=goes_on)
    assert path.read_text() == "time,jawOpen\n0,0.5\n"
    checkpoint = checkpoint_path(tmp_path / "model.safetensors")
    checkpoint.write_text("somebody's")
    with pytest.raises(OutputKeptError):
        CheckpointFile(checkpoint, resume=True)


def test_no_curve_is_begun_before_training_is(tmp_path):
    CurveLog(tmp_path / "curve.csv", overwrite=False)
    assert not (tmp_path / "curve.csv").exists()


def test_several_monitors_are_all_told(progress):
    class Counter(Monitor):
        def __init__(self, resumed=None):
            self.calls, self.resumed = [], resumed

        def resume(self, fingerprint):
            self.calls.append(fingerprint)
            return self.resumed

        def iteration(self, state):
            self.calls.append(state)

        def checkpoint(self, progress):
            self.calls.append(progress)

    parts = Counter(), Counter(progress), Counter()
    monitors = Monitors(*parts)
    assert monitors.resume("a") is progress
    monitors.iteration(progress.state)
    monitors.checkpoint(progress)
    assert all(part.calls == ["a", progress.state, progress] for part in parts)


def test_only_what_matters_is_logged(path, progress, caplog):
    caplog.set_level(logging.DEBUG)
    save(path, progress)
    assert not caplog.records

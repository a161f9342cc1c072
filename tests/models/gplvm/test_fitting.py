from dataclasses import replace

import numpy as np
import pytest
import torch

from facert.models.gplvm.fitting import train
from facert.models.gplvm.initial_latents import align
from facert.models.gplvm.lle import constraint_matrix, view_rows
from facert.models.gplvm.module import GaussianView, SharedGPLVM
from facert.models.optim.lbfgs import LBFGS
from facert.models.optim.monitor import Monitor, Progress
from facert.models.optim.optimiser import State
from facert.models.optim.scg import SCG

OPTIONS = {
    "tolerance": 1e-6,
    "max_iterations": 1000,
    "checkpoint_every": 40,
    "fingerprint": "the run",
}


class Recorder(Monitor):
    """Keeps the last checkpoint, and can stop the run as Ctrl-C does."""

    def __init__(self, saved: Progress | None = None, stop_at: int | None = None) -> None:
        self.saved, self.stop_at = saved, stop_at
        self.states: list[State] = []

    def resume(self, fingerprint):
        assert fingerprint == "the run"
        return self.saved

    def iteration(self, state):
        self.states.append(state)
        if state.iterations == self.stop_at:
            raise KeyboardInterrupt

    def checkpoint(self, progress):
        self.saved = progress


@pytest.fixture(params=[SCG, LBFGS])
def optimiser(request):
    return request.param()


@pytest.fixture
def module():
    return make_module()


def make_module(labelled=8, alone=10):
    """Two noisy views of points in the plane."""
    rng = np.random.default_rng(0)
    latent = rng.normal(size=(labelled + 2 * alone, 2))
    X = np.tanh(latent[: labelled + alone] @ rng.normal(size=(2, 20)))
    Y = np.sin(np.r_[latent[:labelled], latent[labelled + alone :]] @ rng.normal(size=(2, 10)))
    X, Y = (U + 0.3 * rng.normal(size=U.shape) for U in (X, Y))
    M = constraint_matrix(X, Y, labelled, 5)
    rows = view_rows(labelled, len(X) - labelled, len(Y) - labelled)
    return SharedGPLVM(*map(GaussianView, (X, Y), rows, (1e-2, 5e-2)), M, align(M, 2))


def test_the_module_is_left_at_the_value_that_is_told(module, optimiser):
    before = module().item()
    result = train(module, optimiser, monitor=Monitor(), **OPTIONS)
    assert result.status == "converged"
    assert result.value == pytest.approx(module().item(), rel=1e-14)
    assert result.value < before
    assert result.evaluations >= result.iterations


def test_both_optimisers_reach_the_same_optimum_within_a_thousandth():
    scg, lbfgs = (
        train(make_module(), optimiser, monitor=Monitor(), **{**OPTIONS, "tolerance": 1e-7})
        for optimiser in (SCG(), LBFGS())
    )
    assert scg.value == pytest.approx(lbfgs.value, rel=1e-3)


def test_every_iteration_is_shown_and_none_is_worse(module, optimiser):
    recorder = Recorder()
    train(module, optimiser, monitor=recorder, **OPTIONS)
    assert (np.diff([state.value for state in recorder.states]) < 0).all()


def test_ctrl_c_keeps_the_best_state(module, optimiser):
    recorder = Recorder(stop_at=33)
    result = train(module, optimiser, monitor=recorder, **OPTIONS)
    *_, logged, best = recorder.states
    assert result.status == "interrupted"
    assert result.iterations == 33
    assert result.value == best.value
    # A log that was interrupted may lack its last line, which the resumed run then writes.
    assert recorder.saved.state is logged
    assert recorder.saved.curve[-1] == logged.value
    torch.testing.assert_close(
        torch.nn.utils.parameters_to_vector(module.parameters()), torch.from_numpy(best.x)
    )


def test_a_run_that_was_killed_goes_on_from_its_last_checkpoint_as_if_nothing_had_been(optimiser):
    class Killed(Exception):
        pass

    class Killer(Recorder):
        def iteration(self, state):
            if state.iterations == 47:
                raise Killed

    uninterrupted = train(make_module(), optimiser, monitor=Recorder(), **OPTIONS)
    killer = Killer()
    with pytest.raises(Killed):
        train(make_module(), optimiser, monitor=killer, **OPTIONS)
    assert killer.saved.state.iterations == 40
    resumed = train(make_module(), optimiser, monitor=Recorder(killer.saved), **OPTIONS)
    assert resumed.value == uninterrupted.value
    assert resumed.iterations == uninterrupted.iterations
    assert resumed.evaluations < uninterrupted.evaluations


def test_the_iteration_limit_counts_resumed_iterations_too(module, optimiser):
    recorder = Recorder()
    few = {**OPTIONS, "max_iterations": 25}
    assert train(module, optimiser, monitor=recorder, **few).status == "iteration limit"
    again = train(module, optimiser, monitor=Recorder(recorder.saved), **few)
    assert again.iterations == 25
    assert again.status == "iteration limit"


def test_a_module_that_cannot_descend_further_is_told(optimiser):
    class Bowl(torch.nn.Module):
        def __init__(self):
            super().__init__()
            self.x = torch.nn.Parameter(torch.zeros(3, dtype=torch.float64))

        def forward(self):
            return self.x.square().sum()

    assert train(Bowl(), optimiser, monitor=Monitor(), **OPTIONS).status == "stalled"


def test_the_decrease_is_judged_by_the_magnitude_that_is_given(optimiser):
    """An objective that ends near zero would else be followed to its last digit."""
    few = train(make_module(), optimiser, monitor=Monitor(), magnitude=1e9, **OPTIONS)
    many = train(make_module(), optimiser, monitor=Monitor(), **OPTIONS)
    assert few.status == many.status == "converged"
    assert few.iterations < many.iterations


def test_a_magnitude_below_the_objectives_own_changes_nothing():
    results = [
        train(make_module(), LBFGS(), monitor=Monitor(), magnitude=magnitude, **OPTIONS)
        for magnitude in (1.0, 50.0)
    ]
    assert results[0].value > 50.0
    assert results[0].iterations == results[1].iterations


@pytest.mark.parametrize(
    ("curve", "converged"),
    [
        ([100.0] * 5, False),  # too short to judge
        ([100.0] * 6, True),
        ([100.0 - i for i in range(10)], False),
        ([100.0, 100.0, 100.0, 100.0, 100.0, 90.0], False),  # one long step after short ones
        ([-100.0 - 1e-5 * i for i in range(10)], True),  # the objective may be negative
    ],
)
def test_convergence_is_a_small_relative_fall_over_several_iterations(curve, converged):
    progress = Progress(State(np.zeros(1), curve[-1], 0.0, len(curve)), tuple(curve))
    assert progress.converged(1e-6) is converged
    assert replace(progress, curve=()).converged(1e-6) is False


@pytest.mark.parametrize("stop_at", [1, 17, 40, 53])
def test_a_run_that_was_stopped_anywhere_resumes_bit_by_bit(optimiser, stop_at):
    options = {**OPTIONS, "max_iterations": 90, "tolerance": 0.0}
    whole, stopped = make_module(), Recorder(stop_at=stop_at)
    result = train(whole, optimiser, monitor=Recorder(), **options)
    train(make_module(), optimiser, monitor=stopped, **options)
    resumed = make_module()
    again = train(resumed, optimiser, monitor=Recorder(stopped.saved), **options)
    assert (again.value, again.iterations) == (result.value, result.iterations)
    for one, other in zip(whole.parameters(), resumed.parameters(), strict=True):
        assert torch.equal(one, other)


def test_checkpoints_come_by_time_and_change_nothing(optimiser):
    options = {**OPTIONS, "max_iterations": 60, "tolerance": 0.0}
    often = Counted()
    value = train(make_module(), optimiser, monitor=often, checkpoint_seconds=0.0, **options).value
    assert often.count >= len(often.states)
    seldom = Counted()
    assert train(make_module(), optimiser, monitor=seldom, **options).value == value
    assert seldom.count == 2


class Counted(Recorder):
    """Counts checkpoints as well."""

    count = 0

    def checkpoint(self, progress):
        super().checkpoint(progress)
        self.count += 1

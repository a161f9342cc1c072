"""A search in conditioned stages ends where the gradient is zero, interrupted or not."""

import numpy as np
import pytest
import torch

from facert.models.gplvm.fitting import train
from facert.models.optim.arrow import Arrow
from facert.models.optim.conditioned import FIRST, STAGE, Conditioned
from facert.models.optim.lbfgs import LBFGS
from facert.models.optim.monitor import Monitor
from facert.models.optim.scg import SCG

SIZE = 6
EVERY = 70  # ends a conditioned stage in its middle


class Valley(torch.nn.Module):
    """Rosenbrock's function of many variables: a bent valley, to whose end it is a long way."""

    def __init__(self):
        super().__init__()
        start = torch.linspace(-1.5, -0.5, SIZE, dtype=torch.float64)
        self.x = torch.nn.Parameter(start)

    def value(self, x):
        return (300.0 * (x[1:] - x[:-1].square()).square() + (1.0 - x[:-1]).square()).sum()

    def forward(self):
        return self.value(self.x)

    def curvature(self):
        x = self.x.detach().numpy()
        beside = -1200.0 * x[:-1]
        own = np.zeros(SIZE)
        own[:-1] = 3600.0 * x[:-1] ** 2 - 1200.0 * x[1:] + 2.0
        own[1:] += 600.0
        hessian = np.diag(own) + np.diag(beside, 1) + np.diag(beside, -1)
        return Arrow([], np.arange(SIZE)).add(np.arange(SIZE), hessian)


class Plain(Valley):
    """The valley without its second derivatives."""

    curvature = None


class Recorder(Monitor):
    """Keeps every checkpoint and can stop the run as Ctrl-C does."""

    def __init__(self, begin=None, stop_at=None):
        self.begin, self.stop_at, self.kept = begin, stop_at, []

    def resume(self, fingerprint):  # noqa: ARG002
        return self.begin

    def iteration(self, state):
        if state.iterations == self.stop_at:
            raise KeyboardInterrupt

    def checkpoint(self, progress):
        self.kept.append(progress)


@pytest.fixture(name="inner", params=[LBFGS, SCG], scope="module")
def _inner(request):
    return request.param()


def run(inner, monitor, module=None, max_iterations=500):
    module = module or Valley()
    result = train(
        module,
        Conditioned(inner),
        tolerance=1e-9,
        max_iterations=max_iterations,
        checkpoint_every=EVERY,
        fingerprint="",
        monitor=monitor,
        checkpoint_seconds=0.0,
    )
    return module.x.detach().numpy().copy(), result


@pytest.fixture(name="whole", scope="module")
def _whole(inner):
    """A run that was not interrupted: where it ended, and its checkpoints."""
    recorder = Recorder()
    return *run(inner, recorder), recorder.kept


def test_it_ends_at_the_zero_of_the_gradient(whole):
    x, result, _ = whole
    assert result.status == "converged"
    assert result.iterations > FIRST
    np.testing.assert_allclose(x, 1.0, rtol=1e-9)


def test_resumed_from_any_checkpoint_it_ends_in_the_same_place_bit_by_bit(inner, whole):
    x, result, kept = whole
    edges = {FIRST - 1, FIRST, FIRST + STAGE // 2, FIRST + STAGE - 1, FIRST + STAGE, EVERY}
    tried = [progress for progress in kept[:-1] if progress.state.iterations in edges]
    assert len(tried) > 4
    for progress in (*tried, kept[-1]):
        again, found = run(inner, Recorder(progress))
        assert np.array_equal(again, x)
        assert (found.value, found.iterations) == (result.value, result.iterations)


def test_stopped_in_its_last_steps_it_resumes_bit_by_bit(inner, whole):
    x, _, kept = whole
    stopped = Recorder(stop_at=kept[-1].state.iterations + 1)
    assert run(inner, stopped)[1].status == "interrupted"
    assert np.array_equal(run(inner, Recorder(stopped.kept[-1]))[0], x)


def test_a_first_stage_that_finds_no_descent_is_followed_by_a_conditioned_one():
    class Stuck(LBFGS):
        """Ends at once, unless it begins in the middle of conditioned variables."""

        def advance(self, objective, state, iterations, watch):
            if state.x.any():
                return type(state)(state.x, state.value, 1.0, state.iterations, stalled=True)
            return super().advance(objective, state, iterations, watch)

    assert run(Stuck(), Monitor())[1].value < 1e-3


def test_a_module_without_curvature_is_searched_in_plain_variables(inner):
    x, result = run(inner, Monitor(), module=Plain(), max_iterations=2000)
    assert result.iterations > FIRST
    np.testing.assert_allclose(x, 1.0, rtol=1e-3)

"""What every optimiser keeps to, and what each promises by itself."""

import numpy as np
import pytest
from scipy.optimize import rosen, rosen_der

from facert.errors import NumericalError
from facert.models.optim.lbfgs import LBFGS, _Stage
from facert.models.optim.optimiser import State
from facert.models.optim.scg import SCG

STAGE = 10


def rosenbrock(x):
    return float(rosen(x)), rosen_der(x)


def ill_conditioned(x):
    curvature = np.logspace(0, 4, len(x))
    return 1.0 + 0.5 * float(curvature @ x**2), curvature * x


def go_on(state):
    return False


def minimise(optimiser, objective, x, iterations=1000):
    start = optimiser.start(objective, np.asarray(x, dtype=float))
    return optimiser.advance(objective, start, iterations, go_on)


def in_stages(optimiser, objective, x, stages):
    state = optimiser.start(objective, x)
    for _ in range(stages):
        state = optimiser.advance(objective, state, STAGE, go_on)
    return state


@pytest.fixture(params=[SCG, LBFGS])
def optimiser(request):
    return request.param()


def test_the_valley_of_rosenbrock_is_followed_to_its_end(optimiser):
    found = minimise(optimiser, rosenbrock, [-1.2, 1.0, -0.5, 0.8])
    np.testing.assert_allclose(found.x, 1.0, atol=1e-6)
    assert found.value == rosenbrock(found.x)[0] < 1e-12


def test_an_ill_conditioned_quadratic_is_solved(optimiser):
    found = minimise(optimiser, ill_conditioned, np.ones(10))
    np.testing.assert_allclose(found.x, 0.0, atol=1e-6)
    assert found.stalled


def test_at_the_minimum_no_descent_is_left(optimiser):
    found = minimise(optimiser, ill_conditioned, np.zeros(10))
    assert found.stalled
    np.testing.assert_array_equal(found.x, 0.0)


def test_the_value_never_rises(optimiser):
    values = []

    def note(state):
        values.append(state.value)
        return False

    optimiser.advance(rosenbrock, optimiser.start(rosenbrock, np.array([-1.2, 1.0])), 60, note)
    assert len(values) > 20
    assert (np.diff(values) <= 0.0).all()


def test_the_state_tells_value_and_gradient_at_its_own_position(optimiser):
    state = minimise(optimiser, rosenbrock, [-1.2, 1.0], iterations=7)
    value, gradient = rosenbrock(state.x)
    assert state.iterations == 7
    assert state.value == value
    assert state.gradient_norm == np.linalg.norm(gradient)
    assert not state.stalled


def test_a_rejected_trial_is_not_shown_to_the_watcher_as_an_iteration_without_progress():
    def wall(x):
        return (float(-x[0]), -np.ones(1)) if x[0] < 1.0 else (np.inf, np.zeros(1))

    values = []

    def note(state):
        values.append(state.value)
        return False

    SCG().advance(wall, SCG().start(wall, np.zeros(1)), 20, note)
    assert (np.diff(values) < 0.0).all()


def test_the_watcher_can_end_the_run(optimiser):
    start = optimiser.start(rosenbrock, np.array([-1.2, 1.0]))
    state = optimiser.advance(rosenbrock, start, 50, lambda state: state.iterations == 3)
    assert state.iterations == 3
    assert not state.stalled


def test_stages_resumed_from_a_saved_state_retrace_the_run_bit_by_bit(optimiser):
    x = np.array([-1.2, 1.0, -0.5, 0.8])
    uninterrupted = in_stages(optimiser, rosenbrock, x, stages=4)
    stopped = in_stages(optimiser, rosenbrock, x, stages=2)
    another = type(optimiser)()
    for _ in range(2):
        stopped = another.advance(rosenbrock, stopped, STAGE, go_on)
    np.testing.assert_array_equal(stopped.x, uninterrupted.x)
    assert stopped.iterations == uninterrupted.iterations


@pytest.mark.parametrize("stop", [1, 2, 13, 29])
def test_scaled_conjugate_gradients_resume_bit_by_bit_after_any_iteration(stop):
    x = np.array([-1.2, 1.0, -0.5, 0.8])
    stopped = minimise(SCG(), rosenbrock, x, stop)
    resumed = SCG().advance(rosenbrock, stopped, 30 - stop, go_on)
    np.testing.assert_array_equal(resumed.x, minimise(SCG(), rosenbrock, x, 30).x)


def test_the_state_of_scaled_conjugate_gradients_is_finite_so_that_it_can_be_saved():
    for iterations in range(1, 30):
        memory = minimise(SCG(), rosenbrock, [-1.2, 1.0], iterations).memory
        assert all(np.isfinite(array).all() for array in memory.values())


@pytest.mark.parametrize("wall", [1.05, 1.5, 1.9, 3.0])
def test_infinite_values_behind_a_wall_are_survived(optimiser, wall):
    """The minimum at (1, 1) lies before the wall; an optimist steps behind it."""

    def walled(x):
        return rosenbrock(x) if np.abs(x).max() < wall else (np.inf, np.zeros_like(x))

    found = minimise(optimiser, walled, [0.0, 0.0])
    np.testing.assert_allclose(found.x, 1.0, atol=1e-5)


def test_a_long_step_into_infinity_is_cut_at_once(optimiser):
    """x - log x, infinite for x <= 0, whose curvature at 20 does not show the wall."""

    def barrier(x):
        if (x <= 0).any():
            return np.inf, np.zeros_like(x)
        return float(np.sum(x - np.log(x))), 1.0 - 1.0 / x

    assert minimise(optimiser, barrier, np.full(3, 20.0), 5).value < barrier(np.full(3, 20.0))[0]
    np.testing.assert_allclose(minimise(optimiser, barrier, np.full(3, 20.0)).x, 1.0, atol=1e-6)


def test_a_start_without_a_finite_value_is_refused(optimiser):
    with pytest.raises(NumericalError, match="not finite at the start"):
        optimiser.start(lambda x: (np.inf, np.zeros_like(x)), np.zeros(2))


def test_the_start_is_not_changed(optimiser):
    x = np.array([-1.2, 1.0])
    minimise(optimiser, rosenbrock, x, 20)
    np.testing.assert_array_equal(x, [-1.2, 1.0])


def test_in_place_of_infinity_a_line_search_sees_a_parabola_with_the_slope_that_is_known():
    """Its minimum is a tenth of the way."""
    x, gradient = np.array([1.0, -2.0, 0.5]), np.array([3.0, 1.0, -1.0])
    state = State(x, 7.0, float(np.linalg.norm(gradient)), 0)
    stage = _Stage(lambda at: (7.0 if (at == x).all() else np.inf, gradient), state, go_on)
    stage.evaluate(x)
    step = -0.7 * gradient
    value, slope = stage.evaluate(x + step)
    along, beyond = float(gradient @ step), float(slope @ step)
    curvature = value - state.value - along  # of 7 + along t + curvature t²
    assert along + 2.0 * curvature == pytest.approx(beyond)
    assert -along / (2.0 * curvature) == pytest.approx(0.1)
    np.testing.assert_allclose(slope / np.linalg.norm(slope), step / np.linalg.norm(step))

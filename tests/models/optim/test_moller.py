"""Scaled conjugate gradients against Møller's (1993) algorithm as it is printed."""

import numpy as np
import pytest
from scipy.optimize import rosen, rosen_der

from facert.models.optim.scg import SCG


def moller(E, slope, w, iterations, sigma=1e-5, scale=1e-6):
    """The weights after each iteration, by steps 1 to 9; λ̄ is the raise of λ that is in δ."""
    r = p = -slope(w)  # 1
    success, bar, successes, path = True, 0.0, 0, []
    for _ in range(iterations):
        if success:  # 2
            step = sigma / np.linalg.norm(p)
            delta = p @ (slope(w + step * p) - slope(w)) / step
        delta += (scale - bar) * (p @ p)  # 3
        if delta <= 0.0:  # 4
            bar = 2.0 * (scale - delta / (p @ p))
            delta, scale = -delta + scale * (p @ p), bar
        mu = p @ r  # 5
        ahead = w + mu / delta * p
        comparison = 2.0 * delta * (E(w) - E(ahead)) / mu**2  # 6
        success = comparison >= 0.0  # 7
        curved = delta / (p @ p)
        if success:
            w, before, r, bar = ahead, r, -slope(ahead), 0.0
            successes += 1
            beta = (r @ r - r @ before) / mu
            p = r if successes % len(w) == 0 else r + beta * p
            scale *= 0.25 if comparison >= 0.75 else 1.0
        else:
            bar = scale
        if comparison < 0.25:  # 8
            scale += curved * (1.0 - comparison)
        path.append(w)
    return np.array(path)


def rosenbrock(w):
    return float(rosen(w)), rosen_der(w)


@pytest.mark.parametrize(
    "start", [[-1.0, -1.0, 1.1], [-2.0, 0.0], [0.1, -0.1, 1.0, -0.2], [1.2, -1.0, -1.1, 1.9]]
)
def test_every_iteration_ends_where_the_algorithm_says(start):
    """From here it meets negative curvature, rejected and poorly predicted steps, and restarts.

    All its directions descend: facert would begin again at one that does not.
    """
    expected, optimiser = moller(rosen, rosen_der, np.array(start), 25), SCG()
    state = optimiser.start(rosenbrock, np.array(start))
    for w in expected:
        state = optimiser.advance(rosenbrock, state, 1, lambda _: False)
        np.testing.assert_allclose(state.x, w, rtol=1e-5, atol=1e-7)

import numpy as np
import pytest
import torch

from facert.models.gp.curvature import likelihood_hessian
from facert.models.gp.likelihood import negative_log_likelihood
from facert.models.kernels import KERNELS

N, Q, D, FLOOR, STEP = 7, 2, 5, 0.01, 1e-5


@pytest.mark.parametrize("kernel", KERNELS.values(), ids=KERNELS)
def test_it_is_the_slope_of_the_gradient(kernel):
    rng = np.random.default_rng(0)
    Z, X, logs = rng.normal(size=(N, Q)), rng.normal(size=(N, D)), np.array([0.3, -0.4, -3.0])

    def gradient(x):
        Z, logs = torch.from_numpy(x[:-3].reshape(N, Q)), torch.from_numpy(x[-3:])
        _, *parts = negative_log_likelihood(Z, logs, torch.from_numpy(X), D, FLOOR, kernel)
        return np.concatenate([part.numpy().ravel() for part in parts])

    x = np.concatenate([Z.ravel(), logs])
    steps = STEP * np.eye(len(x))
    slopes = [(gradient(x + s) - gradient(x - s)) / (2.0 * STEP) for s in steps]
    hessian = likelihood_hessian(Z, logs, X, D, FLOOR, kernel)
    np.testing.assert_allclose(hessian, slopes, atol=1e-6 * np.abs(hessian).max())

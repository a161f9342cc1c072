"""Value and gradient of the likelihood, beside its LAPACK and BLAS calls and other libraries.

Ours is measured as training calls it on the CPU (`facert.models.gplvm.module`), and as a function
of torch that is differentiated by torch, which costs some calls more.

GPy and GPyTorch are measured where they are installed. Each evaluates -log P(X|Z) of 120 columns
and its gradient at so many positions in 8 dimensions; scikit-learn's gradient is that of the kernel
parameters alone, the others' includes the positions.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from scipy.linalg.blas import dsymm, dsyrk
from scipy.linalg.lapack import dpotrf, dpotri
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel

from experiments.bench.figure import Call, Figure, cpu_seconds
from facert.data.arrays import FloatArray
from facert.models.closed_form import closed_form
from facert.models.gp.lapack import value_and_gradient
from facert.models.gp.likelihood import compact_factor, negative_log_likelihood

SIZES = (140, 240, 1000)
TORCH, ALONE = "through torch", "LAPACK and BLAS alone"
COLUMNS, LATENT = 120, 8
VARIANCE, INVERSE_WIDTH, NOISE = 1.0, 0.3, 0.1


@dataclass(frozen=True, eq=False)
class Problem:
    """Positions Z (n, 8) and observations X (n, 120)."""

    Z: FloatArray
    X: FloatArray

    @classmethod
    def of(cls, points: int) -> Problem:
        """With so many positions."""
        rng = np.random.default_rng(0)
        Z = rng.normal(size=(points, LATENT))
        return cls(Z, np.tanh(Z @ rng.normal(size=(LATENT, COLUMNS))))


def ours(problem: Problem) -> Call:
    log_kernel = np.log([VARIANCE, INVERSE_WIDTH, NOISE])
    F = compact_factor(torch.from_numpy(problem.X)).numpy()
    return lambda: value_and_gradient(problem.Z, log_kernel, F, COLUMNS, 0.0)


def through_torch(problem: Problem) -> Call:
    Z = torch.from_numpy(problem.Z).requires_grad_()
    theta = torch.tensor([VARIANCE, INVERSE_WIDTH, NOISE], dtype=torch.float64)
    log_kernel = theta.log().requires_grad_()
    F = compact_factor(torch.from_numpy(problem.X))

    def call() -> object:
        value = closed_form(lambda *v: negative_log_likelihood(*v, F, COLUMNS), Z, log_kernel)
        return torch.autograd.grad(value, [Z, log_kernel])

    return call


def lapack_alone(problem: Problem) -> Call:
    """What LAPACK and BLAS have for it, and nothing between their calls."""
    Z, n = problem.Z, len(problem.Z)
    squared = np.sum((Z[:, None] - Z) ** 2, axis=-1)
    K = np.asfortranarray(VARIANCE * np.exp(-0.5 * INVERSE_WIDTH * squared) + NOISE * np.eye(n))
    F_T = compact_factor(torch.from_numpy(problem.X)).numpy().T
    Z_T = np.column_stack([Z, np.ones(n)]).T

    def call() -> object:
        L, _ = dpotrf(K, lower=1, clean=0)
        K_inverse, _ = dpotri(L, lower=1, overwrite_c=1)
        A_T = dsymm(1.0, K_inverse, F_T, side=1, lower=1)
        G = dsyrk(-0.5, A_T, beta=1.0, c=K_inverse, trans=1, lower=1, overwrite_c=1)
        return dsymm(1.0, G, Z_T, side=1, lower=1)

    return call


def scikit_learn(problem: Problem) -> Call:
    kernel = ConstantKernel(VARIANCE) * RBF(INVERSE_WIDTH**-0.5) + WhiteKernel(NOISE)
    model = GaussianProcessRegressor(kernel, alpha=0.0, optimizer=None)
    model.fit(problem.Z, problem.X)
    return lambda: model.log_marginal_likelihood(model.kernel_.theta, eval_gradient=True)


def gpytorch_model(problem: Problem) -> Call:
    import gpytorch

    Z = torch.from_numpy(problem.Z).requires_grad_()
    X = torch.from_numpy(problem.X).T.contiguous()
    kernel = gpytorch.kernels.ScaleKernel(gpytorch.kernels.RBFKernel()).double()
    noise = gpytorch.likelihoods.GaussianLikelihood().double()
    kernel.outputscale, kernel.base_kernel.lengthscale = VARIANCE, INVERSE_WIDTH**-0.5
    noise.noise = NOISE
    variables = [Z, *kernel.parameters(), *noise.parameters()]
    mean = torch.zeros(len(Z), dtype=torch.float64)
    exact = gpytorch.settings.max_cholesky_size(len(Z) + 1)

    def call() -> object:
        with exact:
            prior = gpytorch.distributions.MultivariateNormal(mean, kernel(Z))
            return torch.autograd.grad(-noise(prior).log_prob(X).sum(), variables)

    return call


def gpy_model(problem: Problem) -> Call:
    import GPy

    kernel = GPy.kern.RBF(LATENT, variance=VARIANCE, lengthscale=INVERSE_WIDTH**-0.5)
    model = GPy.models.GPLVM(problem.X, LATENT, X=problem.Z.copy(), kernel=kernel)
    model.likelihood.variance = NOISE
    start = model.optimizer_array.copy()
    return lambda: model._objective_grads(start)


OTHERS = {"scikit-learn": scikit_learn, "GPyTorch": gpytorch_model, "GPy": gpy_model}


def figures(runs: int) -> list[Figure]:
    """Of every size against everything that is installed."""
    found = []
    for points in SIZES:
        problem = Problem.of(points)
        calls = {
            "ours": ours(problem),
            TORCH: through_torch(problem),
            ALONE: lapack_alone(problem),
        }
        for name, make in OTHERS.items():
            try:
                calls[name] = make(problem)
            except ImportError as error:
                print(f"{name} is left out: {error}")
        times = cpu_seconds(calls, runs, repeats=1 if points > 500 else 10, warm=2)
        times = {name: [1e3 * t for t in spent] for name, spent in times.items()}
        name, mine, through = f"likelihood, {points} latents", times.pop("ours"), times.pop(TORCH)
        found += [Figure.of(name, mine, "ms", other, theirs) for other, theirs in times.items()]
        found.append(Figure.of(f"{name}, {TORCH}", through, "ms", ALONE, times[ALONE]))
    return found

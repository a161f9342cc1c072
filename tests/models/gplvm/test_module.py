import numpy as np
import pytest
import torch
from scipy.stats import multivariate_normal

from facert.models.gplvm.lle import constraint_matrix, view_rows
from facert.models.gplvm.module import GaussianView, SharedGPLVM

LABELLED, SOURCE, TARGET, LATENT = 4, 3, 2, 2
FLOOR_X, FLOOR_Y = 0.01, 0.05


@pytest.fixture
def views():
    rng = np.random.default_rng(0)
    return rng.normal(size=(LABELLED + SOURCE, 5)), rng.normal(size=(LABELLED + TARGET, 3))


@pytest.fixture
def Z():
    return np.random.default_rng(1).normal(size=(LABELLED + SOURCE + TARGET, LATENT))


def make_module(X, Y, Z, constrained=True):
    M = constraint_matrix(X, Y, LABELLED, 3) if constrained else None
    rows = view_rows(LABELLED, len(X) - LABELLED, len(Y) - LABELLED)
    views = map(GaussianView, (X, Y), rows, (FLOOR_X, FLOOR_Y))
    return SharedGPLVM(*views, M, Z)


def view_energy(module, view):
    return view.value_and_gradient(module.Z.detach()[view.rows])[0].item()


def test_the_parameters_are_the_latent_coordinates_and_both_log_kernels(views, Z):
    shapes = {name: tuple(p.shape) for name, p in make_module(*views, Z).named_parameters()}
    assert shapes == {"Z": (9, LATENT), "source.log_kernel": (3,), "target.log_kernel": (3,)}
    assert all(p.dtype == torch.float64 for p in make_module(*views, Z).parameters())


def test_the_energy_is_that_of_equations_1_2_and_5(views, Z):
    X, Y = views
    module = make_module(X, Y, Z)
    Z_x, Z_y = Z[: len(X)], np.vstack([Z[:LABELLED], Z[len(X) :]])

    def minus_log_likelihood(U, latents, floor):
        squared = ((latents[:, None] - latents) ** 2).sum(axis=-1)
        K = np.exp(-0.5 * squared) + (1 / 100 + floor) * np.eye(len(latents))
        return -multivariate_normal(cov=K).logpdf(U.T).sum()

    M = constraint_matrix(X, Y, LABELLED, 3).toarray()
    prior = multivariate_normal(cov=np.linalg.inv(M.T @ M + np.eye(len(Z))))
    of_source = view_energy(module, module.source)
    of_target = view_energy(module, module.target)
    assert of_source == pytest.approx(minus_log_likelihood(X, Z_x, FLOOR_X))
    assert of_target == pytest.approx(minus_log_likelihood(Y, Z_y, FLOOR_Y))
    assert module().item() - of_source - of_target == pytest.approx(-prior.logpdf(Z.T).sum())
    assert module().item() == pytest.approx(
        minus_log_likelihood(X, Z_x, FLOOR_X)
        + minus_log_likelihood(Y, Z_y, FLOOR_Y)
        - prior.logpdf(Z.T).sum()
    )


def test_without_constraints_the_prior_is_standard_normal(views, Z):
    module = make_module(*views, Z, constrained=False)
    of_views = sum(view_energy(module, view) for view in (module.source, module.target))
    assert module().item() - of_views == pytest.approx(
        -multivariate_normal(cov=np.eye(LATENT)).logpdf(Z).sum()
    )


def test_the_order_of_the_unlabelled_rows_does_not_matter(views, Z):
    X, Y = views
    source = np.r_[:LABELLED, np.random.default_rng(2).permutation(SOURCE) + LABELLED]
    target = np.r_[:LABELLED, np.random.default_rng(3).permutation(TARGET) + LABELLED]
    latents = np.r_[source, target[LABELLED:] + SOURCE]
    permuted = make_module(X[source], Y[target], Z[latents])
    torch.testing.assert_close(permuted(), make_module(X, Y, Z)(), rtol=1e-10, atol=0.0)


def test_each_view_sees_its_own_rows_and_the_labelled_ones(views, Z):
    module = make_module(*views, Z)
    np.testing.assert_array_equal(module.latents(module.source), Z[:7])
    np.testing.assert_array_equal(module.latents(module.target), Z[[0, 1, 2, 3, 7, 8]])


def test_the_kernels_begin_at_the_papers_parameters_above_the_floors(views, Z):
    module = make_module(*views, Z)
    for view, floor in ((module.source, FLOOR_X), (module.target, FLOOR_Y)):
        assert view.kernel.theta == pytest.approx((1.0, 1.0, 1 / (1 / 100 + floor)))


def test_any_order_in_memory_will_do_for_the_initial_coordinates(views, Z):
    assert make_module(*views, np.asfortranarray(Z)).Z.is_contiguous()


def test_the_initial_coordinates_are_copied(views, Z):
    module = make_module(*views, Z)
    before = Z.copy()
    with torch.no_grad():
        module.Z.zero_()
    np.testing.assert_array_equal(Z, before)

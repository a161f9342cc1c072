import numpy as np
import pytest
import torch

from facert.models.gplvm.lle import constraint_matrix, view_rows
from facert.models.gplvm.module import GaussianView, SharedGPLVM
from facert.models.gplvm.sparse_view import MOST_COUNTED, SparseView, inducing_rows, row_weights
from facert.models.kernels import SquaredExponential

LABELLED, SOURCE, TARGET, LATENT = 5, 12, 8, 2
FLOORS = 0.01, 0.05


@pytest.fixture
def views():
    rng = np.random.default_rng(0)
    return rng.normal(size=(LABELLED + SOURCE, 6)), rng.normal(size=(LABELLED + TARGET, 3))


@pytest.fixture
def Z():
    return np.random.default_rng(1).normal(size=(LABELLED + SOURCE + TARGET, LATENT))


def both(X, Y, Z, inducing, **options):
    M = constraint_matrix(X, Y, LABELLED, 3)
    given = list(zip((X, Y), view_rows(LABELLED, SOURCE, TARGET), FLOORS, strict=True))
    return (
        SharedGPLVM(*(GaussianView(*view) for view in given), M, Z),
        SharedGPLVM(*(sparse_view(*view, Z, inducing, **options) for view in given), M, Z),
    )


def sparse_view(observations, rows, floor, Z, inducing, **options):
    first = Z[rows[inducing_rows(len(rows), LABELLED, inducing)]]
    weights = row_weights(len(rows), LABELLED)
    return SparseView(observations, rows, floor, SquaredExponential, first, weights, **options)


@pytest.mark.parametrize("approximation", ["vfe", "fitc"])
def test_where_all_rows_are_inducing_energy_and_posteriors_are_those_of_the_exact_model(
    views, Z, approximation
):
    exact, sparse = both(*views, Z, 50, approximation=approximation)
    torch.testing.assert_close(sparse(), exact(), rtol=1e-8, atol=0.0)
    z = np.random.default_rng(2).normal(size=(4, LATENT))
    for one, other in zip(exact.posteriors(), sparse.posteriors(), strict=True):
        np.testing.assert_allclose(other.predict(z).mean, one.predict(z).mean, atol=1e-6)


def test_inducing_latents_are_trained_with_the_rest(views, Z):
    _, sparse = both(*views, Z, 7)
    shapes = {name: tuple(p.shape) for name, p in sparse.named_parameters()}
    assert shapes["source.inducing"] == shapes["target.inducing"] == (7, LATENT)
    sparse().backward()
    assert all(p.grad.abs().max() > 0 for p in sparse.parameters())


def gradient_of(view, Z):
    gradient = torch.zeros_like(Z)
    gradient[view.rows] = view.value_and_gradient(Z[view.rows])[1]
    return gradient


def test_each_view_has_its_own_rows_and_the_labelled_ones(views, Z):
    """A row of one view does not pull at those of the other but by the prior."""
    _, sparse = both(*views, Z, 7)
    source, target = slice(LABELLED, LABELLED + SOURCE), slice(LABELLED + SOURCE, None)
    by_source, by_target = (gradient_of(view, sparse.Z.detach()) for view in sparse.children())
    assert (by_source[target] == 0).all()
    assert (by_target[source] == 0).all()
    assert (by_source[:LABELLED] != 0).all()
    assert (by_target[:LABELLED] != 0).all()


def test_it_takes_over_the_kernels_of_a_trained_model(views, Z):
    exact, sparse = both(*views, Z, 7)
    with torch.no_grad():
        exact.source.log_kernel.add_(0.3)
        exact.target.log_kernel.sub_(0.2)
    for view, trained in zip(sparse.children(), exact.children(), strict=True):
        view.begin_with(trained.kernel)
        assert view.kernel.theta == pytest.approx(trained.kernel.theta, rel=1e-12)


def test_unlabelled_rows_weigh_as_much_as_so_many_at_most():
    few, many = row_weights(40, 10), row_weights(5010, 10)
    assert (few == 1.0).all()
    assert (many[:10] == 1.0).all()
    assert many[10:].sum().item() == pytest.approx(MOST_COUNTED)


def test_inducing_latents_begin_at_labels_and_rows_spread_over_the_others():
    rows = inducing_rows(rows=1000, labelled=20, count=50)
    assert len(set(rows.tolist())) == 50
    np.testing.assert_array_equal(rows[:20], np.arange(20))
    assert len(inducing_rows(30, 20, 50)) == 30
    assert len(inducing_rows(900, 800, 50)) == 50

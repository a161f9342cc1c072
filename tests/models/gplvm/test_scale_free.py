"""Training does not see the scale of the latent space, which Eq. (4) leaves open."""

import numpy as np
import pytest
import torch

from facert.models.gplvm.lle import constraint_matrix, view_rows
from facert.models.gplvm.module import GaussianView, SharedGPLVM
from facert.models.gplvm.scale_free import ScaleFree
from facert.models.gplvm.sparse_view import SparseView, row_weights
from facert.models.kernels import SquaredExponential
from facert.models.optim.flat import FlatObjective

LABELLED, ALONE, LATENT = 5, 4, 2


def make(sparse=False, constrained=True):
    rng = np.random.default_rng(0)
    X, Y = rng.normal(size=(LABELLED + ALONE, 6)), rng.normal(size=(LABELLED + ALONE, 4))
    Z = 1.7 * rng.normal(size=(LABELLED + 2 * ALONE, LATENT))
    M = constraint_matrix(X, Y, LABELLED, 3) if constrained else None
    views = []
    for U, rows in zip((X, Y), view_rows(LABELLED, ALONE, ALONE), strict=True):
        if sparse:
            weights = row_weights(len(U), LABELLED)
            views.append(SparseView(U, rows, 0.02, SquaredExponential, Z[rows[:6]], weights))
        else:
            views.append(GaussianView(U, rows, 0.02))
    return SharedGPLVM(*views, M, Z)


@pytest.mark.parametrize("sparse", [False, True])
def test_the_objective_is_equation_4_at_unit_scale_and_the_same_at_every_other(sparse):
    model = make(sparse)
    free = ScaleFree(model)
    before = free().item()
    assert before != pytest.approx(model().item(), rel=1e-3)
    model.rescale()
    assert model.Z.square().mean().item() == pytest.approx(1.0)
    assert free().item() == pytest.approx(before, rel=1e-12)
    assert model().item() == pytest.approx(before, rel=1e-12)


@pytest.mark.parametrize("sparse", [False, True])
def test_a_model_that_is_rescaled_is_the_same_process(sparse):
    model = make(sparse)
    before = [view.predict(view.Z[:3]).mean for view in model.posteriors()]
    model.rescale()
    after = [view.predict(view.Z[:3]).mean for view in model.posteriors()]
    for one, other in zip(before, after, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-10)


@pytest.mark.parametrize("sparse", [False, True])
def test_its_gradient_is_the_slope_of_its_value(sparse):
    objective = FlatObjective(ScaleFree(make(sparse)))
    x, rng = objective.vector, np.random.default_rng(1)
    _, gradient = objective(x)
    for _ in range(3):
        step = 1e-6 * rng.normal(size=len(x))
        slope = (objective(x + step)[0] - objective(x - step)[0]) / 2.0
        assert gradient @ step == pytest.approx(slope, rel=1e-5, abs=1e-9)


@pytest.mark.parametrize("constrained", [True, False])
def test_its_curvature_is_the_slope_of_the_gradient_across_the_direction_of_scale(constrained):
    model = make(constrained=constrained)
    objective = FlatObjective(ScaleFree(model))
    x, size, rng = objective.vector, model.Z.numel(), np.random.default_rng(1)
    step = rng.normal(size=(3, len(x)))
    step[:, :size] -= np.outer(step[:, :size] @ x[:size], x[:size]) / (x[:size] @ x[:size])
    arrow = objective.curvature(x)
    dense = np.zeros((len(x), len(x)))
    for own, places in zip(arrow.own, arrow.places, strict=True):
        dense[np.ix_(places, places)] = own
    for beside, places in zip(arrow.beside, arrow.places, strict=False):
        dense[np.ix_(places, arrow.places[-1])] = beside
        dense[np.ix_(arrow.places[-1], places)] = beside.T
    ahead, behind = (
        np.array([objective(x + sign * 1e-5 * s)[1] for s in step]) for sign in (1.0, -1.0)
    )
    np.testing.assert_allclose(
        step @ dense @ step.T, step @ (ahead - behind).T / 2e-5, rtol=1e-5, atol=1e-4
    )


def test_a_sparse_model_has_no_curvature():
    assert ScaleFree(make(sparse=True)).curvature() is None


def test_its_parameters_are_those_of_the_model():
    model = make()
    for one, other in zip(ScaleFree(model).parameters(), model.parameters(), strict=True):
        assert one is other
    assert torch.equal(ScaleFree(model).Z, model.Z)

import numpy as np
import pytest

from facert.data.normalisation import Normalisation
from facert.models.gplvm.fitting import train
from facert.models.gplvm.initial_latents import align
from facert.models.gplvm.lle import constraint_matrix, view_rows
from facert.models.gplvm.module import GaussianView, SharedGPLVM
from facert.models.gplvm.source_mapping import Observation, SourceMapping
from facert.models.gplvm.staging import CORE_ALONE, CORE_LABELS, Core, TrainedViews, spread
from facert.models.optim.lbfgs import LBFGS
from facert.models.optim.monitor import Monitor


def test_rows_are_spread_evenly_and_differ():
    np.testing.assert_array_equal(spread(3, 6, 9), [3, 4, 5])
    np.testing.assert_array_equal(spread(10, 20, 4), [10, 12, 15, 17])
    assert spread(5, 5, 4).size == 0


def test_a_core_has_labels_in_front_and_so_many_others_of_each_view():
    X, Y = np.zeros((500, 4)), np.zeros((90, 3))
    core = Core.of(X, Y, labelled=20)
    assert (len(core.rows_x), len(core.rows_y)) == (20 + CORE_ALONE, 90)
    for rows in (core.rows_x, core.rows_y):
        np.testing.assert_array_equal(rows[:20], np.arange(20))
        assert (np.diff(rows) > 0).all()
    assert not core.is_all_of(X, Y)
    assert Core.of(X[:120], Y, labelled=20).is_all_of(X[:120], Y)


def test_of_very_many_labels_a_core_has_some():
    core = Core.of(np.zeros((3000, 4)), np.zeros((3000, 3)), labelled=3000)
    assert core.labelled == len(core.rows_x) == len(core.rows_y) == CORE_LABELS


LABELLED = 12


@pytest.fixture(scope="module")
def views():
    """Two views of the plane, 180 rows alone in each, the rows in no order."""
    rng = np.random.default_rng(0)
    latent = rng.uniform(-1, 1, size=(LABELLED + 360, 2))
    X = np.tanh(latent @ rng.normal(size=(2, 12)))
    Y = np.sin(latent @ rng.normal(size=(2, 8)))
    return X[: LABELLED + 180], np.delete(Y, slice(LABELLED, LABELLED + 180), axis=0)


@pytest.fixture(scope="module")
def trained(views):
    X, Y = views
    core = Core.of(X, Y, LABELLED)
    X, Y = X[core.rows_x], Y[core.rows_y]
    M = constraint_matrix(X, Y, LABELLED, 6)
    rows = view_rows(LABELLED, len(X) - LABELLED, len(Y) - LABELLED)
    views = map(GaussianView, (X, Y), rows, (1e-3, 1e-3))
    module = SharedGPLVM(*views, M, align(M, 2))
    train(
        module,
        LBFGS(),
        tolerance=1e-4,
        max_iterations=60,
        checkpoint_every=60,
        fingerprint="",
        monitor=Monitor(),
    )
    return core, module


def test_rows_of_the_core_stay_and_the_others_are_placed_where_their_view_explains_them(
    views, trained
):
    (X, Y), (core, module) = views, trained
    posteriors = module.posteriors()
    Z = TrainedViews.at(*posteriors).latents(X, Y, LABELLED)
    assert Z.shape == (LABELLED + 360, 2)
    np.testing.assert_array_equal(Z[core.rows_x], module.latents(module.source))
    Z_y = np.vstack([Z[:LABELLED], Z[len(X) :]])
    np.testing.assert_array_equal(Z_y[core.rows_y], module.latents(module.target))
    for Z_view, view, posterior in zip((Z[: len(X)], Z_y), (X, Y), posteriors, strict=True):
        error = np.abs(posterior.predict(Z_view).mean - view)
        assert error.mean() < 0.1 * view.std()


def test_kernels_in_other_units_are_those_of_the_observations_divided(trained):
    """K of observations divided by a unit is K divided by its square."""
    _, module = trained
    units = Normalisation(np.zeros(12), 3.0), Normalisation(np.zeros(8), 0.2)
    begin = TrainedViews(*module.posteriors(), *units)
    for view, unit, kernel in zip((begin.source, begin.target), units, begin.kernels, strict=True):
        expected = view.kernel.gram(view.Z) / unit.scale**2
        np.testing.assert_allclose(kernel.gram(view.Z), expected, rtol=1e-12)


def test_unknown_rows_are_placed_by_source_mapping_as_noisy_as_their_view(views, trained):
    (X, Y), (core, module) = views, trained
    source, target = module.posteriors()
    Z = TrainedViews.at(source, target).latents(X, Y, LABELLED)
    unknown = np.setdiff1d(np.arange(len(X)), core.rows_x)
    observed = Observation.of(X[unknown], np.sqrt(source.kernel.noise))
    expected = SourceMapping(source).solve(observed).z
    np.testing.assert_allclose(Z[unknown], expected, atol=1e-6)


def test_rows_in_other_units_find_the_same_places(views, trained):
    (X, Y), posteriors = views, trained[1].posteriors()
    units = Normalisation(np.full(12, 0.3), 3.0), Normalisation(np.full(8, -0.2), 0.2)
    rows = (unit.apply(view) for unit, view in zip(units, (X, Y), strict=True))
    found = TrainedViews(*posteriors, *units).latents(*rows, LABELLED)
    expected = TrainedViews.at(*posteriors).latents(X, Y, LABELLED)
    np.testing.assert_allclose(found, expected, atol=1e-6)

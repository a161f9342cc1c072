import numpy as np
import pytest
from scipy.stats import spearmanr

from facert.models.gplvm.initial_latents import align, principal_components
from facert.models.gplvm.lle import constraint_matrix

LABELLED = 12


@pytest.fixture
def curve():
    """Parameters of a curve: labelled frames, then those of either view alone."""
    return np.random.default_rng(0).random(LABELLED + 40 + 40)


@pytest.fixture
def M(curve):
    """Two views of the curve: a helix in space, and a bent line in the plane."""

    def helix(t):
        return np.stack([np.cos(3 * t), np.sin(3 * t), t], axis=1)

    def bow(t):
        return np.stack([t, t**2], axis=1)

    X = helix(curve[: LABELLED + 40])
    Y = bow(np.r_[curve[:LABELLED], curve[LABELLED + 40 :]])
    return constraint_matrix(X, Y, LABELLED, 6)


def test_coordinates_are_centred_with_unit_variance_and_uncorrelated(M):
    Z = align(M, 4)
    np.testing.assert_allclose(Z.mean(axis=0), 0.0, atol=1e-12)
    np.testing.assert_allclose(Z.T @ Z / len(Z), np.eye(4), atol=1e-8)


def test_a_curve_that_two_views_share_is_recovered(M, curve):
    recovered = align(M, 1)[:, 0]
    assert abs(spearmanr(recovered, curve).statistic) > 0.999


def test_signs_are_unique(M):
    Z = align(M, 4)
    assert (Z[np.abs(Z).argmax(axis=0), np.arange(4)] > 0).all()
    np.testing.assert_array_equal(align(M, 4), Z)


def test_fewer_dimensions_are_the_first_of_more(M):
    np.testing.assert_allclose(align(M, 2), align(M, 4)[:, :2], atol=1e-6)


def test_principal_components_carry_as_much_of_the_observations_as_any_coordinates_can():
    observations = np.random.default_rng(0).normal(size=(20, 6)) + 3.0
    Z = principal_components(observations, 3)
    centred = observations - observations.mean(axis=0)
    rebuilt = Z @ np.linalg.lstsq(Z, centred, rcond=None)[0]
    left_over = np.linalg.svd(centred, compute_uv=False)[3:]
    assert np.linalg.norm(centred - rebuilt) == pytest.approx(np.linalg.norm(left_over))


def test_the_largest_component_has_unit_variance_and_none_correlate():
    Z = principal_components(np.random.default_rng(0).normal(size=(20, 6)), 3)
    variances = Z.var(axis=0)
    assert variances[0] == pytest.approx(1.0)
    assert (np.diff(variances) < 0).all()
    np.testing.assert_allclose(Z.T @ Z / len(Z), np.diag(variances), atol=1e-12)

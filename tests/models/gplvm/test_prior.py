import numpy as np
import pytest
import torch
from scipy import sparse

from facert.models.gplvm import prior
from facert.models.gplvm.prior import latent_precision

LATENT = 3


@pytest.fixture
def M():
    rng = np.random.default_rng(0)
    return sparse.csr_array(np.where(rng.random((30, 20)) < 0.2, rng.random((30, 20)), 0.0))


def test_the_precision_is_that_of_equation_5_and_the_constant_its_normaliser(M):
    L, constant = latent_precision(M, 20, LATENT)
    expected = (M.T @ M).toarray() + np.eye(20)
    np.testing.assert_allclose(L.numpy(), expected)
    log_determinant = np.linalg.slogdet(expected)[1]
    assert constant == pytest.approx(LATENT / 2 * (20 * np.log(2 * np.pi) - log_determinant))


def test_a_sparse_precision_is_the_same(M, monkeypatch):
    dense, constant = latent_precision(M, 20, LATENT)
    monkeypatch.setattr(prior, "DENSE", 10)
    thin, same = latent_precision(M, 20, LATENT)
    assert thin.is_sparse
    torch.testing.assert_close(thin.to_dense(), dense)
    assert same == constant


def test_without_constraints_it_is_the_identity():
    L, constant = latent_precision(None, 5, LATENT)
    np.testing.assert_array_equal(L.numpy(), np.eye(5))
    assert constant == pytest.approx(7.5 * np.log(2 * np.pi))

import pytest
import torch

from facert.errors import NumericalError
from facert.models.gp.cholesky import cholesky
from facert.models.gp.jitter import JITTER_LADDER


def definite(n=5):
    A = torch.randn(n, n, generator=torch.Generator().manual_seed(0), dtype=torch.float64)
    return A @ A.T + torch.eye(n)


def test_the_factor_is_lower_and_gives_the_matrix_back(caplog):
    K = definite()
    L = cholesky(K)
    torch.testing.assert_close(L @ L.T, K)
    torch.testing.assert_close(L, L.tril())
    assert not caplog.records


def test_only_the_lower_triangle_is_read():
    K = definite()
    torch.testing.assert_close(cholesky(K + torch.full_like(K, 7.0).triu(1)), cholesky(K))


def test_jitter_on_a_singular_matrix_is_small_and_reports_itself(caplog):
    K = torch.ones(4, 4, dtype=torch.float64)
    L = cholesky(K)
    torch.testing.assert_close(L @ L.T, K, atol=2 * JITTER_LADDER[-1], rtol=0.0)
    (record,) = caplog.records
    assert record.levelname == "WARNING"
    assert "to the diagonal of a 4 x 4 kernel" in record.getMessage()


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_jitter_is_relative_to_the_diagonal(scale):
    K = scale * torch.ones(4, 4, dtype=torch.float64)
    torch.testing.assert_close(cholesky(K), scale**0.5 * cholesky(K / scale))


@pytest.mark.parametrize("bad", [torch.nan, torch.inf, -torch.inf])
@pytest.mark.parametrize("place", [(0, 0), (3, 1), (4, 4)])
def test_nan_and_infinity_raise_before_any_jitter(bad, place, caplog):
    K = definite()
    K[place] = bad
    with pytest.raises(NumericalError, match="NaN or infinity"):
        cholesky(K)
    assert not caplog.records


def test_a_hopeless_matrix_raises_with_advice():
    with pytest.raises(NumericalError, match="raise the noise floor"):
        cholesky(torch.tensor([[1.0, 2.0], [2.0, 1.0]], dtype=torch.float64))

import numpy as np
import pytest

from facert.models.optim.arrow import Arrow

SIZE = 9
LEFT, RIGHT, BODY = np.array([1, 4, 7]), np.array([0, 8]), np.array([2, 3, 5, 6])


def blocks():
    rng = np.random.default_rng(0)
    for places in (LEFT, RIGHT):
        own = np.concatenate([places, BODY])
        A = rng.normal(size=(len(own), len(own)))
        yield own, A @ A.T


@pytest.fixture
def dense():
    whole = np.zeros((SIZE, SIZE))
    for places, block in blocks():
        whole[np.ix_(places, places)] += block
    return whole


def make(wings=(LEFT, RIGHT), body=BODY):
    arrow = Arrow(wings, body)
    for places, block in blocks():
        arrow.add(places, block)
    return arrow


@pytest.mark.parametrize(
    "arrow", [make(), make((LEFT[:0], LEFT[:0]), np.arange(SIZE))], ids=["wings", "body alone"]
)
def test_its_factor_is_that_of_the_dense_matrix(arrow, dense):
    shift = 0.5 * dense.diagonal().mean()
    factor, g = arrow.factor(0.5), np.random.default_rng(1).normal(size=SIZE)
    expected = np.linalg.solve(dense + shift * np.eye(SIZE), g)
    np.testing.assert_allclose(factor.restore(factor.whiten(g)), expected, rtol=1e-10)
    y = np.random.default_rng(2).normal(size=SIZE)
    assert factor.whiten(g) @ y == pytest.approx(g @ factor.restore(y))


def test_one_that_is_not_positive_definite_has_none_until_it_is_shifted(dense):
    arrow = make().add(BODY, -2.0 * np.linalg.norm(dense, 2) * np.eye(len(BODY)))
    assert arrow.factor(0.0) is None
    assert arrow.factor(10.0) is not None


def test_a_system_is_solved_whether_it_is_positive_definite_or_not(dense):
    arrow, g = make(), np.random.default_rng(1).normal(size=SIZE)
    size = dense.diagonal().mean()
    for shift in (0.5, -0.7):
        expected = np.linalg.solve(dense + shift * size * np.eye(SIZE), g)
        np.testing.assert_allclose(arrow.solve(g, shift), expected, rtol=1e-9)

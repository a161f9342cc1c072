import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from facert.evaluation.cells import Cell, Outcome
from facert.evaluation.metrics import Scores
from facert.evaluation.paired import MeanWithError, errors_by_method, paired_ratio

numbers = st.lists(st.floats(0.01, 1.0), min_size=2, max_size=8).map(np.array)


def outcome(method, labels, repeat, rms):
    scores = None if rms is None else Scores(rms, (rms,), rms)
    return Outcome(Cell(method, labels, 100, repeat), scores)


def test_a_mean_comes_with_its_standard_error():
    found = MeanWithError.of(np.array([1.0, 3.0, 5.0]))
    assert (found.value, found.se) == (3.0, pytest.approx(2.0 / 3**0.5))
    assert np.isnan(MeanWithError.of(np.array([1.0])).se)


@given(numbers, st.floats(0.1, 10.0))
def test_what_all_draws_share_is_no_error_of_the_ratio(errors, factor):
    found = paired_ratio(factor * errors, errors)
    assert (found.value, found.se) == (pytest.approx(factor), pytest.approx(0.0, abs=1e-12))


@given(numbers, st.floats(0.1, 10.0))
def test_a_ratio_does_not_depend_on_the_unit(errors, factor):
    others = errors[::-1]
    one, other = paired_ratio(errors, others), paired_ratio(factor * errors, factor * others)
    assert (other.value, other.se) == (pytest.approx(one.value), pytest.approx(one.se, abs=1e-12))


def test_the_error_of_a_ratio_is_what_repeated_draws_show():
    rng = np.random.default_rng(0)
    hard = rng.uniform(0.5, 1.5, (2000, 20))  # how hard a draw is, for all methods alike
    errors, others = (hard * rng.uniform(0.9, 1.1, hard.shape) for _ in range(2))
    found = [paired_ratio(e, o) for e, o in zip(errors, others, strict=True)]
    spread = np.std([estimate.value for estimate in found])
    assert np.mean([estimate.se for estimate in found]) == pytest.approx(spread, rel=0.05)


def test_methods_that_ran_every_cell_have_a_table_of_errors():
    cells = [("a", 20, 1), ("a", 10, 0), ("b", 10, 0), ("a", 10, 1), ("b", 20, 0), ("a", 20, 0)]
    outcomes = [outcome(*cell, rms=cell[1] + cell[2]) for cell in cells]
    outcomes += [outcome("b", 10, 1, None), outcome("b", 20, 1, 0.1)]
    errors = errors_by_method(outcomes)
    assert list(errors) == ["a"]
    assert errors["a"].tolist() == [[10, 11], [20, 21]]


def test_no_error_at_all_can_be_divided_by():
    assert errors_by_method([outcome("a", 10, 0, 0.0)])["a"].min() > 0

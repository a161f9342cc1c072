"""k-medoids against what they are by definition."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.distance import cdist

from facert.posing.medoids import MedoidProblem


def problem_of(points: np.ndarray, covered: np.ndarray | None = None) -> MedoidProblem:
    everywhere = np.full(len(points), np.inf)
    rivals = np.eye(len(points), dtype=bool)
    return MedoidProblem(cdist(points, points), everywhere if covered is None else covered, rivals)


def points(seed: int, count: int = 30) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=(count, 3))


@given(st.integers(0, 10_000), st.integers(1, 6), st.booleans())
def test_the_costs_of_all_exchanges_are_those_of_each(seed: int, count: int, posed: bool) -> None:
    given_points = points(seed, 15)
    covered = np.linalg.norm(given_points - given_points.mean(axis=0), axis=1) if posed else None
    problem = problem_of(given_points, covered)
    chosen = np.random.default_rng(seed).permutation(15)[:count]
    costs = problem.exchange_costs(chosen)
    for slot, candidate in np.ndindex(costs.shape):
        exchanged = chosen.copy()
        exchanged[slot] = candidate
        if len(set(exchanged)) < count:
            assert costs[slot, candidate] == np.inf
        else:
            assert costs[slot, candidate] == pytest.approx(problem.cost(exchanged))


@pytest.mark.parametrize("seed", range(5))
def test_medoids_are_nearly_the_best_of_all_choices(seed: int) -> None:
    problem = problem_of(points(seed, 14))
    best = min(problem.cost(np.array(chosen)) for chosen in combinations(range(14), 4))
    assert problem.cost(problem.medoids(4)) <= 1.03 * best


def test_every_cluster_gets_its_middle() -> None:
    middles = 100.0 * np.random.default_rng(0).normal(size=(7, 3))
    around = middles[:, None] + np.array([[0, 0, 0], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]])
    assert sorted(problem_of(around.reshape(-1, 3)).medoids(7)) == [5 * k for k in range(7)]


def test_the_order_of_the_points_does_not_matter() -> None:
    given_points, order = points(1), np.random.default_rng(2).permutation(30)
    there, back = problem_of(given_points).medoids(6), problem_of(given_points[order]).medoids(6)
    assert there.tolist() == order[back].tolist()


def test_the_first_serves_best_alone_and_the_second_beside_it() -> None:
    problem = problem_of(points(3))
    chosen = problem.medoids(5)
    assert problem.cost(chosen[:1]) == min(problem.cost(chosen[[k]]) for k in range(5))
    pairs = [problem.cost(chosen[[0, k]]) for k in range(1, 5)]
    assert problem.cost(chosen[:2]) == min(pairs)


def test_what_is_covered_needs_nothing_more() -> None:
    two = np.vstack([points(4), points(5) + 100.0])
    covered = np.where(np.arange(60) < 30, 0.0, 170.0)
    assert (problem_of(two, covered).medoids(4) >= 30).all()


def test_points_of_little_weight_hardly_count() -> None:
    two = np.vstack([points(4), points(5) + 100.0])
    weights = np.where(np.arange(60) < 30, 1e-9, 1.0)
    assert (problem_of(two).weighted(weights).medoids(4) >= 30).all()


def test_rivals_are_chosen_together_only_where_there_is_nothing_else() -> None:
    line = np.arange(12.0)[:, None]
    rivals = np.abs(line - line.T) < 3
    problem = MedoidProblem(cdist(line, line), np.full(12, np.inf), rivals)
    assert np.diff(np.sort(problem.medoids(3))).min() >= 3
    assert len(set(problem.medoids(8))) == 8

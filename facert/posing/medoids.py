"""k-medoids: the points that all others are near to.

Of candidates j, choose a set C that minimises

    Σ_i min(c_i, min_{j in C} d_ij),

d_ij the distance of point i to candidate j, and c_i how near it is already to what was chosen
before. One candidate after the other is added, each time the best; then they are exchanged, the
best exchange first, until none helps. An exchange of s for j costs

    Σ_i min(d1_i, d_ij)  +  Σ_{i nearest to s} [min(d2_i, d_ij) - min(d1_i, d_ij)],

d1 and d2 the distances of i to the nearest and the second nearest of C: all exchanges together take
no longer than a product of matrices (Schubert and Rousseeuw 2019, Faster k-Medoids Clustering).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from facert.data.arrays import BoolArray, FloatArray, IntArray

MOST_EXCHANGES = 200
LEAST_GAIN = 1e-6  # an exchange that gains less, relative to the sum, is rounding


@dataclass(frozen=True, eq=False)
class MedoidProblem:
    """Points, the candidates to choose medoids from, and which of these may go together."""

    distances: FloatArray  # (n, m): Of n points to m candidates
    # (n,): Distance of each point to what was chosen before; infinite if there is nothing
    covered: FloatArray
    # (m, m): Candidates that are not to be chosen together; each is its own rival
    rivals: BoolArray

    def weighted(self, weights: FloatArray) -> MedoidProblem:
        """The problem with points weighted by numbers above 0, (n,)."""
        return MedoidProblem(self.distances * weights[:, None], self.covered * weights, self.rivals)

    def medoids(self, count: int) -> IntArray:
        """The best candidates, rivals only where there is nothing else, (count,).

        The most useful first: the first alone serves best, the second best beside it.
        """
        chosen = self._greedy(np.arange(len(self.rivals)), count)
        for _ in range(MOST_EXCHANGES):
            costs = self.exchange_costs(chosen)
            slot, candidate = np.unravel_index(costs.argmin(), costs.shape)
            if not costs[slot, candidate] < (1.0 - LEAST_GAIN) * self.cost(chosen):
                break
            chosen[slot] = candidate
        return self.ranked(chosen)

    def cost(self, chosen: IntArray) -> float:
        """The sum that is minimised."""
        return float(np.minimum(self.distances[:, chosen].min(axis=1), self.covered).sum())

    def exchange_costs(self, chosen: IntArray) -> FloatArray:
        """The sum with one of the chosen (k,) exchanged, (k, m); infinite for rivals.

        Leaving a chosen one where it is counts as an exchange too.
        """
        near = np.column_stack([self.distances[:, chosen], self.covered])
        owner, first, second = _two_nearest(near)
        kept = np.minimum(self.distances, first[:, None])
        lost = np.minimum(self.distances, second[:, None]) - kept
        owned = (owner[:, None] == np.arange(len(chosen))).astype(np.float64)
        costs: FloatArray = kept.sum(axis=0) + owned.T @ lost
        rivals = self.rivals[chosen]
        costs[rivals.sum(axis=0) - rivals > 0] = np.inf
        return costs

    def ranked(self, chosen: IntArray) -> IntArray:
        """The chosen in another order, the most useful first."""
        return self._greedy(chosen, len(chosen))

    def _greedy(self, among: IntArray, count: int) -> IntArray:
        """Candidates one after the other, each the best beside those before, (count,)."""
        chosen, best = np.empty(0, dtype=np.int64), self.covered
        for _ in range(count):
            costs = np.minimum(self.distances[:, among], best[:, None]).sum(axis=0)
            taken = self.rivals[np.ix_(chosen, among)].any(axis=0)
            if taken.all():
                taken = np.isin(among, chosen)
            added = among[np.where(taken, np.inf, costs).argmin()]
            chosen = np.append(chosen, added)
            best = np.minimum(best, self.distances[:, added])
        return chosen


def _two_nearest(near: FloatArray) -> tuple[IntArray, FloatArray, FloatArray]:
    """Column of the least value in each row, that value, and the second least."""
    order = np.argpartition(near, 1, axis=1)[:, :2]
    pair = np.take_along_axis(near, order, axis=1)
    swapped = pair[:, 0] > pair[:, 1]
    return np.where(swapped, order[:, 1], order[:, 0]), pair.min(axis=1), pair.max(axis=1)

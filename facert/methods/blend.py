"""`auto`: the default, a blend of experts weighted by how well each predicts the labels.

No one method suits all captures. Where the rig follows the markers linearly, factors that all
frames and poses share are hard to beat (`facert.models.factors`); where skin and rig do not, a
Gaussian process on the markers as they are is. `auto` has four experts:

1. a Gaussian process with a linear term, on the source as it is;
2. the same on half-whitened features;
3. the factors, shrunk towards likely poses;
4. the factors plus a Gaussian process on half-whitened features that predicts their residual,
   learned from their cross-validated errors, shrunk likewise.

With P_e (l, d_y) the poses that expert e predicts for labels in cross-validation, clipped to the
limits of the poses, the weights minimise

    |Σ_e w_e P_e - Y|² + ρ E |w|²,      w_e >= 0,      Σ_e w_e = 1,

E the least squared error of one expert: few labels hardly determine which expert is best, and ρ
then keeps the weights together (Breiman 1996, Stacked Regressions).
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Annotated, Self

import numpy as np
from scipy.optimize import nnls

from facert.data.arrays import FloatArray, IntArray, rms
from facert.methods.base import Labelled, TrainingReport, Unlabelled, stacked
from facert.methods.factors import FactorMap
from facert.methods.folds import ranked_folds
from facert.methods.held_out import held_out
from facert.methods.processes import Basis, FeatureProcess, ProcessBank
from facert.methods.regression import Map, Regression, Variance
from facert.methods.shrinkage import Shrinkage

TOGETHER = 0.3  # ρ
FAULTLESS = 1e-9  # least E, relative to the squared error of the worst expert
EXPERTS = (
    "Gaussian process on the source",
    "Gaussian process on features",
    "factors",
    "factors and Gaussian process",
)
# Poses without a frame that the factors are learned from: the time that it takes grows with them.
MOST_POSES = 500
# With more labels a fifth of them changes a kernel little, and folds keep that of all.
FEW = 100
UNBOUNDED = 1e9  # in normalised units: no limit, in a file of finite numbers


@dataclass(frozen=True, eq=False)
class BlendMap(Map):
    """The experts and their weights."""

    weights: Annotated[FloatArray, "4"]  # (4,)
    range: Annotated[FloatArray, "2y"]  # (2, d_y): What every expert is clipped to
    # (d_y,): Cross-validation error of the shrunk factors, root mean square. Their own spread is
    # that of free poses, and does not depend on how well the labels fix them.
    factor_error: Annotated[FloatArray, "y", "doubt"]
    plain: FeatureProcess
    whitened: FeatureProcess
    factors: FactorMap
    residual: FeatureProcess  # Predicts the factors' error
    # Shrinkage of the factors without and with the residual
    shrinkage: Shrinkage
    residual_shrinkage: Shrinkage

    def __call__(self, X: FloatArray) -> tuple[FloatArray, Variance]:
        """Poses of frames X (T, d_x), (T, d_y); the variance is the experts', weighted alike."""
        predicted, variances = self._bank(X)
        poses = np.empty((len(self._used), *predicted.shape[1:]))
        poses[:-2] = predicted[:-1]
        factors = poses[-2:]  # without and with the process of their residual
        self._clip(self.factors(X)[0], factors[0])
        self._clip(factors[0] + predicted[-1], factors[1])
        np.add(np.matmul(factors, self._matrices), self._offsets, out=factors)
        self._clip(poses, poses)
        pose = self._used @ poses.reshape(len(poses), -1)
        return pose.reshape(predicted.shape[1:]), lambda: self._variance(variances())

    def _variance(self, of_processes: FloatArray) -> FloatArray:
        """Variance of poses (T, d_y), from that of the processes in the bank, (p, T)."""
        shares = np.delete(self._used, -2)
        return np.asarray((shares @ of_processes)[:, None] + self.weights[2] * self.factor_error**2)

    @cached_property
    def _direct(self) -> Sequence[int]:
        """Indices of the experts with a weight that are a process alone."""
        return [expert for expert in (0, 1) if self.weights[expert] > 0.0]

    @cached_property
    def _used(self) -> FloatArray:
        """Weights of the experts in use: processes, factors without and with their residual."""
        return np.asarray(self.weights[[*self._direct, 2, 3]])

    @cached_property
    def _bank(self) -> ProcessBank:
        processes = [(self.plain, self.whitened)[expert] for expert in self._direct]
        return ProcessBank([*processes, self.residual])

    @cached_property
    def _ends(self) -> tuple[FloatArray, ...]:
        return tuple(self.range)

    @cached_property
    def _matrices(self) -> FloatArray:
        return np.stack([self.shrinkage.matrix, self.residual_shrinkage.matrix])

    @cached_property
    def _offsets(self) -> FloatArray:
        return np.stack([s.offset for s in (self.shrinkage, self.residual_shrinkage)])[:, None]

    def _clip(self, poses: FloatArray, out: FloatArray) -> None:
        low, high = self._ends
        np.maximum(poses, low, out=out)
        np.minimum(out, high, out=out)


@dataclass(frozen=True, eq=False)
class BaseMaps:
    """Three maps learned from the same data: two processes, and factors started from them.

    The search for the factors begins at the mean of what both processes predict: clean captures
    want the one, real markers the other, and their mean serves all.
    """

    plain: FeatureProcess
    whitened: FeatureProcess
    factors: FactorMap

    @classmethod
    def learn(cls, labelled: Labelled, unlabelled: Unlabelled) -> BaseMaps:
        """The maps of labelled frames, frames and poses."""
        frames, poses = stacked(labelled, unlabelled)
        mean = poses.mean(axis=0)
        plain = FeatureProcess.learn(labelled, Basis.plain(frames), mean)
        whitened = FeatureProcess.learn(labelled, Basis.half_whitened(frames), mean)
        guess = (plain(unlabelled.X)[0] + whitened(unlabelled.X)[0]) / 2.0
        return cls(plain, whitened, FactorMap.learn(labelled, unlabelled, guess))

    def __call__(self, X: FloatArray) -> FloatArray:
        """Poses of frames X (T, d_x) by each map, (3, T, d_y)."""
        return np.array([map_(X)[0] for map_ in (self.plain, self.whitened, self.factors)])


def cross_validated_poses(labelled: Labelled, unlabelled: Unlabelled, maps: BaseMaps) -> FloatArray:
    """Poses that each of the base maps predicts for labels that it was not given, (3, l, d_y).

    The factors have no closed form of it: they are learned five times more, each time without the
    poses of a fifth of the labels, and the processes with them. Of so many labels that a part of
    them determines a kernel the processes keep theirs, see `facert.methods.held_out`.
    """
    predicted = np.empty((3, *labelled.Y.shape))
    folds = ranked_folds(labelled.X)
    if len(labelled.X) > FEW:
        return _with_their_kernels(labelled, unlabelled, maps, folds)
    for train, test in folds:
        rest, others = _without(labelled, unlabelled, train, test)
        predicted[:, test] = BaseMaps.learn(rest, others)(labelled.X[test])
    return predicted


def _without(
    labelled: Labelled, unlabelled: Unlabelled, train: IntArray, test: IntArray
) -> tuple[Labelled, Unlabelled]:
    """The data without the poses of the labels to test on."""
    frames = np.vstack([unlabelled.X, labelled.X[test]])
    rest = Labelled(labelled.X[train], labelled.Y[train])
    return rest, Unlabelled(frames, unlabelled.Y)


def _with_their_kernels(
    labelled: Labelled,
    unlabelled: Unlabelled,
    maps: BaseMaps,
    folds: Sequence[tuple[IntArray, IntArray]],
) -> FloatArray:
    """`cross_validated_poses` by processes whose kernels and features are those of all labels."""
    predicted = np.empty((3, *labelled.Y.shape))
    X, count = np.vstack([unlabelled.X, labelled.X]), len(unlabelled.X)
    data = [_without(labelled, unlabelled, train, test) for train, test in folds]
    means = np.stack([stacked(rest, others)[1].mean(axis=0) for rest, others in data])
    tests = [test for _, test in folds]
    plain, whitened = (held_out(p, tests, means)(X) for p in (maps.plain, maps.whitened))
    for (rest, others), test, one, other in zip(data, tests, plain, whitened, strict=True):
        at = count + test
        guess = np.concatenate([one[:count] + other[:count], one[at] + other[at]]) / 2.0
        factors = FactorMap.learn(rest, others, guess)
        predicted[:, test] = [one[at], other[at], factors(labelled.X[test])[0]]
    return predicted


class Auto(Regression):
    """Processes and factors, blended."""

    map_type = BlendMap
    map_: BlendMap

    def unclipped(self) -> Self:
        """The same method without the limits of its experts; see `Method.unclipped`."""
        free = copy(self)
        ends = np.full_like(self.map_.range, UNBOUNDED)
        free.map_ = replace(self.map_, range=ends * [[-1.0], [1.0]])
        return free

    def _learn(self, labelled: Labelled, unlabelled: Unlabelled) -> tuple[BlendMap, TrainingReport]:
        _, poses = stacked(labelled, unlabelled)
        bounds = _bounds(unlabelled, poses)
        some = _fewer_poses(unlabelled, self.settings.seed)
        maps = BaseMaps.learn(labelled, some)
        plain, whitened, factors = np.clip(cross_validated_poses(labelled, some, maps), *bounds)

        Y, basis = labelled.Y, Basis(maps.whitened.centre, maps.whitened.basis)
        left = Labelled(labelled.X, Y - factors)
        residual = FeatureProcess.learn(left, basis, np.zeros(Y.shape[1]))
        corrected = np.clip(Y - residual.process.leave_one_out_errors, *bounds)
        shrinkage = Shrinkage.learn(poses, Y - factors)
        residual_shrinkage = Shrinkage.learn(poses, Y - corrected)
        predicted = [plain, whitened, shrinkage(factors), residual_shrinkage(corrected)]
        errors = [Y - np.clip(poses, *bounds) for poses in predicted]
        weights = blend_weights(errors)
        made = BlendMap(
            weights=weights,
            range=bounds,
            factor_error=np.sqrt(np.mean(errors[EXPERTS.index("factors")] ** 2, axis=0)),
            plain=maps.plain,
            whitened=maps.whitened,
            factors=maps.factors,
            residual=residual,
            shrinkage=shrinkage,
            residual_shrinkage=residual_shrinkage,
        )
        shares = {f"weight of {n}": float(w) for n, w in zip(EXPERTS, weights, strict=True)}
        error = rms(np.tensordot(weights, np.array(errors), axes=1))
        return made, TrainingReport(
            figures={**unlabelled.counts, **shares}, pose_figures={"cross-validation error": error}
        )


def _bounds(unlabelled: Unlabelled, poses: FloatArray) -> FloatArray:
    """The finite limits that poses are clipped to, (2, d_y)."""
    if unlabelled.bounds is None:
        return np.stack([poses.min(axis=0), poses.max(axis=0)])
    return np.clip(unlabelled.bounds, -UNBOUNDED, UNBOUNDED)


def _fewer_poses(unlabelled: Unlabelled, seed: int) -> Unlabelled:
    """Unlabelled data with at most `MOST_POSES` of the poses, drawn at random."""
    if len(unlabelled.Y) <= MOST_POSES:
        return unlabelled
    rows = np.random.default_rng(seed).permutation(len(unlabelled.Y))[:MOST_POSES]
    return replace(unlabelled, Y=unlabelled.Y[np.sort(rows)])


def blend_weights(errors: Sequence[FloatArray]) -> FloatArray:
    """The weights of experts, (e,), from their errors at every label, (l, d_y) each."""
    flat = np.stack([error.ravel() for error in errors])
    gram = flat @ flat.T
    squares = gram.diagonal()
    # An expert may make no error: clipped, or where nothing moves.
    least = max(squares.min(), FAULTLESS * squares.max(), np.finfo(np.float64).tiny)
    Q = gram / least + TOGETHER * np.eye(len(flat))
    # The quadratic form is homogeneous: without the sum, min v'Qv/2 - 1'v over v >= 0 has the same
    # direction, and is a non-negative least squares problem.
    L = np.linalg.cholesky(Q)
    v, _ = nnls(L.T, np.linalg.solve(L, np.ones(len(Q))))
    return np.asarray(v / v.sum())

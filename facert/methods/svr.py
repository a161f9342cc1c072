"""Support vector regression, a machine for each control (Drucker et al. 1997)."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Annotated, ClassVar, NamedTuple

import numpy as np
import sklearn
from scipy.spatial.distance import cdist
from sklearn import svm

from facert.data.arrays import FloatArray, IntArray
from facert.data.blocks import in_blocks
from facert.methods.folds import blocked_folds
from facert.methods.regression import MOST_KERNELS, Map, SupervisedRegression
from facert.models.kernels import squared_exponential

# The inverse width is relative to the mean squared distance of two labels; ε and C to the standard
# deviation of a control.
INVERSE_WIDTHS = (0.01, 0.05, 0.25)
PENALTIES = (1.0, 30.0, 1000.0)
TUBES = (0.02, 0.1)
# Digits after the point of kernels and standardised poses. The search for a machine takes its next
# pair of labels by comparing numbers, and ends at a tolerance of 1e-3: what rounding has done to
# the last digits would decide which pair it is, and move poses by a few 1e-4.
DIGITS = 9


@dataclass(frozen=True, eq=False)
class PackedMap(Map):
    """Support vector machines of all controls in one matrix: a frame costs one product."""

    predicts_std: ClassVar[bool] = False

    X: Annotated[FloatArray, "nx"]  # (n, d_x): Posed frames
    # (g,): γ of the kernels exp(-γ |x - x'|²) that the machines use
    inverse_widths: Annotated[FloatArray, "g"]
    # (g, n, d_y): Weight of each kernel at each posed frame in each control; 0 where it is not
    # used
    duals: Annotated[FloatArray, "gny"]
    offset: Annotated[FloatArray, "y"]  # (d_y,): Added to the sum

    def __call__(self, X: FloatArray) -> tuple[FloatArray, None]:
        """Poses of frames X (T, d_x), (T, d_y)."""
        return in_blocks(self._poses, X, self.duals[..., 0].size, MOST_KERNELS), None

    def _poses(self, X: FloatArray) -> FloatArray:
        squared = cdist(X, self.X, "sqeuclidean")[:, None, :]
        k = squared_exponential(squared, 2.0 * self.inverse_widths[:, None])
        packed = self.duals.reshape(-1, self.duals.shape[2])
        return np.asarray(k.reshape(len(X), len(packed)) @ packed + self.offset)


class _Choice(NamedTuple):
    """Index of the kernel, C and ε."""

    width: int
    penalty: float
    tube: float


CHOICES = [_Choice(*c) for c in product(range(len(INVERSE_WIDTHS)), PENALTIES, TUBES)]


class _Machine(NamedTuple):
    """Weights of the training rows, (n,), and the offset."""

    duals: FloatArray
    offset: float


class SVR(SupervisedRegression):
    """Support vector regression; width, C and ε of each control chosen by cross-validation."""

    map_type = PackedMap

    def _regress(self, X: FloatArray, Y: FloatArray) -> tuple[PackedMap, dict[str, float]]:
        squared = cdist(X, X, "sqeuclidean")
        # Labels that are all the same have no width of their own.
        inverse_widths = np.array(INVERSE_WIDTHS) / (float(squared.mean()) or 1.0)
        kernels = squared_exponential(squared, 2.0 * inverse_widths[:, None, None]).round(DIGITS)
        mean, scale = Y.mean(axis=0), Y.std(axis=0)
        scale = np.where(scale > 0, scale, 1.0)  # a control that never moves
        T = ((Y - mean) / scale).round(DIGITS)

        duals, offset = np.zeros((len(kernels), *Y.shape)), np.empty(Y.shape[1])
        with sklearn.config_context(assume_finite=True, skip_parameter_validation=True):
            for control, index in enumerate(_errors(kernels, T).argmin(axis=0)):
                choice = CHOICES[index]
                machine = _train(kernels[choice.width], T[:, control], choice)
                duals[choice.width, :, control], offset[control] = machine
        return PackedMap(X, inverse_widths, duals * scale, offset * scale + mean), {}


def _errors(kernels: FloatArray, T: FloatArray) -> FloatArray:
    """Squared error of every choice for every control over held-out blocks, (choices, d_y)."""
    errors = np.zeros((len(CHOICES), T.shape[1]))
    folds = blocked_folds(len(T))
    for (row, choice), fold, control in product(enumerate(CHOICES), folds, range(T.shape[1])):
        errors[row, control] += _held_out(kernels[choice.width], T[:, control], choice, *fold)
    return errors


def _held_out(
    K: FloatArray, t: FloatArray, choice: _Choice, train: IntArray, test: IntArray
) -> float:
    """Squared error on the test rows of a machine trained on the others."""
    machine = _train(K[np.ix_(train, train)], t[train], choice)
    guess = K[np.ix_(test, train)] @ machine.duals + machine.offset
    return float(np.sum((guess - t[test]) ** 2))


def _train(K: FloatArray, t: FloatArray, choice: _Choice) -> _Machine:
    """A machine for one control from its kernel (n, n) and standardised values (n,)."""
    found = svm.SVR(kernel="precomputed", C=choice.penalty, epsilon=choice.tube).fit(K, t)
    duals = np.zeros(len(t))
    duals[found.support_] = found.dual_coef_[0]
    return _Machine(duals, float(found.intercept_[0]))

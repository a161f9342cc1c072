"""Semi-supervised regression: experts on features of every frame, shrunk by every pose.

`ssgpr` has one expert, a Gaussian process with a linear term on half-whitened features. No one
recipe suits all captures, though: clean ones with many small directions want whitened features,
real markers the source as it is, and where the rig follows the markers linearly a ridge is hard to
beat. `auto` has both, on the source's own proportions and on features whitened by a quarter and by
half. All leave-one-out predictions are known in closed form. With P_e (l, d_y) those of expert e,
clipped to the range of all known poses, the weights minimise

    |Σ_e w_e P_e - Y|² + ρ E |w|²,      w_e >= 0,      Σ_e w_e = 1,

E the least squared error of one expert: few labels say little about which expert is best, and ρ
then keeps the weights together (Breiman 1996, Stacked Regressions). The blend is shrunk towards
likely poses, see `facert.methods.shrinkage`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np
from scipy.optimize import nnls

from facert.data import FloatArray
from facert.gp.regression import maximise_likelihood
from facert.methods.base import Labelled, Unlabelled
from facert.methods.features import whitening
from facert.methods.gpr import ProcessMap
from facert.methods.linear import leave_one_out_ridge
from facert.methods.regression import Map, Regression
from facert.methods.shrinkage import shrinkage

TOGETHER = 0.1  # ρ


@dataclass(frozen=True, eq=False)
class BlendMap(Map):
    """A weighted sum of Gaussian processes and a linear map, shrunk towards likely poses.

    Parameters
    ----------
    X, Y : arrays, shapes (n, d_x) and (n, d_y)
        Labelled frames and poses.
    centre : array, shape (d_x,)
        Mean of all frames.
    bases : array, shape (p, d_x, d_x)
        Of the features of each process, see `facert.methods.features.whitening`.
    thetas : array, shape (p, 4)
        Of each process, see `facert.methods.gpr.ProcessMap`.
    weights : array, shape (p,)
        Of each process.
    linear : array, shape (d_x, d_y)
        All ridges, times their weights.
    mean : array, shape (d_y,)
        Mean of all poses.
    shrink : array, shape (d_y, d_y)
        See `facert.methods.shrinkage.shrinkage`.
    """

    axes: ClassVar[Mapping[str, str]] = {
        "X": "nx",
        "Y": "ny",
        "centre": "x",
        "bases": "pxx",
        "thetas": "p4",
        "weights": "p",
        "linear": "xy",
        "mean": "y",
        "shrink": "yy",
    }

    X: FloatArray
    Y: FloatArray
    centre: FloatArray
    bases: FloatArray
    thetas: FloatArray
    weights: FloatArray
    linear: FloatArray
    mean: FloatArray
    shrink: FloatArray

    def __call__(self, X: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Poses of frames X (T, d_x), (T, d_y); the std is the processes', weighted alike."""
        offsets = X - self.centre
        poses, variance = offsets @ self.linear, np.zeros((len(X), len(self.mean)))
        share = self.weights / max(float(self.weights.sum()), np.finfo(np.float64).tiny)
        for process, basis, weight, part in zip(
            self.processes, self.bases, self.weights, share, strict=True
        ):
            pose, std = process(offsets @ basis)
            poses += weight * pose
            variance += part * std**2
        return self.mean + poses @ self.shrink, np.sqrt(variance)

    @cached_property
    def processes(self) -> list[ProcessMap]:
        """From each kind of features to poses less their mean."""
        return [
            ProcessMap((self.X - self.centre) @ basis, self.Y - self.mean, theta)
            for basis, theta in zip(self.bases, self.thetas, strict=True)
        ]


class Blend(Regression):
    """Experts on whitened features, weighted by how well each foretells the labels."""

    map_type = BlendMap
    process_powers: ClassVar[tuple[float, ...]]
    """p of the features of each Gaussian process, see `facert.methods.features`."""
    ridge_powers: ClassVar[tuple[float, ...]]
    """The same of each ridge."""

    def _learn(
        self, labelled: Labelled, unlabelled: Unlabelled
    ) -> tuple[BlendMap, dict[str, float]]:
        frames = np.vstack([labelled.X, unlabelled.X])
        poses = np.vstack([labelled.Y, unlabelled.Y])
        centre, mean = frames.mean(axis=0), poses.mean(axis=0)
        offsets, targets = labelled.X - centre, labelled.Y - mean
        bases = {p: _basis(frames, p) for p in {*self.process_powers, *self.ridge_powers}}

        processes = [_process(offsets @ bases[p], targets) for p in self.process_powers]
        ridges = [leave_one_out_ridge(offsets @ bases[p], targets) for p in self.ridge_powers]
        errors = [process.left_out_errors for process in processes]
        errors += [ridge.left_out_errors for ridge in ridges]
        limits = poses.min(axis=0) - mean, poses.max(axis=0) - mean
        weights = blend_weights([targets - np.clip(targets - e, *limits) for e in errors])

        linear = np.zeros((len(centre), len(mean)))
        for p, weight, ridge in zip(
            self.ridge_powers, weights[len(processes) :], ridges, strict=True
        ):
            linear += weight * (bases[p] @ ridge.weights)
        made = BlendMap(
            X=labelled.X,
            Y=labelled.Y,
            centre=centre,
            bases=np.array([bases[p] for p in self.process_powers]),
            thetas=np.array([process.theta for process in processes]),
            weights=weights[: len(processes)],
            linear=linear,
            mean=mean,
            shrink=shrinkage(poses, np.tensordot(weights, np.array(errors), axes=1)),
        )
        names = [f"gpr-linear, whitened {p:g}" for p in self.process_powers]
        names += [f"ridge, whitened {p:g}" for p in self.ridge_powers]
        shares = {f"weight of {n}": float(w) for n, w in zip(names, weights, strict=True)}
        counts = {"unlabelled frames": len(unlabelled.X), "unlabelled poses": len(unlabelled.Y)}
        return made, {**counts, **shares}


class SemiSupervisedGPR(Blend):
    """One Gaussian process, on half-whitened features."""

    process_powers = (0.5,)
    ridge_powers = ()


class Auto(Blend):
    """Gaussian processes and ridges, on three kinds of features."""

    process_powers = ridge_powers = (0.0, 0.25, 0.5)


def _basis(frames: FloatArray, power: float) -> FloatArray:
    """Of the features; without whitening the source as it is, noise and all."""
    return whitening(frames, power) if power else np.eye(frames.shape[1])


def _process(features: FloatArray, targets: FloatArray) -> ProcessMap:
    kernel = maximise_likelihood(features, targets).kernel
    return ProcessMap(features, targets, np.array([*kernel.theta, kernel.linear]))


def blend_weights(errors: Sequence[FloatArray]) -> FloatArray:
    """The weights of experts, (e,), from what each missed every label by, (l, d_y) each."""
    flat = np.stack([error.ravel() for error in errors])
    gram = flat @ flat.T
    least = max(float(gram.diagonal().min()), np.finfo(np.float64).tiny)
    Q = gram / least + TOGETHER * np.eye(len(flat))
    # The quadratic form is homogeneous: without the sum, min v'Qv/2 - 1'v over v >= 0 has the same
    # direction, and is a non-negative least squares problem.
    L = np.linalg.cholesky(Q)
    v, _ = nnls(L.T, np.linalg.solve(L, np.ones(len(Q))))
    return np.asarray(v / v.sum())

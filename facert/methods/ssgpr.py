"""`ssgpr`: a Gaussian process on features of every frame, shrunk by every pose.

The frames tell which directions of the source carry motion, see `facert.models.whitening`; the
labels tell how poses follow, through a Gaussian process with a linear term on half-whitened
features; the poses tell which predictions are likely, see `facert.methods.shrinkage`, where the
leave-one-out errors of the process are known in closed form.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from facert.data.array_group import ArrayGroup
from facert.data.arrays import FloatArray
from facert.methods.base import Labelled, Unlabelled
from facert.methods.gpr import ProcessMap
from facert.methods.one_frame import ShrunkFrame
from facert.methods.regression import Map, Regression
from facert.methods.shrinkage import Shrinkage
from facert.models.gp.hyperparameters import maximise_likelihood
from facert.models.whitening import whitening

POWER = 0.5  # half-whitening
# The search for the kernel takes time with the cube of the labels, and a few tell it as well.
MOST_SEARCHED = 200


@dataclass(frozen=True, eq=False)
class FeatureProcess(Map):
    """A Gaussian process with a linear term, on features of the source.

    Parameters
    ----------
    centre : array, shape (d_x,)
        Mean of all frames.
    basis : array, shape (d_x, d_x)
        Of the features, see `facert.models.whitening.whitening`.
    mean : array, shape (d_y,)
        The pose expected before any label is seen.
    process : ProcessMap
        From features to poses less their mean.
    """

    axes: ClassVar[Mapping[str, str]] = {"centre": "x", "basis": "xx", "mean": "y"}
    parts: ClassVar[Mapping[str, type[ArrayGroup]]] = {"process": ProcessMap}

    centre: FloatArray
    basis: FloatArray
    mean: FloatArray
    process: ProcessMap

    @classmethod
    def learn(cls, labelled: Labelled, basis: Basis, mean: FloatArray) -> FeatureProcess:
        """By maximum likelihood on labelled frames."""
        features, targets = basis.features(labelled.X), labelled.Y - mean
        step = -(-len(features) // MOST_SEARCHED)
        kernel = maximise_likelihood(features[::step], targets[::step]).kernel
        theta = np.array([*kernel.theta, kernel.linear])
        return cls(basis.centre, basis.matrix, mean, ProcessMap(features, targets, theta))

    def __call__(self, X: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Poses of frames X (T, d_x), (T, d_y), and their standard deviation."""
        pose, std = self.process((X - self.centre) @ self.basis)
        return self.mean + pose, std


@dataclass(frozen=True, eq=False)
class Basis:
    """Features of frames: φ(x) = (x - centre) matrix."""

    centre: FloatArray
    matrix: FloatArray

    @classmethod
    def plain(cls, frames: FloatArray) -> Basis:
        """The source as it is, noise and all; of frames (n, d_x)."""
        return cls(frames.mean(axis=0), np.eye(frames.shape[1]))

    @classmethod
    def half_whitened(cls, frames: FloatArray) -> Basis:
        """Of frames (n, d_x)."""
        return cls(frames.mean(axis=0), whitening(frames, POWER))

    def features(self, X: FloatArray) -> FloatArray:
        """Of frames X (T, d_x), (T, d_x)."""
        return (X - self.centre) @ self.matrix


@dataclass(frozen=True, eq=False)
class ShrunkProcess(Map):
    """A process whose poses are shrunk towards likely ones."""

    axes: ClassVar[Mapping[str, str]] = {}
    parts: ClassVar[Mapping[str, type[ArrayGroup]]] = {
        "process": FeatureProcess,
        "shrinkage": Shrinkage,
    }

    process: FeatureProcess
    shrinkage: Shrinkage

    def __call__(self, X: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Poses of frames X (T, d_x), (T, d_y); the std is the process's."""
        pose, std = self.process(X)
        return self.shrinkage(pose), std

    @cached_property
    def for_frames(self) -> ShrunkFrame:
        """The same for single frames."""
        return ShrunkFrame(self)


class SemiSupervisedGPR(Regression):
    """One Gaussian process, on half-whitened features."""

    map_type = ShrunkProcess

    def _learn(
        self, labelled: Labelled, unlabelled: Unlabelled
    ) -> tuple[ShrunkProcess, dict[str, float]]:
        frames = np.vstack([labelled.X, unlabelled.X])
        poses = np.vstack([labelled.Y, unlabelled.Y])
        process = FeatureProcess.learn(labelled, Basis.half_whitened(frames), poses.mean(axis=0))
        shrinkage = Shrinkage.learn(poses, process.process.left_out_errors)
        counts = {"unlabelled frames": len(unlabelled.X), "unlabelled poses": len(unlabelled.Y)}
        return ShrunkProcess(process, shrinkage), {k: float(v) for k, v in counts.items()}

"""`ssgpr`: a Gaussian process on features of every frame, shrunk by every pose.

The frames show which directions of the source carry motion, see `facert.models.whitening`; the
labels show how poses follow, through a Gaussian process with a linear term on half-whitened
features; the poses show which predictions are likely, see `facert.methods.shrinkage`.
"""

from __future__ import annotations

from dataclasses import dataclass

from facert.data.arrays import FloatArray
from facert.methods.base import Labelled, TrainingReport, Unlabelled, stacked
from facert.methods.processes import Basis, FeatureProcess
from facert.methods.regression import Map, Regression, Variance
from facert.methods.shrinkage import Shrinkage


@dataclass(frozen=True, eq=False)
class ShrunkProcess(Map):
    """A process whose poses are shrunk towards likely ones."""

    process: FeatureProcess
    shrinkage: Shrinkage

    def __call__(self, X: FloatArray) -> tuple[FloatArray, Variance]:
        """Poses of frames X (T, d_x), (T, d_y); the variance is the process's."""
        pose, variance = self.process(X)
        return self.shrinkage(pose), variance


class SemiSupervisedGPR(Regression):
    """One Gaussian process, on half-whitened features."""

    map_type = ShrunkProcess

    def _learn(
        self, labelled: Labelled, unlabelled: Unlabelled
    ) -> tuple[ShrunkProcess, TrainingReport]:
        frames, poses = stacked(labelled, unlabelled)
        process = FeatureProcess.learn(labelled, Basis.half_whitened(frames), poses.mean(axis=0))
        shrinkage = Shrinkage.learn(poses, process.process.leave_one_out_errors)
        return ShrunkProcess(process, shrinkage), TrainingReport(figures=unlabelled.counts)

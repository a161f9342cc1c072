"""Few labels: the semi-supervised model against the supervised one and GP regression.

    python -m experiments.few_labels [--labels 10] [--repeats 10] [--target arkit] [TRACK ...]

Gaussian process regression is scikit-learn's, with the paper's kernel (RBF and noise) by maximum
likelihood from several starts, on the same normalised arrays. The supervised model is tried with
the noise floors of the semi-supervised one and, as few clean labels need none, without ("bare").
The shared models' poses are clipped to the range of all known poses; clipping GP regression as
well changes nothing, as it falls back on the mean.
"""

from __future__ import annotations

import argparse
import warnings
from dataclasses import dataclass, replace

import numpy as np
from sklearn.exceptions import ConvergenceWarning
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel
from threadpoolctl import threadpool_limits

import facert
from experiments.tracks import draw, read_track
from facert import Settings, Take
from facert.data.arrays import FloatArray, rms
from facert.data.normalisation import Normalisation
from facert.retarget.options import AS_IT_IS


def gpr(take: Take, frames: FloatArray) -> FloatArray:
    """Poses of frames (T, d_x) by GP regression from the take's labels."""
    assert take.params is not None
    labels = take.labels
    X = Normalisation.of(take.source.matrix, "source")
    Y = Normalisation.of(take.params[labels], "target")
    kernel = ConstantKernel(1.0, (1e-4, 1e4)) * RBF(3.0, (1e-2, 1e4)) + WhiteKernel(
        1e-2, (1e-9, 1e2)
    )
    model = GaussianProcessRegressor(kernel, n_restarts_optimizer=4, random_state=0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)
        model.fit(X.apply(take.source.matrix[labels]), Y.apply(take.params[labels]))
    return Y.undo(model.predict(X.apply(frames)))


def shared(take: Take, settings: Settings) -> FloatArray:
    """Poses of every frame of the take by a shared model."""
    settings = replace(settings, detect=False, smooth=False)
    result = facert.train(take, settings).retarget(take, options=AS_IT_IS)
    assert result.params is not None
    return result.params


BARE = {"sigma_c": 0.03, "source_noise_floor": 1e-6, "target_noise_floor": 1e-6}


@dataclass(frozen=True)
class Scores:
    """RMS over the test frames of each method, one number a draw."""

    gpr: FloatArray
    sgplvm: FloatArray
    bare: FloatArray
    ssgplvm: FloatArray


def score(name: str, target: str, labels: int, unlabelled: int, repeats: int) -> Scores:
    """The errors of all methods on so many draws of a track."""
    truth = read_track(name, target)
    assert truth.params is not None
    rows = []
    for seed in range(repeats):
        take, test = draw(truth, labels, unlabelled, seed)
        known = truth.params[test]
        given = Settings(method="ssgplvm", seed=seed, unlabelled=unlabelled)
        rows.append(
            (
                rms(gpr(take, take.source.matrix[test]) - known),
                rms(shared(take, replace(given, method="sgplvm"))[test] - known),
                rms(shared(take, replace(given, method="sgplvm", **BARE))[test] - known),
                rms(shared(take, given)[test] - known),
            )
        )
    return Scores(*np.array(rows).T)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("tracks", nargs="*", default=["utterance_a", "utterance_b"])
    parser.add_argument("--target", default="arkit")
    parser.add_argument("--labels", type=int, default=10)
    parser.add_argument("--unlabelled", type=int, default=100)
    parser.add_argument("--repeats", type=int, default=10)
    options = parser.parse_args()
    print(f"RMS, {options.labels} labels, {options.unlabelled} unlabelled frames and poses,")
    print(f"target {options.target}, mean (standard error) of {options.repeats} draws")
    names = ("gpr", "sgplvm", "sgplvm bare", "ssgplvm")
    print(f"{'track':<14}" + "".join(f"{name:>16}" for name in names) + "   ratio to each")
    for track in options.tracks:
        with threadpool_limits(1):
            scores = score(
                track, options.target, options.labels, options.unlabelled, options.repeats
            )
        columns = (scores.gpr, scores.sgplvm, scores.bare, scores.ssgplvm)
        cells = [f"{c.mean():.4f} ({c.std(ddof=1) / len(c) ** 0.5:.4f})" for c in columns]
        ratios = [f"{scores.ssgplvm.mean() / c.mean():.3f}" for c in columns[:3]]
        print(f"{track:<14}" + "".join(f"{c:>16}" for c in cells) + "   " + " ".join(ratios))


if __name__ == "__main__":
    main()

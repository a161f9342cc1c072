"""CPU seconds of a training run, one thread: the default, and the shared model twice.

40 labels + 100 frames + 100 poses, from normalised arrays to a trained method. The shared model is
measured beside the paper's figure and SciPy's own optimisers, which descend the same objective from
the same start until they have come within 1e-4 of its value, or to 500 iterations.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import OptimizeResult, minimize

from experiments.bench.figure import Call, Figure, cpu_seconds
from experiments.bench.problem import bench_data
from facert import Settings
from facert.data.arrays import FloatArray
from facert.data.normalisation import Normalisation
from facert.methods.base import Labelled, TrainingReport, WarmStart
from facert.methods.noise import with_noise
from facert.methods.registry import make_method
from facert.methods.shared_gplvm import SemiSupervisedSGPLVM
from facert.models.optim.flat import FlatObjective
from facert.models.optim.optimiser import Result

PAPER = [60.0]
SCIPY = ("L-BFGS-B", "CG")
MOST = 500
WITHIN = 1e-4


def fit(settings: Settings) -> Result | None:
    """Train once."""
    return make_method(settings).fit(*bench_data()).result


def by_scipy(name: str, settings: Settings, target: float) -> Call:
    """Descend with one of SciPy's optimisers until the objective has come to the target."""
    labelled, unlabelled = bench_data()
    X, Y = np.vstack([labelled.X, unlabelled.X]), np.vstack([labelled.Y, unlabelled.Y])
    method = SemiSupervisedSGPLVM(with_noise(settings, X))

    def reached(intermediate_result: OptimizeResult) -> None:
        if intermediate_result.fun <= target:
            raise StopIteration

    def call() -> FloatArray:
        objective = FlatObjective(method._module(X, Y, len(labelled.X), "exact"))
        start, options = objective.vector, {"maxiter": MOST}
        found = minimize(objective, start, jac=True, method=name, callback=reached, options=options)
        return np.asarray(found.x)

    return call


def start(settings: Settings) -> Call:
    """Neighbours, alignment and the module before its first evaluation."""
    labelled, unlabelled = bench_data()
    X, Y = np.vstack([labelled.X, unlabelled.X]), np.vstack([labelled.Y, unlabelled.Y])
    method = SemiSupervisedSGPLVM(with_noise(settings, X))
    return lambda: method._module(X, Y, len(labelled.X), "exact")


def another_label(settings: Settings) -> Call:
    """Go on from a model that was trained without the last label."""
    labelled, unlabelled = bench_data()
    before = make_method(settings)
    before.fit(Labelled(labelled.X[:-1], labelled.Y[:-1]), unlabelled)
    same = [Normalisation(np.zeros(width), 1.0) for width in before.dimensions]

    def call() -> TrainingReport:
        method = make_method(before.settings)
        assert isinstance(method, WarmStart)
        method.begin_at(before, *same)
        return method.fit(labelled, unlabelled)

    return call


def figures(runs: int) -> list[Figure]:
    """Of all kinds; a run's figures have the same data."""
    lbfgs = Settings(method="ssgplvm", unlabelled=100)
    scg = Settings(method="ssgplvm", unlabelled=100, optimizer="scg")
    ended = fit(lbfgs)
    assert ended is not None
    target = ended.value + WITHIN * abs(ended.value)
    calls: dict[str, Call] = {
        "auto": lambda: fit(Settings(unlabelled=100)),
        "ssgplvm, L-BFGS": lambda: fit(lbfgs),
        "ssgplvm, SCG": lambda: fit(scg),
        "ssgplvm, its start": start(lbfgs),
        "ssgplvm, another label": another_label(lbfgs),
        **{f"SciPy's {name}": by_scipy(name, lbfgs, target) for name in SCIPY},
    }
    times = cpu_seconds(calls, runs)
    found = []
    for name in ("ssgplvm, L-BFGS", "ssgplvm, SCG"):
        references = {"the paper": PAPER, **{f"SciPy's {n}": times[f"SciPy's {n}"] for n in SCIPY}}
        found += [
            Figure.of(f"training, {name}", times[name], "s", reference, theirs)
            for reference, theirs in references.items()
        ]
    whole = times["ssgplvm, L-BFGS"]
    for name in ("ssgplvm, its start", "ssgplvm, another label", "auto"):
        found.append(Figure.of(f"training, {name}", times[name], "s", "ssgplvm, L-BFGS", whole))
    return found

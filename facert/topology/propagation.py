"""Key-frame propagation (section 3.2): a few posed frames and the actor's motion make the rest.

The frames are the points, the source expression is X, the key poses are the labels, and the frames
around each frame its neighbourhood: within a window of time the target is an affine map of the
source's tangent coordinates. As the paper advises, each feature point is solved for on its own.

As in face driving, what is solved for are *displacements*, here from the source times the ratio s
of target to source motion: the target is s X + Z with trace(Zᵀ B Z) least. Where a window has three
clear directions this changes nothing, since affine maps cost nothing. Where it has fewer, (9) as it
is written keeps the target still along the others (`literal`, kept for comparison).

Two terms may be added. A path Laplacian holds still windows together (`path`). And since a window
knows nothing of another, where the same expression may have been posed, a regression on the whole
performance may come first, of which the framework carries over what it leaves of the key poses
(`residual`, the default).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.interpolate import CubicSpline

from facert.data.arrays import FloatArray
from facert.errors import InputError
from facert.topology.affine import affine_regression, scaled_points, scaled_source
from facert.topology.alignment_matrix import alignment_matrix
from facert.topology.keyed import KeyedPerformance
from facert.topology.labels import needed_labels, require_enough_labels
from facert.topology.laplacian import path_energy
from facert.topology.local_ridge import local_ridge
from facert.topology.neighbourhoods import temporal_windows
from facert.topology.radial_basis import Kernel, radial_basis
from facert.topology.solution import Elimination

STILL = 0.01
"""At this share of a point's largest singular value, over all windows, motion is half noise."""
PATH = 0.1  # λ of the path Laplacian


@dataclass(frozen=True)
class Windows:
    """What the framework takes to be near in time.

    Parameters
    ----------
    width : int
        k frames, odd.
    dim : int
        d, directions of motion within a window.
    """

    width: int = 15
    dim: int = 3


@dataclass(frozen=True)
class PropagationMethod:
    """How key poses reach the other frames.

    Parameters
    ----------
    summary : str
        One line for a person who chooses.
    run : callable
        From a keyed performance and the windows to all frames, (T, G, C).
    windows : Windows, optional
        The ones that suit it; None for a method without windows.
    """

    summary: str
    run: Callable[[KeyedPerformance, Windows], FloatArray]
    windows: Windows | None = None


def propagate(
    take: KeyedPerformance,
    method: str = "residual",
    width: int | None = None,
    dim: int | None = None,
) -> FloatArray:
    """The target in every frame, the key poses met exactly or nearly so.

    Parameters
    ----------
    take : KeyedPerformance
    method : str
        One of `METHODS`.
    width, dim : int, optional
        Other windows than those that suit the method.

    Returns
    -------
    array, shape (T, G, C)

    Raises
    ------
    InputError
        For an unknown method, windows where there are none, or key frames that do not suffice.
    """
    if method not in METHODS:
        known = ", ".join(METHODS)
        raise InputError("method", f"one of {known}", repr(method), "Choose another.")
    chosen = METHODS[method]
    if chosen.windows is None:
        if width is not None or dim is not None:
            raise InputError(
                "--window, --dim", f"neither with {method}", "one of them", "Leave them out."
            )
        return chosen.run(take, Windows())
    windows = Windows(
        chosen.windows.width if width is None else width,
        chosen.windows.dim if dim is None else dim,
    )
    return chosen.run(take, windows)


def framework(take: KeyedPerformance, windows: Windows) -> FloatArray:
    """The paper's framework for each feature point, on displacements, (T, G, C)."""
    return _displaced(take, windows, smoothness=0.0)


def framework_and_path(take: KeyedPerformance, windows: Windows) -> FloatArray:
    """The same with a path Laplacian, B + λ Lᵀ L, (T, G, C)."""
    return _displaced(take, windows, smoothness=PATH)


def literal(take: KeyedPerformance, windows: Windows) -> FloatArray:
    """Equation (9) as it is written, on positions, (T, G, C)."""
    needed = needed_labels(windows.dim, take.explaining.shape[2])
    require_enough_labels(temporal_windows(len(take), windows.width), take.keys, needed)
    return _solve(take, take.explaining, windows, smoothness=0.0)


def framework_on_residual(take: KeyedPerformance, windows: Windows) -> FloatArray:
    """A regression first, then the framework on what it leaves of the key poses, (T, G, C).

    What is left is small and belongs to no feature point in particular, so that the windows are of
    whole frames: one matrix, one factorisation.
    """
    guess = local_ridge(take)
    return guess + _solve(take.less(guess), take.frames[None], windows, smoothness=0.0)


def _displaced(take: KeyedPerformance, windows: Windows, smoothness: float) -> FloatArray:
    """The framework on what the scaled source leaves; parameters of a rig have no such source."""
    if not take.by_point:
        return _solve(take, take.explaining, windows, smoothness)
    guess = scaled_source(take)
    return guess + _solve(take.less(guess), take.explaining, windows, smoothness)


def _solve(
    take: KeyedPerformance, sources: FloatArray, windows: Windows, smoothness: float
) -> FloatArray:
    """The framework with sources (G, T, d), or one (1, T, d) for all, (T, G, C)."""
    neighbourhoods = temporal_windows(len(take), windows.width)
    steady = smoothness * path_energy(len(take))
    parts = np.array_split(take.labels, len(sources), axis=1)
    solved = [
        Elimination(
            sparse.csc_array(alignment_matrix(X, neighbourhoods, windows.dim, STILL) + steady),
            take.keys,
        )(part)
        for X, part in zip(sources, parts, strict=True)
    ]
    return np.concatenate(solved, axis=1)


def laplacian(take: KeyedPerformance) -> FloatArray:
    """Laplacian editing in time (the paper's [17]): L Y = s L X for each feature point."""
    if not take.by_point:
        raise InputError(
            "method",
            "a target position for each source marker",
            "parameters, which have no Laplacian in the source",
            "Choose another method.",
        )
    guess = scaled_points(take)
    steps = Elimination(path_energy(len(take)), take.keys)
    return np.asarray(guess + steps(take.less(guess).labels))


def rbf(take: KeyedPerformance, kernel: Kernel) -> FloatArray:
    """Radial basis functions of each feature point's position (the paper's [16])."""
    parts = np.array_split(take.labels, len(take.explaining), axis=1)
    solved = [
        radial_basis(X, take.keys, kernel)(part)
        for X, part in zip(take.explaining, parts, strict=True)
    ]
    return np.concatenate(solved, axis=1)


def spline(take: KeyedPerformance) -> FloatArray:
    """A cubic spline in time through the key poses: what an animator's curves do."""
    order = np.argsort(take.keys)
    return np.asarray(CubicSpline(take.keys[order], take.labels[order])(np.arange(len(take))))


METHODS = {
    "residual": PropagationMethod(
        "a regression on the source, the framework on what it leaves",
        framework_on_residual,
        Windows(9, 5),
    ),
    "path": PropagationMethod("the framework with a path Laplacian", framework_and_path, Windows()),
    "framework": PropagationMethod("the paper's framework, on displacements", framework, Windows()),
    "literal": PropagationMethod("equation (9) as it is written, on positions", literal, Windows()),
    "laplacian": PropagationMethod("Laplacian editing in time", lambda take, _: laplacian(take)),
    "rbf-linear": PropagationMethod(
        "radial basis functions |r|", lambda take, _: rbf(take, "linear")
    ),
    "rbf-thin-plate": PropagationMethod(
        "radial basis functions r² log r", lambda take, _: rbf(take, "thin_plate_spline")
    ),
    "ridge": PropagationMethod(
        "kernel ridge regression towards the scaled source", lambda take, _: local_ridge(take)
    ),
    "affine": PropagationMethod(
        "affine regression on whole frames", lambda take, _: affine_regression(take)
    ),
    "spline": PropagationMethod("a cubic spline in time", lambda take, _: spline(take)),
}
"""Every way to propagate, the shipped default first."""

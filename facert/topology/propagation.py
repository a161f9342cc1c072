"""Key-frame propagation (section 3.2): a few posed frames and the actor's motion make the rest.

The frames are the points, the source expression is X, the key poses are the labels, and the frames
around each frame its neighbourhood: within a window of time the target is an affine map of the
source's tangent coordinates. As the paper advises, each feature point is solved for on its own.

As in face driving, what is solved for are *displacements*, here from the source times the ratio s
of target to source motion: the target is s X + Z with trace(Zᵀ B Z) least. Where a window has three
clear directions this changes nothing, since affine maps cost nothing. Where it has fewer, (9) as it
is written keeps the target still along the others (`literal`, kept for comparison).

Two terms may be added. A path Laplacian holds still windows together (`path`). And since a window
does not reach another in which the same expression may have been posed, a regression on the whole
performance may come first, of which the framework carries over what it leaves of the key poses
(`residual`, the default).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

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
from facert.topology.radial_basis import RadialFunction, radial_basis
from facert.topology.solution import Elimination, Interpolant

STILL = 0.01
"""At this share of a point's largest singular value, over all windows, motion is half noise."""
PATH = 0.1  # λ of the path Laplacian


@dataclass(frozen=True)
class Windows:
    """Windows of time: the frames that are near each frame."""

    width: int = 15  # k frames, odd
    dim: int = 3  # d, directions of motion within a window


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
    if method in WITHOUT_WINDOWS:
        if width is not None or dim is not None:
            raise InputError(
                "--window, --dim", f"neither with {method}", "one of them", "Leave them out."
            )
        return WITHOUT_WINDOWS[method](take)
    if method not in WITH_WINDOWS:
        known = ", ".join(METHODS)
        raise InputError("method", f"one of {known}", repr(method), "Choose another.")
    run, suited = WITH_WINDOWS[method]
    windows = Windows(suited.width if width is None else width, suited.dim if dim is None else dim)
    return run(take, windows)


def framework_on_residual(take: KeyedPerformance, windows: Windows) -> FloatArray:
    """A regression first, then the framework on what it leaves of the key poses, (T, G, C).

    What is left is small and belongs to no feature point in particular, so that the windows are of
    whole frames: one matrix, one factorisation.
    """
    regressed = local_ridge(take)
    return regressed + _solve(take.less(regressed), take.frames[None], windows)


def framework(take: KeyedPerformance, windows: Windows, smoothness: float = 0.0) -> FloatArray:
    """The paper's framework for each feature point, on displacements from the scaled source.

    The parameters of a rig have no such source. With a smoothness λ, the energy is B + λ Lᵀ L, L
    the path Laplacian, (T, G, C).
    """
    if not take.by_point:
        return _solve(take, take.explaining, windows, smoothness)
    scaled = scaled_source(take)
    return scaled + _solve(take.less(scaled), take.explaining, windows, smoothness)


def literal(take: KeyedPerformance, windows: Windows) -> FloatArray:
    """Equation (9) as it is written, on positions, (T, G, C)."""
    needed = needed_labels(windows.dim, take.explaining.shape[2])
    require_enough_labels(temporal_windows(len(take), windows.width), take.keys, needed)
    return _solve(take, take.explaining, windows)


def laplacian(take: KeyedPerformance) -> FloatArray:
    """Laplacian editing in time (the paper's [17]): L Y = s L X for each feature point."""
    if not take.by_point:
        raise InputError(
            "method",
            "a target position for each source marker",
            "parameters, which have no Laplacian in the source",
            "Choose another method.",
        )
    scaled = scaled_points(take)
    displacements = Elimination(path_energy(len(take)), take.keys)
    return np.asarray(scaled + displacements(take.less(scaled).labels))


def rbf(take: KeyedPerformance, kernel: RadialFunction) -> FloatArray:
    """Radial basis functions of each feature point's position (the paper's [16]), (T, G, C)."""
    return _by_source(take, take.explaining, lambda X: radial_basis(X, take.keys, kernel))


def spline(take: KeyedPerformance) -> FloatArray:
    """A cubic spline in time through the key poses: what an animator's curves do."""
    order = np.argsort(take.keys)
    return np.asarray(CubicSpline(take.keys[order], take.labels[order])(np.arange(len(take))))


def _solve(
    take: KeyedPerformance, sources: FloatArray, windows: Windows, smoothness: float = 0.0
) -> FloatArray:
    """The framework with sources (G, T, d), or one (1, T, d) for all, (T, G, C)."""
    neighbourhoods = temporal_windows(len(take), windows.width)
    steady = smoothness * path_energy(len(take))

    def solution(X: FloatArray) -> Interpolant:
        B = alignment_matrix(X, neighbourhoods, windows.dim, STILL)
        return Elimination(sparse.csc_array(B + steady), take.keys)

    return _by_source(take, sources, solution)


def _by_source(
    take: KeyedPerformance, sources: FloatArray, solution: Callable[[FloatArray], Interpolant]
) -> FloatArray:
    """Propagate key poses to all frames, each by the interpolant of its source, (T, G, C)."""
    parts = np.array_split(take.labels, len(sources), axis=1)
    solved = [solution(X)(part) for X, part in zip(sources, parts, strict=True)]
    return np.concatenate(solved, axis=1)


WITH_WINDOWS: dict[str, tuple[Callable[[KeyedPerformance, Windows], FloatArray], Windows]] = {
    "residual": (framework_on_residual, Windows(9, 5)),
    "path": (partial(framework, smoothness=PATH), Windows()),
    "framework": (framework, Windows()),
    "literal": (literal, Windows()),
}
"""Methods of the framework, the shipped default first, each with the windows that suit it."""

WITHOUT_WINDOWS: dict[str, Callable[[KeyedPerformance], FloatArray]] = {
    "laplacian": laplacian,
    "rbf-linear": partial(rbf, kernel="linear"),
    "rbf-thin-plate": partial(rbf, kernel="thin_plate_spline"),
    "ridge": local_ridge,
    "affine": affine_regression,
    "spline": spline,
}
"""Methods to compare it with."""

METHODS = (*WITH_WINDOWS, *WITHOUT_WINDOWS)
"""Every way to propagate, the shipped default first."""

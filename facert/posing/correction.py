"""Correction of a retargeted pose: some controls are set right, the others follow.

The errors of a retargeted pose go together as poses do: where the smile is too weak, so are the
cheeks. But less so, since most of the pose is known from the source. So their covariance is taken
to be what is left of the covariance C of known poses when each control has been observed with a
noise of `SEEN` of its variance,

    S = C - C (C + R)⁻¹ C,      R = SEEN diag C,

scaled to the standard deviations that the model reports, if it does: E. With the error of the given
controls known, or known with variance s², the rest of the pose follows:

    y = p + E_:G (E_GG + s² I)⁻¹ (g - p_G).

Controls that are held keep p, and the others do not follow them: known poses are few, and from
many held controls E would predict all others with certainty.
"""

from __future__ import annotations

import numpy as np

from facert.data.arrays import FloatArray, IntArray
from facert.data.memory import require_square
from facert.posing.completion import Posed
from facert.preprocess.known_poses import Given, KnownPoses

SEEN = 0.1
RIDGE = 1e-9  # relative to the mean variance of a control
LEAST = 1e-24  # variance, where no control varies
CERTAIN = 1e-13  # share of the largest error variance: below, a control has no error to correct


def correct(
    start: FloatArray,
    std: FloatArray | None,
    known: KnownPoses,
    given: Given,
    samples: int,
    rng: np.random.Generator,
    held: IntArray | None = None,
) -> Posed:
    """The pose with some controls corrected, and the others as they then should be.

    Parameters
    ----------
    start : array, shape (P,)
        The pose to begin with.
    std : array, shape (P,), or None
        Standard deviation of the pose.
    known : KnownPoses
    given : Given
        The controls that are set.
    samples : int
        Number of other poses to draw.
    rng : numpy.random.Generator
    held : array of int, shape (h,), optional
        Other controls, which keep the value of `start`.
    """
    G, E = given.controls, _error_covariance(known.poses, std)
    seen = E[np.ix_(G, G)] + given.soft**2 * np.eye(len(G))
    gain = E[:, G] @ np.linalg.pinv(seen, rcond=CERTAIN, hermitian=True)
    pose = start + gain @ (given.values - start[G])
    left = E - gain @ E[G]
    variances, directions = np.linalg.eigh((left + left.T) / 2.0)
    roots = directions * np.sqrt(np.maximum(variances, 0.0))
    drawn = pose + rng.standard_normal((samples, len(pose))) @ roots.T
    spread = np.sqrt(np.maximum(left.diagonal(), 0.0))
    posed = Posed(known.clip(pose), spread, known.clip(drawn))
    if given.soft == 0.0:
        _fix(posed, G, given.values)
    if held is not None:
        _fix(posed, held, start[held])
    return posed


def _fix(posed: Posed, controls: IntArray, values: FloatArray) -> None:
    """Set some controls (k,) to values that are certain, in place."""
    posed.pose[controls], posed.std[controls], posed.samples[:, controls] = values, 0.0, values


def _error_covariance(poses: FloatArray, std: FloatArray | None) -> FloatArray:
    """E: the covariance of the errors of a retargeted pose, (P, P)."""
    require_square(poses.shape[1], "/target/params", "Correct a take of fewer controls.")
    C = np.atleast_2d(np.cov(poses, rowvar=False))
    C[np.diag_indices_from(C)] += max(RIDGE * np.trace(C) / len(C), LEAST)
    S = C - C @ np.linalg.solve(C + SEEN * np.diag(C.diagonal()), C)
    if std is None:
        return S
    scale = std / np.sqrt(S.diagonal())
    return np.asarray(scale[:, None] * S * scale)

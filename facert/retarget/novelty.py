"""Warning of frames in which the face does what no posed frame showed.

From posed frames a method learns what pose goes with what the face does in them; of anything else
it can only guess. The standard deviation of a pose hardly shows that: it grows with the distance of
a frame from the posed ones, in which new motion of a lid is lost beside that of a jaw.

With A (l, d) the posed frames less their mean c, a frame x is explained as a sum of these with
small weights (ridge regression), which leaves the residual

    r = (x - c) μ (AᵀA + μ I)⁻¹,      μ = λ tr(AᵀA) / l,

zero where posed frames reach, and x - c where they never went. The residual of each marker is
compared with how much it moves in the training take, posed or not. Of weights, it counts as far as
they matter to the poses (`relevance`).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from facert.data.arrays import FloatArray
from facert.data.sides import counterparts
from facert.data.take import SourceKind
from facert.preprocess.motion.motion import Motion

RIDGE = 0.1
"""λ: the smaller, the further posed frames are taken to reach beyond themselves."""
STILL = 0.3
"""Markers that move less, in normalised units, are taken to move so much: of skin and noise."""
NEW = 0.6
"""A frame is new when its residual is so much of the usual motion, RMS over markers."""
TELLING = 5
"""With fewer poses every weight counts in full."""
SHOWN = 0.5
"""A weight was shown in posed frames that vary by this share of its usual variance there."""
LEAST_SHARE = 0.05
"""Of all frames: with fewer new ones there is no warning."""
NAMED, ALIKE = 3, 0.25
"""So many markers at most are named, those that show this share of what the first one does."""


def usual_variance(posed: FloatArray, motion: Motion | None) -> FloatArray:
    """Variance of each column in the training take, (d,); without a motion, of posed frames."""
    if motion is None:
        return np.asarray(posed.var(axis=0))
    return np.asarray(np.square(motion.factors.weights).sum(axis=1) + motion.factors.noise)


def relative_residuals(
    frames: FloatArray, posed: FloatArray, variance: FloatArray, kind: SourceKind
) -> FloatArray:
    """Residual of each marker or weight relative to its usual motion, (T, n).

    Parameters
    ----------
    frames, posed : arrays, shapes (T, d) and (l, d)
        Normalised and complete.
    variance : array, shape (d,)
        Usual variance of each column in the training take.
    kind : {"markers", "weights"}
    """
    return relative_lengths(unexplained(frames, posed), variance, kind)


def unexplained(frames: FloatArray, posed: FloatArray) -> FloatArray:
    """What posed frames (l, d) leave of frames (T, d), the residual r above."""
    A, moved = posed - posed.mean(axis=0), frames - posed.mean(axis=0)
    ridge = RIDGE * float(np.square(A).sum()) / len(A)
    ridge = max(ridge, np.finfo(np.float64).tiny)
    if len(A) < A.shape[1]:  # μ (AᵀA + μ I)⁻¹ = I - Aᵀ (AAᵀ + μ I)⁻¹ A, of the smaller side
        weights = np.linalg.solve(A @ A.T + ridge * np.eye(len(A)), A @ moved.T)
        return np.asarray(moved - weights.T @ A)
    return np.linalg.solve(A.T @ A / ridge + np.eye(A.shape[1]), moved.T).T


def relative_lengths(residuals: FloatArray, variance: FloatArray, kind: SourceKind) -> FloatArray:
    """Lengths of residuals (T, d) by marker or weight relative to its usual motion, (T, n)."""
    size = 3 if kind == "markers" else 1
    lengths = np.linalg.norm(residuals.reshape(len(residuals), -1, size), axis=2)
    motion = np.sqrt(variance.reshape(-1, size).sum(axis=1))
    return np.asarray(lengths / np.maximum(motion, STILL))


def relevance(
    posed: FloatArray, poses: FloatArray, variance: FloatArray, names: Sequence[str]
) -> FloatArray:
    """How far what each weight does matters to the poses, (n,), from 0 to 1.

    A gaze, or the angles of a head, may move a lot while no control of the character goes with it:
    what it does in other frames is of no account. So a weight matters as far as the poses explain
    it, by ridge regression from these with the row itself left out. One that posed frames hardly
    move may be an expression that was not shown yet: it matters. Twins, of left and right, go
    together.

    Parameters
    ----------
    posed, poses : arrays, shapes (l, n) and (l, P)
        Normalised and complete.
    variance : array, shape (n,)
        Usual variance of each weight in the training take.
    names : sequence of str
        Of the weights.
    """
    centred, count = poses - poses.mean(axis=0), len(posed)
    if count < TELLING:
        return np.ones(len(names))
    ridge = RIDGE * float(np.square(centred).sum()) / count
    ridge = max(ridge, np.finfo(np.float64).tiny)
    if count > centred.shape[1]:  # (CCᵀ + μ I)⁻¹ CCᵀ = C (CᵀC + μ I)⁻¹ Cᵀ, of the smaller side
        square = centred.T @ centred
        back = np.linalg.solve(square + ridge * np.eye(len(square)), centred.T)
        predicted, own = centred @ (back @ posed), np.einsum("lp,pl->l", centred, back)
    else:
        square = centred @ centred.T
        hat = np.linalg.solve(square + ridge * np.eye(count), square)
        predicted, own = hat @ posed, np.diag(hat)
    left_out = (1.0 - own - 1.0 / count)[:, None]
    missed = np.square((posed - predicted - posed.mean(axis=0)) / left_out).mean(axis=0)
    whole = posed.var(axis=0) * (count / (count - 1)) ** 2  # likewise of the others' mean
    twins = counterparts(names)
    missed, whole, usual = (values + values[twins] for values in (missed, whole, variance))
    explained = 1.0 - np.divide(missed, whole, out=np.ones_like(whole), where=whole > 0.0)
    moved = np.divide(whole, SHOWN * usual, out=np.zeros_like(whole), where=usual > 0.0)
    return np.asarray(1.0 - np.minimum(moved, 1.0) * (1.0 - np.clip(explained, 0.0, 1.0)))


def over_names(amounts: FloatArray) -> FloatArray:
    """RMS over markers or weights of relative lengths (T, n), (T,); beyond `NEW` a frame is new."""
    return np.asarray(np.sqrt(np.mean(amounts**2, axis=1)))


def novelty_warning(residuals: FloatArray, names: Sequence[str]) -> str | None:
    """Warning of frames unlike the posed ones, by `relative_residuals` (T, n); None if few are."""
    new = over_names(residuals) > NEW
    if new.mean() < LEAST_SHARE:
        return None
    amounts = np.mean(residuals[new] ** 2, axis=0)
    first = np.argsort(-amounts, kind="stable")[:NAMED]
    where = [names[index] for index in first if amounts[index] >= ALIKE * amounts[first[0]]]
    return (
        f"in {new.mean():.0%} of the frames the face does what no posed frame showed "
        f"(mostly {', '.join(where)}): facert suggest --have MODEL names frames to pose"
    )

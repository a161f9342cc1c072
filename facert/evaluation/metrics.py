"""Error measures of a result against the truth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from facert.data.arrays import FloatArray, IntArray, rms
from facert.data.names import control_groups, shape_drivers
from facert.data.rig import Rig
from facert.data.take import Controls, Take


@dataclass(frozen=True)
class GroupError:
    """RMS over one part of the face and the number of its controls, in the controls' own units."""

    name: str
    controls: int
    rms: float


@dataclass(frozen=True)
class Comparison:
    """RMS of a result against the truth over so many frames and controls, and for each part."""

    frames: int
    controls: int
    rms: float
    groups: tuple[GroupError, ...]


def compare(truth: Take, result: Take) -> Comparison | None:
    """Compare two takes of the same frames, where the truth is known.

    Returns
    -------
    Comparison or None
        None when the takes do not have the same controls, or no frame of the truth is posed.
    """
    if truth.controls is None or result.controls is None:
        return None
    if truth.params is None or result.params is None or not len(truth.labels):
        return None
    if set(truth.controls.names) != set(result.controls.names):
        return None
    columns = [truth.controls.names.index(name) for name in result.controls.names]
    rows = truth.labels
    errors = result.params[rows] - truth.params[rows][:, columns]
    groups = tuple(
        GroupError(name, len(members), rms(errors[:, members]))
        for name, members in control_groups(result.controls.names).items()
    )
    return Comparison(len(rows), errors.shape[1], rms(errors), groups)


@dataclass(frozen=True)
class Scores:
    """Errors of poses against the true ones, in every measure that methods are compared by."""

    rms: float  # Over frames and controls, in the controls' own units: the papers' measure
    per_control: tuple[float, ...]  # length P: The same for each control
    # The errors of each control divided by its range first; controls that never move are left out.
    # 1 is as far off as a control can be.
    rms_normalised: float
    # RMS second difference of the error over consecutive frames, in the controls' own units; None
    # when no three frames follow each other
    jitter: float | None = None
    # RMS distance over the vertices of a frame: mean and 95th percentile over the frames, in the
    # rig's units; None without a rig
    vertex_rms: float | None = None
    vertex_p95: float | None = None


def score(
    errors: FloatArray, frames: IntArray, ranges: FloatArray, gram: FloatArray | None = None
) -> Scores:
    """Compute every error measure of some frames.

    Parameters
    ----------
    errors : array, shape (n, P)
        Poses less the true ones, in the controls' own units.
    frames : array of int, shape (n,)
        Which frames of the take they belong to, rising.
    ranges : array, shape (P,)
        Largest less smallest value of each control.
    gram : array, shape (P, P), optional
        The rig's, from `vertex_gram`.
    """
    moving = ranges > 0
    vertex = None if gram is None else vertex_errors(errors, gram)
    return Scores(
        rms=rms(errors),
        per_control=tuple(np.sqrt(np.mean(np.square(errors), axis=0)).tolist()),
        rms_normalised=rms(errors[:, moving] / ranges[moving]) if moving.any() else 0.0,
        jitter=jitter(errors, frames),
        vertex_rms=None if vertex is None else float(vertex.mean()),
        vertex_p95=None if vertex is None else float(np.percentile(vertex, 95)),
    )


def jitter(errors: FloatArray, frames: IntArray) -> float | None:
    """RMS second difference of errors (n, P) wherever three of the frames (n,) are consecutive."""
    consecutive = (np.diff(frames)[:-1] == 1) & (np.diff(frames)[1:] == 1)
    return rms(np.diff(errors, n=2, axis=0)[consecutive]) if consecutive.any() else None


def vertex_gram(rig: Rig, controls: Controls) -> FloatArray:
    """Inner products of a rig's shapes by vertex, (P, P), in the order of the controls.

    A rig is linear, so that the mean squared distance of the vertices of two poses that differ by
    e is e^T G e, whatever the number of vertices.

    Raises
    ------
    InputError
        When the rig lacks a shape for one of them, see `facert.data.names.shape_drivers`.
    """
    drivers = shape_drivers(controls.names, rig.names)
    shapes = drivers @ rig.shapes.reshape(len(rig.names), -1)
    return np.asarray(shapes @ shapes.T / len(rig.neutral))


def vertex_errors(errors: FloatArray, gram: FloatArray) -> FloatArray:
    """RMS distance over the vertices of each frame, (n,), for errors (n, P) of the controls."""
    squared = np.einsum("np,pq,nq->n", errors, gram, errors, optimize=True)
    return np.asarray(np.sqrt(np.maximum(squared, 0.0)))

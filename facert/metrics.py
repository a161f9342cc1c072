"""How far a result is from the truth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from facert.data import FloatArray, Take
from facert.names import control_groups


def rms(errors: FloatArray) -> float:
    """Root mean square over everything, the papers' measure."""
    return float(np.sqrt(np.mean(np.square(errors))))


@dataclass(frozen=True)
class GroupError:
    """RMS over one part of the face.

    Parameters
    ----------
    name : str
        The part.
    controls : int
        How many controls it has.
    rms : float
        In the controls' own units.
    """

    name: str
    controls: int
    rms: float


@dataclass(frozen=True)
class Comparison:
    """A result against the truth.

    Parameters
    ----------
    frames, controls : int
        How many were compared.
    rms : float
        Over all of them, in the controls' own units.
    groups : tuple of GroupError
        The same for each part of the face.
    """

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

"""Regions found in a take: brows and eyes, mouth and jaw, and what lies between.

Markers are parted by how they move (`facert.regions.bipartition`). Controls whose names contain
brows, eyes, mouth or jaw go to that region. Other names leave it to the labels: a control goes with
the markers of the smaller leave-one-out error. Nose and cheeks lie between, and so do controls
whose errors do not clearly differ: they are learned from all markers. Weights, which have no place,
go by their names where these contain such words, else by how they move as well.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from facert.data.arrays import BoolArray, FloatArray
from facert.data.names import control_groups
from facert.data.regions import Region, Regions
from facert.data.take import Take
from facert.errors import InputError
from facert.models.gaussian import fill_gaps
from facert.models.leading_directions import DENSE, LeadingDirections
from facert.models.loo import KernelRidge
from facert.models.whitening import whitening
from facert.regions.bipartition import two_groups

log = logging.getLogger(__name__)

UPPER, LOWER, BETWEEN, WHOLE = "brows-and-eyes", "mouth-and-jaw", "between", "face"
# The side of each group of `facert.data.names`: upper, lower or between; others have none.
SIDES = {"brows": 1.0, "eyes": 1.0, "nose": 0.0, "cheeks": 0.0, "mouth": -1.0, "jaw": -1.0}
CLEAR = 0.6  # by which the logarithms of two mean squared errors must differ to decide
CALM = 0.2  # what a ratio of variances counts beside one of errors, in logarithms
MOST_FRAMES = 1500  # that are looked at
# Of the regression that markers are judged by.
POWER = 0.5  # half-whitening of the markers
RIDGE = 0.1  # relative to the mean variance of their features
FREE = 10.0  # variance of the constant, relative to the same


@dataclass(frozen=True, eq=False)
class TakeSample:
    """Frames and labels of a take that its regions are found from."""

    # Names of the markers, or weights, that are seen at all
    markers: tuple[str, ...]
    controls: tuple[str, ...]
    frames: FloatArray  # (n, M, 3) or (n, M): Complete
    labelled: FloatArray  # (l, M, 3) or (l, M): Frames with a pose
    poses: FloatArray  # (l, P): Their poses
    moving: BoolArray  # (P,): Whether any known pose moves a control

    @classmethod
    def of(cls, take: Take) -> TakeSample:
        """Sample of at most `MOST_FRAMES` frames of a take, and its labels."""
        controls, params, labels = take.controls, take.params, take.labels
        if controls is None or params is None or not len(labels):
            raise InputError("/target", "poses in some frames", "none", "Pose 10 to 40 frames.")
        some = np.linspace(0, len(take) - 1, min(len(take), MOST_FRAMES)).round().astype(np.int64)
        rows = np.union1d(some, labels)
        rows = rows[take.source.valid[rows].any(axis=1)]
        seen = np.asarray(take.source.valid[rows].any(axis=0))
        values = take.source.values[rows][:, seen]
        frames = fill_gaps(values.reshape(len(rows), -1)).reshape(values.shape)
        posed = np.isin(rows, labels)
        if not posed.any():
            raise InputError(
                "/target/params", "poses in frames that show markers", "none", "Pose others."
            )
        known = [params[labels]] if take.animation is None else [params[labels], take.animation]
        return cls(
            markers=_pick(take.source.names, seen),
            controls=controls.names,
            frames=frames,
            labelled=frames[posed],
            poses=params[rows[posed]],
            moving=np.asarray(np.ptp(np.vstack(known), axis=0) > 0),
        )

    def log_errors(self, group: BoolArray) -> FloatArray:
        """The logarithm of the error of predicting each control from some markers, (P,)."""
        frames, labelled = (
            part[:, group].reshape(len(part), -1) for part in (self.frames, self.labelled)
        )
        return np.log(label_errors(frames, labelled, self.poses))


def find_regions(take: Take) -> Regions:
    """The regions of a take's markers and controls.

    One of everything where the face does not come apart, as where all controls are of the mouth.

    Parameters
    ----------
    take : Take
        With poses in some frames.

    Raises
    ------
    InputError
        When the take has no poses.
    """
    sample = TakeSample.of(take)
    named = sides_by_name(sample.controls)
    markers = _marker_sides(sample, named)
    controls = _control_sides(sample, named, markers)
    everything = np.ones(len(markers), dtype=np.bool_)
    found = [
        Region(name, _pick(sample.markers, sees), _pick(sample.controls, moves))
        for name, sees, moves in (
            (UPPER, markers >= 0, controls > 0),
            (LOWER, markers <= 0, controls < 0),
            (BETWEEN, everything, controls == 0),
        )
        if sees.any() and (moves & sample.moving).any()
    ]
    if {UPPER, LOWER} <= {region.name for region in found}:
        return Regions(tuple(found))
    log.info("the face does not come apart into %s and %s: learned as a whole", UPPER, LOWER)
    return Regions((Region(WHOLE, sample.markers, sample.controls),))


def label_errors(frames: FloatArray, labelled: FloatArray, poses: FloatArray) -> FloatArray:
    """Leave-one-out mean squared error of ridge regression, relative to each control's variance.

    The kernel is linear in half-whitened features.

    Parameters
    ----------
    frames : array, shape (n, d)
        All frames of some markers, complete, in any unit; the features are learned from them.
    labelled : array, shape (l, d)
        Frames with a pose.
    poses : array, shape (l, P)

    Returns
    -------
    array, shape (P,)
        1 for controls that never move, and where no marker does.
    """
    if not frames.shape[1]:
        return np.ones(poses.shape[1])
    if frames.shape[1] > DENSE:
        directions = LeadingDirections.learned(frames)
        frames, labelled = directions.scores(frames), directions.scores(labelled)
    features = (labelled - labelled.mean(axis=0)) @ whitening(frames, POWER)
    K, Y = features @ features.T, poses - poses.mean(axis=0)
    scale, variances = float(np.trace(K)) / len(K), np.sum(Y**2, axis=0)
    if not scale > 0.0:
        return np.ones(poses.shape[1])
    errors = np.sum(KernelRidge.of(K / scale + FREE, Y).errors(RIDGE) ** 2, axis=0)
    moves = variances > 0.0
    return np.where(moves, errors, 1.0) / np.where(moves, variances, 1.0)


def sides_by_name(names: Sequence[str]) -> FloatArray:
    """Side of each name: 1 for brows and eyes, -1 for mouth and jaw, 0 between, else NaN."""
    sides = np.full(len(names), np.nan)
    for group, members in control_groups(names).items():
        sides[members] = SIDES.get(group, np.nan)
    return sides


def _name_both(sides: FloatArray) -> bool:
    """Whether names occur on both sides."""
    return bool((sides > 0).any() and (sides < 0).any())


def _marker_sides(sample: TakeSample, named: FloatArray) -> FloatArray:
    """The side of each marker; weights that both regions see are at 0."""
    if sample.frames.ndim == 2:
        by_name = sides_by_name(sample.markers)
        if _name_both(by_name):
            return np.nan_to_num(by_name)
    group = two_groups(sample.frames)
    if group.all() or not group.any():
        return np.zeros(len(group))
    upper = group if _is_upper(group, sample, named) else ~group
    return np.where(upper, 1.0, -1.0)


def _is_upper(group: BoolArray, sample: TakeSample, named: FloatArray) -> bool:
    """Whether a group of markers is the upper one.

    Controls with a side by name must be predicted by it, and the side whose controls move more has
    the markers that do. Without such names it is the calmer group: nothing moves as a jaw does.
    Each term changes its sign with the group: which of the two comes first, an eigenvector's sign
    has decided, and that is up to rounding.
    """
    spread = sample.frames.var(axis=0).reshape(len(group), -1).sum(axis=1)
    calm = _log_ratio(spread[~group].max(), spread[group].max())
    upper, lower = (named > 0) & sample.moving, (named < 0) & sample.moving
    if not (upper.any() and lower.any()):
        return calm > 0
    moved = sample.poses.var(axis=0)
    closer = sample.log_errors(~group) - sample.log_errors(group)
    expected = _log_ratio(moved[lower].max(), moved[upper].max())
    fit = 0.5 * (abs(calm + expected) - abs(calm - expected))
    return bool(closer[upper].mean() - closer[lower].mean() + CALM * fit > 0)


def _log_ratio(one: float, other: float) -> float:
    """The logarithm of the ratio of two variances, finite even if they are 0."""
    tiny = np.finfo(np.float64).tiny
    return float(np.log(max(one, tiny)) - np.log(max(other, tiny)))


def _control_sides(sample: TakeSample, named: FloatArray, markers: FloatArray) -> FloatArray:
    """The side of each control: by its name, else by the markers that predict it best."""
    sides = named
    if np.isnan(named).any():
        closer = sample.log_errors(markers < 0) - sample.log_errors(markers > 0)
        sides = np.where(np.isnan(named), np.sign(closer) * (np.abs(closer) > CLEAR), named)
    return np.where((sides == 0) & ~sample.moving, -1.0, sides)  # what is still may be anywhere


def _pick(names: Sequence[str], chosen: BoolArray) -> tuple[str, ...]:
    return tuple(name for name, there in zip(names, chosen, strict=True) if there)

"""Regions found in a take: brows and eyes, mouth and jaw, and what lies between.

Markers are parted by how they move (`facert.regions.bipartition`). Controls whose names speak of
brows, eyes, mouth or jaw go to that region. Names that do not speak leave it to the labels: a
control goes with the markers that predict it best in labels left out. Nose and cheeks lie between,
and so may what the labels do not clearly tell: such controls are learned from all markers. Weights,
which have no place, go by their names where these speak, else by how they move as well.
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
from facert.regions.bipartition import two_groups
from facert.regions.label_errors import left_out_errors

log = logging.getLogger(__name__)

UPPER, LOWER, BETWEEN, WHOLE = "brows-and-eyes", "mouth-and-jaw", "between", "face"
# The side of each group of `facert.data.names`: upper, lower or between; others do not tell.
SIDES = {"brows": 1.0, "eyes": 1.0, "nose": 0.0, "cheeks": 0.0, "mouth": -1.0, "jaw": -1.0}
CLEAR = 0.6  # by which the logarithms of two mean squared errors must differ to tell
CALM = 0.2  # what a ratio of variances counts beside one of errors, in logarithms
MOST_FRAMES = 1500  # that are looked at


@dataclass(frozen=True, eq=False)
class Evidence:
    """What of a take tells its regions.

    Parameters
    ----------
    markers, controls : tuple of str, lengths M and P
        Those markers, or weights, that are seen at all.
    frames : array, shape (n, M, 3) or (n, M)
        Complete.
    labelled : array, shape (l, M, 3) or (l, M)
        Those with a pose.
    poses : array, shape (l, P)
        Their poses.
    moving : array of bool, shape (P,)
        Whether any known pose moves a control.
    """

    markers: tuple[str, ...]
    controls: tuple[str, ...]
    frames: FloatArray
    labelled: FloatArray
    poses: FloatArray
    moving: BoolArray

    @classmethod
    def of(cls, take: Take) -> Evidence:
        """From at most `MOST_FRAMES` and the labels."""
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

    def misses(self, group: BoolArray) -> FloatArray:
        """The logarithm of how badly some markers predict each control, (P,)."""
        frames, labelled = (
            part[:, group].reshape(len(part), -1) for part in (self.frames, self.labelled)
        )
        return np.log(left_out_errors(frames, labelled, self.poses))


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
    evidence = Evidence.of(take)
    named = sides_by_name(evidence.controls)
    markers = _marker_sides(evidence, named)
    controls = _control_sides(evidence, named, markers)
    everything = np.ones(len(markers), dtype=np.bool_)
    found = [
        Region(name, _pick(evidence.markers, sees), _pick(evidence.controls, moves))
        for name, sees, moves in (
            (UPPER, markers >= 0, controls > 0),
            (LOWER, markers <= 0, controls < 0),
            (BETWEEN, everything, controls == 0),
        )
        if sees.any() and (moves & evidence.moving).any()
    ]
    if {UPPER, LOWER} <= {region.name for region in found}:
        return Regions(tuple(found))
    log.info("the face does not come apart into %s and %s: learned as a whole", UPPER, LOWER)
    return Regions((Region(WHOLE, evidence.markers, evidence.controls),))


def sides_by_name(names: Sequence[str]) -> FloatArray:
    """1 for brows and eyes, -1 for mouth and jaw, 0 between; NaN where a name does not tell."""
    sides = np.full(len(names), np.nan)
    for group, members in control_groups(names).items():
        sides[members] = SIDES.get(group, np.nan)
    return sides


def _speak(sides: FloatArray) -> bool:
    """Whether names tell of either side."""
    return bool((sides > 0).any() and (sides < 0).any())


def _marker_sides(evidence: Evidence, named: FloatArray) -> FloatArray:
    """The side of each marker; weights that both regions see are at 0."""
    if evidence.frames.ndim == 2:
        by_name = sides_by_name(evidence.markers)
        if _speak(by_name):
            return np.nan_to_num(by_name)
    group = two_groups(evidence.frames)
    if group.all() or not group.any():
        return np.zeros(len(group))
    upper = group if _is_upper(group, evidence, named) else ~group
    return np.where(upper, 1.0, -1.0)


def _is_upper(group: BoolArray, evidence: Evidence, named: FloatArray) -> bool:
    """Whether a group of markers is the upper one.

    Controls whose names tell must be predicted by their own side, and the side whose controls move
    more has the markers that do. Where names do not tell, the calmer group is: nothing moves as a
    jaw does.
    """
    spread = evidence.frames.var(axis=0).reshape(len(group), -1).sum(axis=1)
    calm = _log_ratio(spread[~group].max(), spread[group].max())
    upper, lower = (named > 0) & evidence.moving, (named < 0) & evidence.moving
    if not (upper.any() and lower.any()):
        return calm > 0
    moved = evidence.poses.var(axis=0)
    closer = evidence.misses(~group) - evidence.misses(group)
    expected = _log_ratio(moved[lower].max(), moved[upper].max())
    return bool(closer[upper].mean() - closer[lower].mean() + CALM * (calm - expected) > 0)


def _log_ratio(one: float, other: float) -> float:
    """Of two variances, finite even if they are 0."""
    tiny = np.finfo(np.float64).tiny
    return float(np.log(max(one, tiny)) - np.log(max(other, tiny)))


def _control_sides(evidence: Evidence, named: FloatArray, markers: FloatArray) -> FloatArray:
    """The side of each control: by its name, else by the markers that predict it best."""
    sides = named
    if np.isnan(named).any():
        closer = evidence.misses(markers < 0) - evidence.misses(markers > 0)
        sides = np.where(np.isnan(named), np.sign(closer) * (np.abs(closer) > CLEAR), named)
    return np.where((sides == 0) & ~evidence.moving, -1.0, sides)  # what is still may be anywhere


def _pick(names: Sequence[str], chosen: BoolArray) -> tuple[str, ...]:
    return tuple(name for name, there in zip(names, chosen, strict=True) if there)

"""Taking the head's rigid motion out of markers.

Some markers sit where skin hardly moves against the skull. The motion of their rigid shape is the
head's: found for all frames at once by weighted least squares, where a marker that strays in some
frames loses its weight there (iteratively reweighted, with the weights of Geman and McClure 1987).
"""

from __future__ import annotations

import logging
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from facert.data.arrays import BoolArray, FloatArray, IntArray, lengths, require_sensible
from facert.data.names import match
from facert.data.take import Source, Take
from facert.errors import InputError
from facert.mesh.rigid import RigidMotion, align, determined, mean_motion

log = logging.getLogger(__name__)

SHARE, FEWEST = 0.3, 5
"""How many markers are taken for stable: this share of all, this many at least."""
SHAPES, REWEIGHTED = 3, 5
"""How often the shape is estimated anew, and for each shape the weights."""
ORDINARY = 0.95
"""This share of all distances from the rigid shape is ordinary: skin and noise."""
STRAY = 3.0
"""At so many times an ordinary distance a marker has a quarter of its weight."""
DISTANCES, FEWEST_FRAMES, MOST_FRAMES = 20_000_000, 50, 500
"""Distances that are compared, in some frames, evenly spread."""
AT_ONCE = 1_000_000
"""Distances that are in memory at once."""
CANDIDATES = 600
"""Of more markers, so many evenly spread ones are looked at: they are more than enough."""


@dataclass(frozen=True, eq=False)
class Stabilised:
    """A take without head motion, and what was removed."""

    take: Take
    head: RigidMotion  # Takes the stabilised markers to the recorded ones
    stable: IntArray  # The markers whose motion was taken for the head's
    interpolated: BoolArray  # (T,): Frames that show too few of them
    # Root mean square motion that is left to the stable markers, in the take's units
    residual: float

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the stable markers."""
        return tuple(self.take.source.names[index] for index in self.stable)

    @property
    def shifts(self) -> FloatArray:
        """Distances by which the head moved the middle of the stable markers, (T,)."""
        middle = np.nanmedian(self.take.source.values[:, self.stable], axis=(0, 1))
        return np.asarray(np.linalg.norm(self.head.apply(middle[None])[:, 0] - middle, axis=1))


def stabilise(
    take: Take,
    stable: Sequence[str] | Literal["automatic"] = "automatic",
    reference: int | Literal["mean"] | Take = "mean",
) -> Stabilised:
    """Remove the head's rigid motion.

    Parameters
    ----------
    take : Take
        A take of markers; gaps are allowed.
    stable : sequence of str, or "automatic"
        Names of markers that hardly move against the skull, or `stable_markers`.
    reference : int or "mean" or Take
        The frame whose head pose all frames get, or the mean pose; or another take of the actor
        that was stabilised before, whose head pose, and stable markers if they are to be found,
        this one gets.

    Returns
    -------
    Stabilised
        Frames that show fewer than three stable markers get the motion of their neighbours in
        time.

    Raises
    ------
    InputError
        For a source of weights, unknown names, fewer than three stable markers or markers on a
        line, a frame that the take has not or that does not show its own pose, or a take of which
        no frame shows enough.
    """
    markers = _markers(take.source)
    if isinstance(reference, Take) and stable == "automatic":
        found = stable_markers(_markers(reference.source))
        stable = [reference.source.names[index] for index in found]
    chosen = _chosen(take.source, stable)
    points = markers[:, chosen]
    require_sensible(np.nan_to_num(points), "/source/markers")
    shape, seen = _mean_shape(points), ~np.isnan(points[:, :, 0])
    known = determined(shape, seen)
    _require_known(known)
    shape, motion = _rigid(shape, points, known)
    motion = motion.interpolated(take.time, known)
    if isinstance(reference, Take):
        steady = _steady_shape(reference.source, take.source, chosen)
        pose = align(shape, steady, np.ones(steady.shape[:2]))
    else:
        pose = _pose(motion, known, reference)
    head = motion.after(pose.inverse())
    left = lengths(motion.undo(points) - shape)[known[:, None] & seen]
    return Stabilised(
        replace(take, source=Source(head.undo(markers), take.source.names)),
        head,
        chosen,
        ~known,
        float(np.sqrt(np.mean(left**2))),
    )


def stable_markers(markers: FloatArray) -> IntArray:
    """Markers whose distances to each other change least over the take.

    Starts with all and drops, one after the other, the one whose distances to the rest change
    most (sum of squares; half the range that holds 90 % of the frames, so that a few bad frames
    do not count), until `SHARE` of the markers are left.

    Parameters
    ----------
    markers : array, shape (T, M, 3)
        NaN: not observed.

    Returns
    -------
    array of int, shape (S,)
        In rising order.

    Raises
    ------
    InputError
        When fewer than three markers were ever seen.
    """
    seen = np.flatnonzero(~np.isnan(markers[:, :, 0]).all(axis=0))
    if len(seen) < 3:
        raise InputError(
            "/source/markers", "three markers or more", f"{len(seen)}", "Check the export."
        )
    if len(seen) > CANDIDATES:
        seen = seen[np.linspace(0, len(seen) - 1, CANDIDATES).round().astype(np.int64)]
    change = _distance_change(markers[:, seen]) ** 2
    total = change.sum(axis=1)  # to the markers that are left
    for _ in range(len(seen) - max(FEWEST, math.ceil(SHARE * len(seen)))):
        worst = total.argmax()
        total -= change[:, worst]
        total[worst] = -np.inf
    return np.asarray(seen[total > -np.inf])


def _distance_change(markers: FloatArray) -> FloatArray:
    """Change of the distance of each pair, (M, M); the most for pairs never seen together."""
    frames, count = markers.shape[:2]
    some = int(np.clip(DISTANCES // count**2, FEWEST_FRAMES, MOST_FRAMES))
    few = markers[np.linspace(0, frames - 1, min(some, frames)).round().astype(np.int64)]
    few = np.ascontiguousarray(few.transpose(1, 0, 2))
    change, farthest = np.full((count, count), np.nan), 0.0
    rows = max(AT_ONCE // (few.shape[1] * count), 1)
    for start in range(0, count, rows):
        here = slice(start, start + rows)
        distance = lengths(few[here, None] - few[None, start:])
        farthest = max(farthest, float(np.fmax.reduce(distance, None, initial=0.0)))
        low, high = _quantiles(distance, (0.05, 0.95))
        change[here, start:] = (high - low) / 2.0
        change[start:, here] = change[here, start:].T
    change = np.where(np.isnan(change), farthest, change)
    np.fill_diagonal(change, 0.0)
    return change


def _quantiles(values: FloatArray, shares: Sequence[float]) -> list[FloatArray]:
    """Quantiles over the last axis of what is not NaN, between neighbours; NaN where nothing is."""
    ordered = np.sort(values, axis=-1)  # NaN comes last
    last = np.maximum((~np.isnan(values)).sum(axis=-1, keepdims=True) - 1, 0)
    found = []
    for place in (share * last for share in shares):
        low = np.floor(place).astype(np.int64)
        below, above = (
            np.take_along_axis(ordered, at, axis=-1) for at in (low, np.minimum(low + 1, last))
        )
        found.append(np.asarray((below + (place - low) * (above - below))[..., 0]))
    return found


def _markers(source: Source) -> FloatArray:
    if source.kind != "markers":
        raise InputError(
            "/source", "markers", "weights", "Weights have no head motion: use the take as it is."
        )
    return source.values


def _chosen(source: Source, stable: Sequence[str] | Literal["automatic"]) -> IntArray:
    if stable == "automatic":
        log.warning("stable markers found automatically differ from take to take: check them")
        return stable_markers(source.values)
    if len(stable) < 3:
        raise InputError("--stable", "three markers or more", f"{len(stable)}", "Name more.")
    chosen = match(stable, source.names, "--stable")
    never = [name for name, i in zip(stable, chosen, strict=True) if not source.valid[:, i].any()]
    if never:
        raise InputError(
            "--stable", "markers that were seen", f"{never[0]!r}, which never was", "Leave it out."
        )
    return np.asarray(chosen)


def _mean_shape(points: FloatArray) -> FloatArray:
    """A first guess of the rigid shape (S, 3): frames aligned to the one that shows most.

    A marker that this frame hides gets its place from the frames aligned without it.
    """
    seen = ~np.isnan(points[:, :, 0])
    first = points[seen.sum(axis=1).argmax()]
    shown = ~np.isnan(first[:, 0])
    enough = determined(first[shown], seen[:, shown])
    _require_known(enough)
    aligned = align(first[shown], points[enough][:, shown], seen[enough][:, shown] * 1.0)
    everywhere = aligned.undo(points[enough])
    lost = np.isnan(everywhere[:, :, 0]).all(axis=0)
    if lost.any():
        expected, found = "stable markers that are seen together", "some that never are"
        raise InputError("--stable", expected, found, "Choose others.")
    return np.asarray(np.nanmedian(everywhere, axis=0))


def _rigid(
    shape: FloatArray, points: FloatArray, known: BoolArray
) -> tuple[FloatArray, RigidMotion]:
    """Shape and motion of points that are rigid but for skin, noise and strays."""
    seen = (~np.isnan(points[:, :, 0])).astype(np.float64)
    motion = align(shape, points, seen)
    for _ in range(SHAPES):
        motion, weights = _reweighted(shape, points, seen, known, motion)
        shape = np.nanmedian(motion.undo(points)[known], axis=0)
    return shape, align(shape, points, weights)


def rigid_motion(shape: FloatArray, points: FloatArray) -> RigidMotion:
    """Rigid motion of each frame from a shape (m, 3) to points (T, m, 3), but for what strays."""
    seen = np.ones(points.shape[:2])
    first = align(shape, points, seen)
    return _reweighted(shape, points, seen, np.ones(len(points), dtype=np.bool_), first)[0]


def _reweighted(
    shape: FloatArray, points: FloatArray, seen: FloatArray, known: BoolArray, motion: RigidMotion
) -> tuple[RigidMotion, FloatArray]:
    """The motion to points (T, m, 3) from a first guess of it, and the weights that it is by."""
    for _ in range(REWEIGHTED):
        away = lengths(motion.undo(points) - shape)
        ordinary = np.nanquantile(away[known], ORDINARY) + np.finfo(float).tiny
        weights = seen / (1.0 + np.nan_to_num(away / (STRAY * ordinary)) ** 2) ** 2
        motion = align(shape, points, weights)
    return motion, weights


def _pose(motion: RigidMotion, known: BoolArray, reference: int | Literal["mean"]) -> RigidMotion:
    """Head pose that all frames are brought to."""
    if reference == "mean":
        return mean_motion(RigidMotion(motion.rotations[known], motion.translations[known]))
    if not 0 <= reference < len(motion) or not known[reference]:
        inside = 0 <= reference < len(motion)
        found = f"frame {reference}" + (", which shows too few" if inside else "")
        expected = f"a frame from 0 to {len(motion) - 1} that shows three stable markers"
        raise InputError("--reference", expected, found, "Choose another frame, or mean.")
    return motion.at(reference)


def _steady_shape(steady: Source, source: Source, chosen: IntArray) -> FloatArray:
    """Positions in a stabilised take of the stable markers of another, (1, S, 3)."""
    names = [source.names[index] for index in chosen]
    places = _markers(steady)[:, match(names, steady.names, "--like")]
    if np.isnan(places).all(axis=0).any():
        raise InputError(
            "--like", "a take that shows the stable markers", "one that hides some", "Name others."
        )
    return np.asarray(np.nanmedian(places, axis=0)[None])


def _require_known(known: BoolArray) -> None:
    if not known.any():
        expected = "three stable markers, not on a line, in some frame"
        raise InputError("--stable", expected, "fewer in every frame", "Choose other markers.")

"""What is in a take, a rig or a mesh sequence: the facts to see before any work."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from facert.data.arrays import BoolArray, FloatArray
from facert.data.rig import MeshSequence, Rig
from facert.data.take import Source, Take

STILL = 1e-6
"""A channel is active when its range exceeds this share of the widest range of all channels."""

MANY = 5
"""How many of the worst channels, or of the first labels, are named."""


@dataclass(frozen=True)
class Gap:
    """A marker or weight that was not always observed, and the share of frames that lack it."""

    name: str
    missing: float


@dataclass(frozen=True)
class SourceSummary:
    """The source of a take; a constant channel never varies.

    `zeros` counts marker positions that are exactly (0, 0, 0), which is how some programs write a
    lost marker; None when there are none.
    """

    kind: str
    names: tuple[str, ...]
    active: int
    constant: tuple[str, ...]
    missing: float
    zeros: int | None
    worst: tuple[Gap, ...]


@dataclass(frozen=True)
class TargetSummary:
    """The poses of a take; limits are (low, high) a control, labels the frames with a pose."""

    names: tuple[str, ...]
    labels: int
    first_labels: tuple[int, ...]
    active: int
    constant: tuple[str, ...]
    limits: tuple[tuple[float, float], ...] | None
    deviations: bool
    animation: int


@dataclass(frozen=True)
class TakeSummary:
    """A take; `time_gaps` counts the steps in time longer than one and a half nominal frames."""

    kind: str
    frames: int
    seconds: float
    fps: float
    time_gaps: int
    units: str
    up_axis: str
    start_timecode: str
    created_by: str
    source: SourceSummary
    target: TargetSummary | None


@dataclass(frozen=True)
class RigSummary:
    """A rig; `extents` are width, height and depth of the neutral in its units."""

    kind: str
    vertices: int
    triangles: int
    units: str
    extents: tuple[float, ...]
    largest_displacement: float
    names: tuple[str, ...]
    still: tuple[str, ...]


@dataclass(frozen=True)
class MeshSequenceSummary:
    """A mesh in motion; `extents` are width, height and depth of the neutral in its units."""

    kind: str
    frames: int
    seconds: float
    fps: float
    units: str
    vertices: int
    triangles: int
    extents: tuple[float, ...]
    largest_displacement: float


Summary = TakeSummary | RigSummary | MeshSequenceSummary


def summarise(found: Take | Rig | MeshSequence) -> Summary:
    """Sum up a take, a rig or a mesh sequence.

    Returns
    -------
    TakeSummary, RigSummary or MeshSequenceSummary
        Plain numbers, text and tuples: `dataclasses.asdict` gives what JSON can hold.
    """
    if isinstance(found, MeshSequence):
        return _summarise_sequence(found)
    return _summarise_rig(found) if isinstance(found, Rig) else _summarise_take(found)


def _summarise_sequence(sequence: MeshSequence) -> MeshSequenceSummary:
    neutral = sequence.neutral
    reach = (np.linalg.norm(batch - neutral.vertices, axis=2) for batch in sequence.batches())
    return MeshSequenceSummary(
        kind="mesh sequence",
        frames=len(sequence),
        seconds=float(sequence.time[-1] - sequence.time[0]),
        fps=float(sequence.fps),
        units=neutral.units,
        vertices=len(neutral.vertices),
        triangles=len(neutral.faces),
        extents=tuple(np.ptp(neutral.vertices, axis=0).tolist()),
        largest_displacement=float(max(lengths.max() for lengths in reach)),
    )


def _summarise_take(take: Take) -> TakeSummary:
    return TakeSummary(
        kind="take",
        frames=len(take),
        seconds=float(take.time[-1] - take.time[0]),
        fps=float(take.fps),
        time_gaps=int(np.sum(np.diff(take.time) > 1.5 / take.fps)),
        units=take.units,
        up_axis=take.up_axis,
        start_timecode=take.start_timecode,
        created_by=take.created_by,
        source=_summarise_source(take.source),
        target=_summarise_target(take),
    )


def _summarise_source(source: Source) -> SourceSummary:
    active = _active(source.values)
    missing = 1.0 - source.valid.mean(axis=0)
    worst = [index for index in np.argsort(-missing, kind="stable")[:MANY] if missing[index] > 0]
    return SourceSummary(
        kind=source.kind,
        names=source.names,
        active=int(active.sum()),
        constant=_pick(source.names, ~active),
        missing=float(missing.mean()),
        zeros=_count_zeros(source),
        worst=tuple(Gap(source.names[index], float(missing[index])) for index in worst),
    )


def _count_zeros(source: Source) -> int | None:
    """Marker positions at the origin, or None when there are none."""
    if source.kind != "markers":
        return None
    return int((source.values == 0).all(axis=2).sum()) or None


def _summarise_target(take: Take) -> TargetSummary | None:
    if take.controls is None:
        return None
    names, limits = take.controls.names, take.controls.limits
    poses = [values for values in (take.params, take.animation) if values is not None]
    active = _active(np.concatenate(poses)) if poses else np.zeros(len(names), dtype=bool)
    return TargetSummary(
        names=names,
        labels=len(take.labels),
        first_labels=tuple(take.labels[:MANY].tolist()),
        active=int(active.sum()),
        constant=_pick(names, ~active),
        limits=None if limits is None else tuple((low, high) for low, high in limits.tolist()),
        deviations=take.std is not None,
        animation=0 if take.animation is None else len(take.animation),
    )


def _summarise_rig(rig: Rig) -> RigSummary:
    reach = np.linalg.norm(rig.shapes, axis=2).max(axis=1)
    return RigSummary(
        kind="rig",
        vertices=len(rig.neutral),
        triangles=len(rig.faces),
        units=rig.units,
        extents=tuple(np.ptp(rig.neutral, axis=0).tolist()),
        largest_displacement=float(reach.max()),
        names=rig.names,
        still=_pick(rig.names, reach <= STILL * reach.max()),
    )


def _active(values: FloatArray) -> BoolArray:
    """Which channels vary over the frames that have them, (M,), (D,) or (P,)."""
    # fmax and fmin pass over NaN, and say nothing of a channel that has nothing else.
    ranges = np.fmax.reduce(values) - np.fmin.reduce(values)
    ranges = np.nan_to_num(ranges.max(axis=1) if ranges.ndim == 2 else ranges)
    return np.asarray((ranges > 0) & (ranges > STILL * ranges.max()))


def _pick(names: tuple[str, ...], chosen: BoolArray) -> tuple[str, ...]:
    return tuple(name for name, take in zip(names, chosen, strict=True) if take)

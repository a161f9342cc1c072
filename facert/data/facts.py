"""The facts of a take, a rig or a mesh sequence, to see before any work: what `inspect` prints."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from facert.data.arrays import BoolArray, FloatArray
from facert.data.overview import TakeOverview
from facert.data.rate import frames_at
from facert.data.resampling import EVEN, PAUSE
from facert.data.rig import Mesh, MeshSequence, Rig
from facert.data.take import Source, Take

STILL = 1e-6
"""A channel is active when its range exceeds this share of the widest range of all channels."""

MANY = 5
"""How many of the worst channels, or of the first labels, are named."""


def facts_of(found: Take | TakeOverview | Rig | MeshSequence) -> dict[str, Any]:
    """The facts by name, plain numbers, text, tuples and dictionaries: what JSON can hold.

    ``constant`` channels never vary, ``still`` shapes move nothing; ``extents`` are width, height
    and depth of the neutral in its units; ``time_gaps`` counts the steps in time longer than one
    and a half nominal frames, of which ``longest_gap`` has the seconds; frames that are
    ``evenly_spaced`` lie on the grid of their rate, whatever the gaps; ``zeros`` counts marker
    positions that are exactly (0, 0, 0), which is how some programs write a lost marker, and
    ``zero_rows`` frames whose weights are all exactly 0: no face to others, or one at rest. Of an
    overview, what is said of the source is that of the frames ``looked_at``.
    """
    if isinstance(found, MeshSequence):
        return _of_sequence(found)
    if isinstance(found, Rig):
        return _of_rig(found)
    return _of_take(TakeOverview.of(found) if isinstance(found, Take) else found)


def _of_sequence(sequence: MeshSequence) -> dict[str, Any]:
    neutral = sequence.neutral
    reach = (np.linalg.norm(batch - neutral.vertices, axis=2) for batch in sequence.batches())
    return {
        "kind": "mesh sequence",
        **_clock(sequence),
        **_size(neutral),
        "largest_displacement": float(max(lengths.max() for lengths in reach)),
    }


def _of_take(take: TakeOverview) -> dict[str, Any]:
    return {
        "kind": "take",
        **_clock(take),
        **_spacing(take),
        "units": take.units,
        "up_axis": take.up_axis,
        "start_timecode": take.start_timecode,
        "created_by": take.created_by,
        "source": _looked_at(take) | _of_source(take.source),
        "target": _of_target(take),
    }


def _looked_at(take: TakeOverview) -> dict[str, Any]:
    """How many frames the source is of, where these are not all."""
    count = len(take.source.values)
    return {} if count == len(take) else {"looked_at": f"{count} of {len(take)} frames"}


def _clock(found: TakeOverview | MeshSequence) -> dict[str, Any]:
    seconds = float(found.time[-1] - found.time[0])
    return {"frames": len(found), "seconds": seconds, "fps": float(found.fps)}


def _spacing(take: TakeOverview) -> dict[str, Any]:
    """How the frames lie in time: evenly, but for gaps, or not."""
    steps = np.diff(take.time)
    gaps = steps[steps > PAUSE / take.fps]
    return {
        "evenly_spaced": frames_at(take.time, take.fps, EVEN) is not None,
        "time_gaps": len(gaps),
        "longest_gap": float(gaps.max()) if len(gaps) else None,
    }


def _size(mesh: Mesh) -> dict[str, Any]:
    extents = tuple(np.ptp(mesh.vertices, axis=0).tolist())
    return {
        "vertices": len(mesh.vertices),
        "triangles": len(mesh.faces),
        "units": mesh.units,
        "extents": extents,
    }


def _of_source(source: Source) -> dict[str, Any]:
    active = _active(source.values)
    missing = 1.0 - source.valid.mean(axis=0)
    worst = [index for index in np.argsort(-missing, kind="stable")[:MANY] if missing[index] > 0]
    markers = source.kind == "markers"
    zeros = int((source.values == 0).all(axis=-1).sum())
    return {
        "kind": source.kind,
        "names": source.names,
        "active": int(active.sum()),
        "constant": _pick(source.names, ~active),
        "missing": float(missing.mean()),
        "zeros": zeros or None if markers else None,
        "zero_rows": None if markers else zeros or None,
        "worst": tuple({"name": source.names[i], "missing": float(missing[i])} for i in worst),
    }


def _of_target(take: TakeOverview) -> dict[str, Any] | None:
    if take.controls is None:
        return None
    names, limits = take.controls.names, take.controls.limits
    poses = [values for values in (take.params, take.animation) if values is not None]
    active = _active(np.concatenate(poses)) if poses else np.zeros(len(names), dtype=bool)
    return {
        "names": names,
        "labels": len(take.labels),
        "first_labels": tuple(take.labels[:MANY].tolist()),
        "active": int(active.sum()),
        "constant": _pick(names, ~active),
        "limits": None if limits is None else tuple(map(_ends, limits.tolist())),
        "deviations": take.predicted,
        "corrections": take.corrected,
        "animation": 0 if take.animation is None else len(take.animation),
    }


def _ends(limits: Sequence[float]) -> tuple[float | None, ...]:
    """The low and the high limit of a control, None where there is none."""
    return tuple(end if math.isfinite(end) else None for end in limits)


def _of_rig(rig: Rig) -> dict[str, Any]:
    reach = np.linalg.norm(rig.shapes, axis=2).max(axis=1)
    return {
        "kind": "rig",
        **_size(rig.mesh),
        "largest_displacement": float(reach.max()),
        "names": rig.names,
        "still": _pick(rig.names, reach <= STILL * reach.max()),
    }


def _active(values: FloatArray) -> BoolArray:
    """Which channels vary over the frames that have them, (M,), (D,) or (P,)."""
    # fmax and fmin pass over NaN, and give NaN for a channel that has nothing else.
    ranges = np.fmax.reduce(values) - np.fmin.reduce(values)
    ranges = np.nan_to_num(ranges.max(axis=1) if ranges.ndim == 2 else ranges)
    return np.asarray((ranges > 0) & (ranges > STILL * ranges.max()))


def _pick(names: tuple[str, ...], chosen: BoolArray) -> tuple[str, ...]:
    return tuple(name for name, wanted in zip(names, chosen, strict=True) if wanted)

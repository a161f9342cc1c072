"""Propagation on takes: which markers follow which, gaps filled, and a take again at the end."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from facert.data.arrays import FloatArray, IntArray
from facert.data.corrections import WIDTH, put_in
from facert.data.names import NameIndex
from facert.data.take import Corrections, Source, Take
from facert.errors import InputError
from facert.preprocess.known_poses import pose_bounds
from facert.settings import LimitRule
from facert.topology.feature_points import without_gaps
from facert.topology.keyed import KeyedPerformance
from facert.topology.propagation import propagate

log = logging.getLogger("facert")


@dataclass(frozen=True)
class Propagation:
    """Options of propagation; see `facert.topology.propagation.propagate`."""

    method: str = "residual"
    width: int | None = None
    dim: int | None = None
    # Limits that poses are clipped to: those that the take declares; ``"auto"`` falls back on the
    # range of its key poses and animation
    limits: LimitRule = "auto"

    def run(self, source: FloatArray, keys: IntArray, labels: FloatArray) -> FloatArray:
        """Propagate to all frames (T, G, C) from source points (T, M, D), key poses (K, G, C)."""
        performance = KeyedPerformance(source, keys, labels)
        return propagate(performance, self.method, self.width, self.dim)


def propagate_poses(take: Take, keys: Sequence[int], how: Propagation | None = None) -> Take:
    """A take whose every frame has a pose, from the poses of its key frames.

    Parameters
    ----------
    take : Take
        Markers or weights, and poses in the key frames; poses of other frames are not looked at.
    keys : sequence of int
        Frames.
    how : Propagation, optional

    Returns
    -------
    Take
        Its poses are clipped to the limits of `how`. Those of the key frames are kept as set by
        somebody, as corrections are; the others count as predicted, and training passes over them.

    Raises
    ------
    InputError
        When a key frame has no pose, a marker is never observed, or the method cannot do it.
    """
    if take.params is None or take.controls is None:
        raise InputError("/target/params", "poses of the key frames", "none", "Pose some frames.")
    chosen = _keys_with(take.params[:, :1, None], keys, "/target/params")
    source = _filled(take.source)[:, None, :]  # one point: a rig follows the whole face
    poses, how = take.params[chosen], how or Propagation()
    params = how.run(source, chosen, poses[:, None, :])[:, 0]
    bounds = pose_bounds(take, poses, how.limits)
    if bounds is not None:
        params, poses = (np.clip(values, *bounds.T) for values in (params, poses))
    result = replace(take, params=params, std=None, corrections=None)
    frames, first = np.unique(chosen, return_index=True)
    return put_in(result, Corrections(frames, poses[first], np.full(len(frames), WIDTH)))


def propagate_positions(
    take: Take, target: Take, keys: Sequence[int], how: Propagation | None = None
) -> Take:
    """The whole performance of a character's feature points, from their places in key frames.

    Parameters
    ----------
    take : Take
        The actor's markers or weights.
    target : Take
        The character's markers in the same frames, as its source; only the key frames count.
    keys : sequence of int
        Frames.
    how : Propagation, optional

    Returns
    -------
    Take
        The character's markers in every frame, as its source. A marker follows that of the same
        name; if some have none, all of them follow the whole face.

    Raises
    ------
    InputError
        When the takes differ in length, a marker is not seen in a key frame, or is never observed.
    """
    if target.source.kind != "markers" or len(target) != len(take):
        raise InputError(
            "the target take",
            f"markers in {len(take)} frames",
            f"{target.source.kind} in {len(target)}",
            "Give the character's feature points, a row for each frame of the source.",
        )
    chosen = _keys_with(target.source.values, keys, "the target take's /source/markers")
    points, labels = _filled(take.source), target.source.values[chosen]
    partners = _partners(take.source, target.source)
    if partners is None:
        points, labels = points[:, None, :], labels.reshape(len(chosen), 1, -1)
    else:
        points = points.reshape(take.source.values.shape)[:, partners]
    moved = (how or Propagation()).run(points, chosen, labels)
    source = target.source.with_matrix(moved.reshape(len(take), -1))
    return replace(
        take,
        source=source,
        controls=None,
        params=None,
        std=None,
        animation=None,
        corrections=None,
        units=target.units,
        up_axis=target.up_axis,
    )


def _filled(source: Source) -> FloatArray:
    """The source as a matrix without gaps, (T, D); refused if nothing is known of a column."""
    lost = np.flatnonzero(~source.valid.any(axis=0))
    if len(lost):
        raise InputError(
            "/source",
            "every marker seen in some frame",
            f"{source.names[lost[0]]!r} in none ({len(lost)} such)",
            "Remove it from the take.",
        )
    return without_gaps(source)


def _keys_with(values: FloatArray, keys: Sequence[int], field: str) -> IntArray:
    """The key frames, all of whose values (T, M, C) are there."""
    chosen = np.asarray(keys, dtype=np.int64)
    outside = chosen[(chosen < 0) | (chosen >= len(values))]
    if len(outside):
        raise InputError(
            "--keys", f"frames from 0 to {len(values) - 1}", f"{outside[0]}", "Choose others."
        )
    bare = chosen[np.isnan(values[chosen]).any(axis=(1, 2))]
    if len(bare):
        raise InputError(
            field,
            "a whole pose in every key frame",
            f"none in frame {bare[0]} ({len(bare)} such)",
            "Pose it, or choose other key frames.",
        )
    return chosen


def _partners(source: Source, target: Source) -> IntArray | None:
    """Index of the source marker with each target marker's name; None unless all have one."""
    index = NameIndex.among(source.names, target.names, "/source/names")
    found = [index.find(name) for name in target.names]
    if source.kind == "markers" and None not in found and len(set(found)) == len(found):
        return np.array(found, dtype=np.int64)
    log.info("not every target marker has a source marker of its name: all follow the whole face")
    return None

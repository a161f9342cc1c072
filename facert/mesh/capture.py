"""Simulated capture: drive a rig with recorded weights and read vertices as markers.

This is how the papers make a capture whose truth is known: the weights that drive the rig are the
target's parameters, and markers on the actor's mesh, with noise and gaps, are the source.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from facert.data.arrays import FloatArray, IntArray
from facert.data.names import NameIndex
from facert.data.rig import Rig
from facert.data.take import Controls, Source, Take
from facert.data.text import plural
from facert.errors import InputError

log = logging.getLogger("facert")

VISIBLE = 0.1
"""A vertex takes part when some shape moves it by this share of the largest displacement: nobody
puts a marker where hardly anything moves, on the neck, the ears or the crown."""


def simulate_capture(
    rig: Rig,
    performance: Take,
    markers: int = 40,
    vertices: ArrayLike | None = None,
    noise: float = 0.0,
    missing: float = 0.0,
    seed: int = 0,
) -> Take:
    """Make a take with markers as source and the recorded weights as target.

    Weights and shapes are matched by name, in any spelling; one weight may drive both halves of a
    shape that the rig splits in two (``browInnerUp``, ``cheekPuff``). Shapes without a weight rest.
    Weights without a shape are left out of the target. The log names both.

    Parameters
    ----------
    rig : Rig
        The actor, P shapes.
    performance : Take
        T frames whose source is weights.
    markers : int
        Number of vertices to read, far from each other (`farthest_vertices`).
    vertices : array of int, shape (M,), optional
        Vertices to read instead.
    noise : float
        Standard deviation of the Gaussian noise, as a share of the largest standard deviation of
        a marker coordinate.
    missing : float
        Share of the (frame, marker) entries that are hidden at random, 0 up to below 1.
    seed : int
        For the choice of markers, the noise and the gaps, independently of each other.

    Returns
    -------
    Take
        Markers (T, M, 3) in the rig's units, named after their vertices, and parameters.

    Raises
    ------
    InputError
        For a source of markers, names without a match, or an option out of its range.
    """
    _check(noise >= 0, "--noise", "0 or more", noise)
    _check(0 <= missing < 1, "--missing", "a share from 0 to below 1", missing)
    drive = _drive(rig, performance.source)
    if vertices is None:
        chosen = farthest_vertices(rig, markers, seed)
    else:
        chosen = _checked_vertices(rig, vertices)
    actor = Rig(rig.neutral[chosen], rig.shapes[:, chosen], rig.names, np.empty((0, 3), np.int64))
    weights = performance.source.values[:, drive]
    positions = actor.deform(np.where(drive >= 0, weights, 0.0))
    _, noise_seed, gap_seed = np.random.SeedSequence(seed).spawn(3)
    scatter = np.random.default_rng(noise_seed).standard_normal(positions.shape)
    positions += noise * _largest_deviation(positions) * scatter
    positions[np.random.default_rng(gap_seed).random(positions.shape[:2]) < missing] = np.nan
    used = np.unique(drive[drive >= 0])
    params = performance.source.values[:, used]
    return replace(
        performance,
        source=Source(positions, tuple(f"v{vertex}" for vertex in chosen)),
        controls=Controls(tuple(performance.source.names[index] for index in used)),
        params=np.where(np.isnan(params).any(axis=1, keepdims=True), np.nan, params),
        std=None,
        animation=None,
        units=rig.units,
        up_axis="",
    )


def farthest_vertices(rig: Rig, count: int, seed: int = 0) -> IntArray:
    """Choose vertices of the neutral that are far from each other, among those that visibly move.

    Farthest point sampling: the first at random, then always the one farthest from all before. The
    vertices (count,) are in the order in which they were chosen; a smaller count gives their
    beginning.

    Raises `InputError` when fewer vertices move.
    """
    reach = np.linalg.norm(rig.shapes, axis=2).max(axis=0)
    moving = np.flatnonzero(reach > VISIBLE * reach.max())
    _check(1 <= count <= len(moving), "--markers", f"1 to {len(moving)} (vertices move)", count)
    points = rig.neutral[moving]
    first_seed, _, _ = np.random.SeedSequence(seed).spawn(3)
    chosen = np.empty(count, dtype=np.int64)
    chosen[0] = np.random.default_rng(first_seed).integers(len(moving))
    distance = np.full(len(moving), np.inf)
    for step in range(1, count):
        distance = np.minimum(distance, np.linalg.norm(points - points[chosen[step - 1]], axis=1))
        chosen[step] = distance.argmax()
    return moving[chosen]


def _drive(rig: Rig, source: Source) -> IntArray:
    """Index of the weight that drives each shape of the rig, or -1, (P,)."""
    if source.kind != "weights":
        raise InputError(
            "/source", "weights", "markers", "Give recorded weights, e.g. a Live Link Face CSV."
        )
    drive = _matching_weights(rig.names, source.names)
    if (drive < 0).all():
        expected = f"names of the rig's shapes, e.g. {rig.names[0]!r}"
        found = f"none of them, e.g. {source.names[0]!r}"
        fix = "Choose other shapes of the rig, or rename them."
        raise InputError("/source/names", expected, found, fix)
    _log("shape", "of the rig without a weight", [rig.names[i] for i in np.flatnonzero(drive < 0)])
    unused = np.setdiff1d(np.arange(len(source.names)), drive)
    _log("weight", "without a shape of the rig", [source.names[i] for i in unused])
    return drive


def _matching_weights(shapes: Sequence[str], weights: Sequence[str]) -> IntArray:
    index = NameIndex.among(weights, shapes, "/source/names")
    found = [index.find_whole(name) for name in shapes]
    return np.array([-1 if weight is None else weight for weight in found], dtype=np.int64)


def _largest_deviation(positions: FloatArray) -> float:
    """The largest standard deviation of a coordinate, over the frames that are known."""
    known = positions[~np.isnan(positions).any(axis=(1, 2))]
    return float(known.std(axis=0).max()) if len(known) else 0.0


def _checked_vertices(rig: Rig, vertices: ArrayLike) -> IntArray:
    chosen = np.atleast_1d(np.asarray(vertices))  # checked before int64: it may not fit
    inside = ((chosen >= 0) & (chosen < len(rig.neutral))).all()
    different = len(np.unique(chosen)) == len(chosen)
    expected = f"different vertices from 0 to {len(rig.neutral) - 1}"
    _check(bool(inside and different and len(chosen)), "--vertices", expected, chosen.tolist())
    return chosen.astype(np.int64)


def _check(good: bool, option: str, expected: str, found: object) -> None:
    if not good:
        found = str(found)[:60]
        raise InputError(option, expected, found, "Choose another value.", where="options")


def _log(noun: str, what: str, names: Sequence[str]) -> None:
    if names:
        log.info("%s %s: %s", plural(len(names), noun), what, ", ".join(names))

"""Whether the shapes of a rig are in register with its neutral: same place, size, axes and order.

Shapes that were exported one by one often are not: the mesh stands beside the neutral, in another
unit, with another axis up, or with its vertices in another order. A face keeps still somewhere,
and keeps its form by and large; shapes that do not are looked at. Of a similarity that takes the
neutral near such a shape, its parts say what happened, and it can be undone. Of another order they
cannot: its edges are torn.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from facert.data.arrays import BoolArray, FloatArray, IntArray
from facert.data.rig import Rig
from facert.data.text import listed
from facert.mesh.rigid import align

log = logging.getLogger("facert")

STILL = 0.1
"""Least share of a face's vertices that stay near their place in an expression."""
NEAR = 0.05
"""What moves less, in widths of the face, is near its place."""
BESIDE = 0.35
"""What is farther off, in widths, is beside the neutral: shapes of teeth or heads move less."""
ALL_BESIDE = 0.02
"""As far off, if all shapes are by the same vector: it is the neutral that stands elsewhere."""
TURNED = 60.0
"""Degrees from which the axes differ: a head in an expression turns less."""
SCALED = 1.5
"""Factor from which the units differ."""
UNLIKE = 0.25
"""Median distance from every similarity of the neutral, relative to its spread."""
TORN = 0.05
"""Share of edges that are several times as long where the order of vertices differs."""
_LONGER = 5.0
_SEVERAL, _SAME = 3, 0.1
SWAPPED = 0.3
"""Share of the vertices that moved far onto the place of another one, where the order differs."""
_EXACT = 1e-4
_MIRROR = np.array([-1.0, 1.0, 1.0])
_ROUNDS, _SHARP, _TINY = 20, 1e-3, 1e-300
_SNAP_DEGREES, _SNAP_FACTOR = 5.0, 1.1
_FACTORS = np.array([1.0, 10.0, 100.0, 1000.0, 12.0, 2.54, 30.48, 3.2808, 39.37])


@dataclass(frozen=True, eq=False)
class Misfit:
    """A shape that is not in register with the neutral.

    Attributes
    ----------
    shape : int
    cause : {"beside", "scale", "turned", "mirrored", "order"}
    amount : float
        How many widths it is off, how many times as large, how many degrees it is turned.
    """

    shape: int
    cause: str
    amount: float


def misfits(rig: Rig) -> list[Misfit]:
    """The shapes of a rig that are not in register with its neutral, in their order."""
    width = _width(rig.neutral)
    if not width > 0 or len(rig.neutral) < 3:
        return []
    shift = np.median(rig.shapes, axis=1)
    common = shift.mean(axis=0)
    length = float(np.linalg.norm(common))
    apart = np.linalg.norm(shift - common, axis=1).max(initial=0.0)
    if len(shift) >= _SEVERAL and length > ALL_BESIDE * width and apart < _SAME * length:
        return [Misfit(shape, "beside", length / width) for shape in range(len(shift))]
    edges = _edges(rig.faces)
    moved = np.linalg.norm(rig.shapes, axis=2).max(axis=1)
    looked_at = np.flatnonzero(moved > NEAR * width).tolist()
    found = (_misfit(rig, shape, width, edges) for shape in looked_at)
    return [one for one in found if one is not None]


def registered(rig: Rig, align: bool) -> Rig:
    """The rig with a line in the log for each cause that shapes are out of register.

    With `align`, shapes are moved, turned and scaled back, and keep their expression. Where the
    order of vertices differs, they stay as they are.
    """
    found = misfits(rig)
    mended = [one for one in found if align and one.cause != "order"]
    if mended:
        shapes = rig.shapes.copy()
        for one in mended:
            shapes[one.shape] = _undone(rig.neutral, rig.shapes[one.shape], one.cause)
        names = listed([rig.names[one.shape] for one in mended])
        log.info("moved into register with the neutral: %s", names)
        rig = replace(rig, shapes=shapes)
    left = [one for one in found if one not in mended]
    for cause in dict.fromkeys(one.cause for one in left):
        log.warning("%s", _message(rig.names, [one for one in left if one.cause == cause]))
    return rig


def _misfit(rig: Rig, shape: int, width: float, edges: IntArray) -> Misfit | None:
    neutral, moved = rig.neutral, rig.neutral + rig.shapes[shape]
    off = np.linalg.norm(rig.shapes[shape], axis=1)
    far = off > NEAR * width
    swapped = _swapped(neutral, moved, far, width) > SWAPPED
    if np.mean(~far) >= STILL:
        other = swapped or _torn(neutral, moved, edges, far) > TORN
        return Misfit(shape, "order", 1.0) if other else None
    factor, rotation, unlike = _similarity(neutral, moved)
    of_mirrored = _similarity(neutral * _MIRROR, moved)[2]
    if of_mirrored < min(UNLIKE, 0.5 * unlike):
        return Misfit(shape, "mirrored", 1.0)
    if swapped or unlike > UNLIKE:
        return Misfit(shape, "order", 1.0)
    if not 1 / SCALED < factor < SCALED:
        return Misfit(shape, "scale", factor)
    angle = float(np.degrees(Rotation.from_matrix(rotation).magnitude()))
    if angle > TURNED:
        return Misfit(shape, "turned", angle)
    beside = float(off.min()) / width
    return Misfit(shape, "beside", beside) if beside > BESIDE else None


def _similarity(neutral: FloatArray, moved: FloatArray) -> tuple[float, FloatArray, float]:
    """Factor and rotation (3, 3) of the similarity to the moved mesh, and how unlike it still is.

    The latter is the median distance relative to the moved mesh's spread. By reweighted least
    squares, as an expression moves some vertices far and leaves most where the similarity has them.
    """
    weights = np.ones((1, len(neutral)))
    for _ in range(_ROUNDS):
        factor = _spread(moved, weights[0]) / max(_spread(neutral, weights[0]), _TINY)
        motion = align(factor * neutral, moved[None], weights)
        off = np.linalg.norm(motion.apply(factor * neutral)[0] - moved, axis=1)
        weights = 1 / (off[None] + _SHARP * _spread(moved) + _TINY)
    unlike = float(np.median(off)) / max(_spread(moved), _TINY)
    return _snapped_factor(factor), _snapped_rotation(motion.rotations[0]), unlike


def _undone(neutral: FloatArray, shape: FloatArray, cause: str) -> FloatArray:
    """The shape's displacements with the similarity undone that took it out of register.

    Most vertices are still, so that the median is the place.
    """
    moved = neutral + shape
    if cause != "beside":
        mirror = _MIRROR if cause == "mirrored" else np.ones(3)
        factor, rotation, _ = _similarity(neutral * mirror, moved)
        moved = moved @ rotation / factor * mirror
    return moved - np.median(moved - neutral, axis=0) - neutral


def _snapped_factor(factor: float) -> float:
    known = np.concatenate([_FACTORS, 1 / _FACTORS])
    nearest = float(known[np.argmin(np.abs(np.log(known / factor)))])
    return nearest if 1 / _SNAP_FACTOR < factor / nearest < _SNAP_FACTOR else factor


def _snapped_rotation(rotation: FloatArray) -> FloatArray:
    quarters = Rotation.create_group("O").as_matrix()
    cosines = (np.einsum("nij,ij->n", quarters, rotation) - 1) / 2
    nearest = int(cosines.argmax())
    close = cosines[nearest] > np.cos(np.radians(_SNAP_DEGREES))
    return np.asarray(quarters[nearest]) if close else rotation


def _edges(faces: IntArray) -> IntArray:
    """Pairs of vertices that triangles join, once for each triangle, (3F, 2)."""
    return np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])


def _swapped(neutral: FloatArray, moved: FloatArray, far: BoolArray, width: float) -> float:
    """Share of the vertices that moved far onto the exact place of another one that did so too."""
    from scipy.spatial import cKDTree

    distance, onto = map(np.asarray, cKDTree(neutral[far]).query(moved[far]))
    return float(np.mean((distance < _EXACT * width) & (onto != np.arange(int(far.sum())))))


def _torn(neutral: FloatArray, moved: FloatArray, edges: IntArray, far: BoolArray) -> float:
    """Share of the edges that are several times as long; only vertices that are `far` count."""
    there = edges[far[edges].any(axis=1)]
    before, after = (np.linalg.norm(np.diff(x[there], axis=1), axis=2) for x in (neutral, moved))
    usual = np.median(before) if len(before) else 0.0
    return float(np.sum(after > _LONGER * np.maximum(before, usual))) / max(len(edges), 1)


def _spread(points: FloatArray, weights: FloatArray | None = None) -> float:
    """Root mean square distance from the centre."""
    centre = np.average(points, axis=0, weights=weights)
    squared = np.sum((points - centre) ** 2, axis=1)
    return float(np.sqrt(np.average(squared, weights=weights)))


def _width(neutral: FloatArray) -> float:
    sides = np.ptp(neutral, axis=0)
    return float(sides[0] or sides.max())


def _message(names: Sequence[str], found: Sequence[Misfit]) -> str:
    """A line on shapes that are out of register for one cause."""
    many = len(found) > 1
    who = listed([names[one.shape] for one in found])
    are, do = ("are", "") if many else ("is", "s")
    low, high = (f"{end(one.amount for one in found):.3g}" for end in (min, max))
    amount = low if low == high else f"{low} to {high}"
    mend = "facert convert --align-shapes"
    wording = {
        "beside": f"move{do} every vertex by {amount} times the face's width: the mesh stands "
        f"beside the neutral; {mend} moves it back",
        "scale": f"{are} {amount} times as large as the neutral: in another unit? {mend} scales it",
        "turned": f"{are} turned by {amount} degrees: another axis up? {mend} turns it back",
        "mirrored": f"{are} a mirror image: two axes swapped? {mend} turns it back",
        "order": f"{are} torn apart: the vertices are in another order than the neutral's, or it "
        "is another mesh; no option mends that: export all from one mesh, in its order",
    }
    return f"{who} {wording[found[0].cause]}"

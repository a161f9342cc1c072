"""Where the actor wears markers."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from facert.data.arrays import IntArray
from facert.demo.clay import cast_from_front
from facert.demo.head import Head
from facert.demo.skin import LID_EDGE, LIP_BORDER, LIP_EDGE

# In front view, in cm; the sided ones are given for the left half.
MIDDLE = {
    "forehead": (0.0, 5.2),
    "nose_bridge": (0.0, 0.3),
    "nose_tip": (0.0, -2.3),
    "philtrum": (0.0, -4.1),
    "below_lip": (0.0, -6.4),
    "chin": (0.0, -7.8),
}
SIDED = {
    "forehead": (2.8, 5.0),
    "temple": (5.9, 1.6),
    "brow_inner": (1.4, 2.5),
    "brow_middle": (3.2, 3.1),
    "brow_outer": (4.8, 2.6),
    "below_eye": (3.1, -0.6),
    "nose_wing": (1.45, -2.7),
    "nasolabial": (2.2, -3.4),
    "cheek_upper": (3.6, -1.6),
    "cheek_outer": (5.1, -1.4),
    "cheek_lower": (4.2, -3.6),
    "chin_side": (1.7, -7.3),
    "jaw": (4.0, -5.9),
}


def marker_vertices(head: Head) -> tuple[tuple[str, ...], IntArray]:
    """Names and vertices of the 44 markers on the actor's head."""
    half_lid, half_lip = head.lids.shape[1] // 2, head.lips.shape[1] // 2
    edge, border = head.lids[LID_EDGE], head.lips[LIP_BORDER]
    middle = _nearest(head, MIDDLE) | {"lip_upper": border[0], "lip_lower": border[-1]}
    left = _nearest(head, SIDED) | {
        "lid_upper": edge[half_lid // 2],
        "lid_lower": edge[half_lid + half_lid // 2],
        "lip_upper": border[half_lip // 2],
        "lip_lower": border[half_lip + (half_lip + 1) // 2],
        "lip_corner": head.lips[LIP_EDGE, half_lip],
    }
    named = dict(middle)
    for name, vertex in left.items():
        named |= {f"{name}_L": vertex, f"{name}_R": head.mirror[vertex]}
    return tuple(named), np.array(list(named.values()), dtype=np.int64)


def _nearest(head: Head, spots: dict[str, tuple[float, float]]) -> dict[str, int]:
    """The vertex on the skin that is nearest to each spot."""
    on_skin = cast_from_front(np.array(list(spots.values())), head.build.blobs)
    vertices = np.asarray(cKDTree(head.vertices).query(on_skin)[1], dtype=np.int64)
    return dict(zip(spots, vertices.tolist(), strict=True))

"""The effect of the muscles: one displacement of the whole mesh for each activation.

Every field is made from the landmarks of a `Build`, so the same few lines move both heads.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce

import numpy as np
from numpy.typing import ArrayLike

from facert.data.arrays import FloatArray
from facert.demo.build import Build
from facert.demo.head import Head
from facert.demo.parts import Tissue
from facert.demo.skin import LID_EDGE, LIP_EDGE

_ACTIVATIONS = """
    brow_inner_up brow_outer_up_L brow_outer_up_R brow_down_L brow_down_R blink_L blink_R squint
    eye_wide cheek_raise nose_wrinkle smile_L smile_R frown_L frown_R stretch pucker funnel
    lips_press upper_lip_up lower_lip_down mouth_left mouth_right jaw_open jaw_left jaw_right
"""
ACTIVATIONS = tuple(_ACTIVATIONS.split())

Pull = tuple[tuple[float, float], tuple[float, float, float], float]


def expressions(head: Head) -> FloatArray:
    """Displacements (26, V, 3) in cm of all `ACTIVATIONS`, each fully on."""
    muscles = Muscles(head)
    pulled = {name: muscles.pull(pulls) for name, pulls in muscles.pulls.items()}
    left = {name: pulled[name] for name in ("brow_outer_up", "brow_down", "smile", "frown")}
    left["blink"] = muscles.close_lids(0.82, 0.18)
    both = {name: pulled[name] for name in ("brow_inner_up", "cheek_raise", "nose_wrinkle")}
    both["stretch"] = pulled["stretch"]
    both["squint"] = muscles.close_lids(0.12, 0.34)
    both["eye_wide"] = muscles.close_lids(-0.30, -0.10)
    sideways = {"mouth": pulled["mouth_left"], "jaw": muscles.jaw_left()}
    shapes = {f"{name}_L": shape for name, shape in left.items()}
    shapes |= {f"{name}_R": muscles.mirrored(shape) for name, shape in left.items()}
    shapes |= {name: shape + muscles.mirrored(shape) for name, shape in both.items()}
    shapes |= {f"{name}_left": shape for name, shape in sideways.items()}
    shapes |= {f"{name}_right": muscles.mirrored(shape) for name, shape in sideways.items()}
    shapes |= {
        "pucker": muscles.pucker(),
        "funnel": muscles.funnel(),
        "lips_press": muscles.lips_press(),
        "upper_lip_up": muscles.upper_lip_up(),
        "lower_lip_down": muscles.lower_lip_down(),
        "jaw_open": muscles.jaw_open(),
    }
    return np.stack([shapes[name] for name in ACTIVATIONS])


def _pulls(build: Build) -> dict[str, tuple[Pull, ...]]:
    """The muscles of the left half that only pull: point of the front view, way, radius."""
    brow, width = build.brow, build.mouth.width
    (ix, iy), (ax, ay), (ox, oy) = brow.inner, brow.arch, brow.outer
    (cheek_x, cheek_y), (nose_x, nose_y) = build.cheek, build.nose
    corner = mouth_corner(build)
    return {
        "brow_inner_up": (((ix + 0.2, iy + 0.1), (-0.12, 0.85, 0.1), 1.15),),
        "brow_outer_up": ((((ax + ox) / 2, (ay + oy) / 2), (0.05, 0.9, 0.05), 1.5),),
        # Most at the inner end.
        "brow_down": (
            (brow.inner, (-0.28, -0.6, 0.2), 1.0),
            (brow.arch, (-0.15, -0.42, 0.05), 1.3),
        ),
        "cheek_raise": (((cheek_x - 0.3, cheek_y + 0.5), (-0.05, 0.6, 0.32), 1.3),),
        # The wing of the nose goes up, with lip and brow.
        "nose_wrinkle": (
            (brow.inner, (-0.12, -0.25, 0.1), 0.9),
            ((nose_x + 0.1, nose_y), (0.12, 0.55, 0.05), 0.85),
        ),
        # The cheek follows the corner of the mouth.
        "smile": (
            (corner, (0.75, 0.85, -0.45), 1.25),
            ((cheek_x - 0.4, cheek_y), (0.1, 0.35, 0.38), 1.2),
        ),
        "frown": ((corner, (0.12, -0.85, -0.1), 1.15),),
        "stretch": ((corner, (0.85, -0.12, -0.5), 1.3),),
        "mouth_left": (
            ((0.15 * width, build.mouth.centre[1]), (0.9, 0.0, 0.0), 2.1),
            (corner, (0.0, 0.15, -0.35), 1.2),
        ),
    }


def mouth_corner(build: Build) -> tuple[float, float]:
    """The left corner of the mouth in front view."""
    mouth = build.mouth
    return mouth.width * 1.04, mouth.centre[1] + 0.65 * mouth.curve * mouth.width


class Muscles:
    """The displacement fields of one head; those of a pair act on the left side.

    Parameters
    ----------
    head : Head
    """

    def __init__(self, head: Head) -> None:
        self.head, self.build = head, head.build
        self.pulls = _pulls(head.build)
        self.rest = head.vertices
        skin = head.tissue == Tissue.SKIN
        # Ears and the back of the head stay where they are.
        self.soft = skin * smoothstep(self.rest[:, 2], -1.0, 2.5)
        # The lids rest on the eyeball: only `close_lids` moves their edges.
        for row, follow in zip(head.lids, (0.0, 0.0, 0.5, 0.85), strict=True):
            self.soft[row] *= follow
            self.soft[head.mirror[row]] *= follow
        self.lower = self._lower_lip()

    def pull(self, pulls: Sequence[Pull]) -> FloatArray:
        """Pull the vertices near points of the front view, less so further away."""
        parts = []
        for centre, way, radius in pulls:
            distance = np.linalg.norm(self.rest[:, :2] - centre, axis=1) / (radius * self._reach)
            weight = self.soft * np.exp(-0.5 * distance**2)
            parts.append(self.build.motion * weight[:, None] * np.asarray(way))
        return reduce(np.add, parts)

    def mirrored(self, shape: FloatArray) -> FloatArray:
        """A shape (V, 3) of the left side mirrored to the right."""
        return np.asarray(shape[self.head.mirror] * [-1.0, 1.0, 1.0])

    def close_lids(self, upper: float, lower: float) -> FloatArray:
        """Move the lids over the eyeball, each by its part of the opening."""
        eye, lids = self.build.eye, self.head.lids
        shape = np.zeros_like(self.rest)
        edge = self.rest[lids[LID_EDGE]]
        count = edge.shape[0]
        opposite = (-np.arange(count)) % count  # the vertex above or below on the other lid
        gap = edge[opposite] - edge
        above = np.sin(2 * np.pi * np.arange(count) / count) > 0
        share = np.where(above, upper, lower)[:, None]
        for row, follow in enumerate((1.0, 1.0, 0.62, 0.12)):
            shape[lids[row]] += follow * share * gap
        # A straight path would cut through the ball: the lids pass in front of it and stay round.
        travel = np.abs(share[:, 0] * gap[:, 1]) / (eye.upper + eye.lower)
        for row, bulge in enumerate((0.10, 0.10, 0.30)):
            shape[lids[row], 2] += bulge * eye.ball[2] * travel
        return shape

    def pucker(self) -> FloatArray:
        """Lips together and forward, as for a kiss."""
        return self._narrow(0.42) + self._on_lips((0.0, 0.0, 0.65), 1.2)

    def funnel(self) -> FloatArray:
        """Lips forward and apart, as in "oh"."""
        upper = (1 - self.lower)[:, None] * self._on_lips((0.0, 0.42, 0.55), 1.0)
        lower = self.lower[:, None] * self._on_lips((0.0, -0.52, 0.55), 1.0)
        return self._narrow(0.26) + upper + lower

    def lips_press(self) -> FloatArray:
        """The red of both lips rolls in to the line where they meet."""
        mouth = self.build.mouth
        line = mouth.curve * mouth.width * ((self.rest[:, 0] / mouth.width) ** 2 - 0.35)
        height = self.rest[:, 1] - mouth.centre[1] - line
        reach = self._around_lips(0.75)
        roll = np.zeros_like(self.rest)
        roll[:, 1] = -0.75 * np.clip(height, -1.2 * mouth.lower, 1.2 * mouth.upper) * reach
        roll[:, 2] = -1.3 * mouth.fullness * reach
        return roll

    def upper_lip_up(self) -> FloatArray:
        """Upper lip off the teeth."""
        return (1 - self.lower)[:, None] * self._on_lips((0.0, 0.6, 0.08), 0.85)

    def lower_lip_down(self) -> FloatArray:
        """Lower lip off the teeth."""
        return self.lower[:, None] * self._on_lips((0.0, -0.65, 0.05), 0.85)

    def jaw_open(self) -> FloatArray:
        """Jaw turned about its hinge."""
        y, z = self.build.hinge
        angle = self.build.jaw_angle
        arm = self.rest - [0.0, y, z]
        cos, sin = np.cos(angle), np.sin(angle)
        turned = np.column_stack(
            [
                arm[:, 0] * (1 - 0.04),  # cheeks narrow as they lengthen
                cos * arm[:, 1] - sin * arm[:, 2],
                sin * arm[:, 1] + cos * arm[:, 2],
            ]
        )
        return self.jaw_weight()[:, None] * (turned - arm)

    def jaw_left(self) -> FloatArray:
        """Jaw to the left."""
        return self.jaw_weight()[:, None] * [0.65 * self.build.motion, 0.0, 0.0]

    def _on_lips(self, way: ArrayLike, radius: float) -> FloatArray:
        return np.asarray(self.build.motion * self._around_lips(radius)[:, None] * np.asarray(way))

    def _around_lips(self, radius: float) -> FloatArray:
        """Weight 1 in the middle of the mouth, falling to the corners and away from the lips."""
        mouth = self.build.mouth
        x = self.rest[:, 0] / (0.62 * mouth.width)
        y = (self.rest[:, 1] - mouth.centre[1]) / (radius * (mouth.upper + mouth.lower))
        return np.asarray(self.soft * np.exp(-0.5 * (x**2) ** 1.5 - 0.5 * y**2))

    def _narrow(self, part: float) -> FloatArray:
        """Corners of the mouth in and forward."""
        width = self.build.mouth.width * part / self.build.motion
        corner = self.pull([(mouth_corner(self.build), (-width, 0.0, 0.35), 1.15)])
        return corner + self.mirrored(corner)

    def jaw_weight(self) -> FloatArray:
        """Weight from 0 to 1 by which each vertex follows the jaw, (V,)."""
        z, chin = self.build.hinge[1], self.build.chin[1]
        front = smoothstep(self.rest[:, 2], z - 0.5, z + 4.0)
        neck = smoothstep(self.rest[:, 1], chin - 3.2, chin - 0.6)
        under = smoothstep(self.rest[:, 2], z + 1.5, z + 5.5)
        throat = under + (1 - under) * smoothstep(self.rest[:, 1], chin, chin + 3.0)
        skin = self.lower * front * neck * throat * (self.head.tissue == Tissue.SKIN)
        return np.where(self.head.tissue == Tissue.JAW, 1.0, skin)

    def _lower_lip(self) -> FloatArray:
        """Weight 1 below the mouth, 0 above, (V,): a step at the lips, a slope on the cheeks."""
        mouth, lips = self.build.mouth, self.head.lips
        aside = np.maximum(np.abs(self.rest[:, 0]) - 0.4 * mouth.width, 0)
        slope = 0.25 + 0.7 * aside
        line = mouth.centre[1] + mouth.curve * mouth.width * 0.4
        weight = smoothstep(line - self.rest[:, 1], -slope, slope)
        half = lips.shape[1] // 2
        round_off = np.abs(np.cos(np.linspace(0, np.pi, lips.shape[1]))) ** 0.6
        sign = np.sign(np.arange(lips.shape[1]) - half)
        weight[lips[: LIP_EDGE + 4]] = 0.5 + 0.5 * sign * round_off
        right = self.rest[:, 0] < 0
        return np.where(right, weight[self.head.mirror], weight)

    @property
    def _reach(self) -> float:
        """Factor on the width over which a muscle acts, by the size of the mouth."""
        return self.build.mouth.width / 2.4


def smoothstep(x: FloatArray, low: float | FloatArray, high: float | FloatArray) -> FloatArray:
    """0 up to `low`, 1 from `high` on, and smooth between."""
    t = np.clip((x - low) / (high - low), 0, 1)
    return np.asarray(t * t * (3 - 2 * t))

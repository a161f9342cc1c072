"""The 52 shapes of ARKit on the demo's actor: a face to look at tracked weights.

Left is the face's own left, as Apple has it. `mouthClose` closes the lips of an open jaw.
"""

from __future__ import annotations

import numpy as np

from facert.data.arrays import FloatArray
from facert.data.names import ARKIT_SHAPES
from facert.demo.expressions import Muscles, Pull, mouth_corner, smoothstep
from facert.demo.head import Head
from facert.demo.skin import LID_EDGE, LIP_BORDER, LIP_EDGE

GAZE = {"Up": (0.0, 0.42), "Down": (0.0, -0.45), "In": (-0.55, 0.0), "Out": (0.55, 0.0)}
"""Radians by which the left eyeball turns to its left and up."""
GAZE_LIDS = {"Up": (-0.22, 0.10), "Down": (0.36, -0.22), "In": (0.0, 0.0), "Out": (0.0, 0.0)}
"""Parts of the opening by which the lids go along."""
_CLEARANCE = 0.05  # cm of a lid in front of the eyeball
_STEPS = np.linspace(0.05, 1, 20)[:, None]  # of a moving lid


def arkit_shapes(head: Head) -> FloatArray:
    """Displacements (52, V, 3) in cm of all `ARKIT_SHAPES` at 1, of a head with a tongue."""
    muscles = ArkitMuscles(head)
    left = muscles.left()
    shapes = muscles.whole()
    shapes |= {f"{name}Left": shape for name, shape in left.items()}
    shapes |= {f"{name}Right": muscles.mirrored(shape) for name, shape in left.items()}
    return np.stack([shapes[name] for name in ARKIT_SHAPES])


class ArkitMuscles(Muscles):
    """The displacement fields of ARKit's shapes, those of a pair on the left side."""

    def __init__(self, head: Head) -> None:
        super().__init__(head)
        half = 0.45 * self.build.mouth.width
        self.left_half = smoothstep(self.rest[:, 0], -half, half)[:, None]
        """Weight from 0 on the right to 1 on the left, (V, 1)."""

    def left(self) -> dict[str, FloatArray]:
        """Shapes that exist for both sides, without the side's name."""
        eyes = {f"eyeLook{way}": self.look(way) for way in GAZE}
        lids = {
            "eyeBlink": self.lids(0.84, 0.16),
            "eyeSquint": self.lids(0.16, 0.40) + self.pull(self._below_eye(0.22)),
            "eyeWide": self.lids(-0.34, -0.12),
        }
        lips = {
            "mouthPress": self.lips_press(),
            "mouthLowerDown": self.lower_lip_down(),
            "mouthUpperUp": self.upper_lip_up(),
        }
        lips = {name: self.left_half * shape for name, shape in lips.items()}
        sneer = self.left_half * self.upper_lip_up()
        return eyes | lids | self._pulled() | lips | {
            "noseSneer": self.pull(self.pulls["nose_wrinkle"]) + 0.35 * sneer,
            "jaw": self.jaw_left(),
            "mouth": self.pull(self.pulls["mouth_left"]),
        }  # fmt: skip

    def _pulled(self) -> dict[str, FloatArray]:
        """Shapes of the left half that only pull."""
        corner = mouth_corner(self.build)
        kept = {
            "browDown": "brow_down",
            "browOuterUp": "brow_outer_up",
            "mouthSmile": "smile",
            "mouthFrown": "frown",
            "mouthStretch": "stretch",
        }
        return {name: self.pull(self.pulls[muscle]) for name, muscle in kept.items()} | {
            "mouthDimple": self.pull([(corner, (0.34, 0.12, -0.75), 0.75)]),
            "cheekSquint": self.pull([*self.pulls["cheek_raise"], *self._below_eye(0.35)]),
        }

    def whole(self) -> dict[str, FloatArray]:
        """Shapes of the whole face."""
        (cheek_x, cheek_y), mouth_y = self.build.cheek, self.build.mouth.centre[1]
        low_cheek = (cheek_x - 0.6, (cheek_y + mouth_y) / 2 - 0.8)
        return {
            "browInnerUp": self._both(self.pull(self.pulls["brow_inner_up"])),
            "cheekPuff": self._both(self.pull([(low_cheek, (0.95, 0.0, 0.62), 1.05)])),
            "jawForward": self.jaw_weight()[:, None] * [0.0, 0.0, 0.75],
            "jawOpen": self.jaw_open(),
            "mouthClose": self.mouth_close(),
            "mouthFunnel": self.funnel(),
            "mouthPucker": self.pucker(),
            "mouthRollLower": self.lower[:, None] * self.roll(),
            "mouthRollUpper": (1 - self.lower)[:, None] * self.roll(),
            "mouthShrugLower": self.shrug_lower(),
            "mouthShrugUpper": self._upper_lip((0.0, 0.24, 0.42)),
            "tongueOut": self.tongue_out(),
        }

    def look(self, way: str) -> FloatArray:
        """The left eyeball turned, on its ellipsoid, and the lids that go along."""
        eye, ball = self.build.eye, self.head.pieces["eyeball"]
        (yaw, pitch), shape = GAZE[way], self.lids(*GAZE_LIDS[way])
        x, y, z = ((self.rest[ball] - eye.centre) / eye.ball).T
        y, z = (np.cos(pitch) * y + np.sin(pitch) * z, np.cos(pitch) * z - np.sin(pitch) * y)
        x, z = (np.cos(yaw) * x + np.sin(yaw) * z, np.cos(yaw) * z - np.sin(yaw) * x)
        shape[ball] = np.column_stack([x, y, z]) * eye.ball + eye.centre - self.rest[ball]
        return shape

    def lids(self, upper: float, lower: float) -> FloatArray:
        """Move each lid by its part of the opening, in front of the eyeball all the way.

        Where the parts add up to 1 the lids meet.
        """
        loops, shape = self.head.lids, np.zeros_like(self.rest)
        edge = self.rest[loops[LID_EDGE]]
        opposite = (-np.arange(len(edge))) % len(edge)  # the vertex above or below
        above = np.sin(2 * np.pi * np.arange(len(edge)) / len(edge)) > 0
        gap = np.where(above, upper, lower)[:, None] * (edge[opposite] - edge)
        for row, follow in ((LID_EDGE, 1.0), (2, 0.62), (3, 0.12)):
            shape[loops[row]] = self._before_eyeball(self.rest[loops[row]], follow * gap)
        if np.isclose(upper + lower, 1):
            depth = (edge + shape[loops[LID_EDGE]])[:, 2]
            shape[loops[LID_EDGE], 2] += np.maximum(depth, depth[opposite]) - depth
        shape[loops[0]] = shape[loops[LID_EDGE]]
        return shape

    def _before_eyeball(self, rest: FloatArray, way: FloatArray) -> FloatArray:
        """The way (n, 3) of points, further forward where the straight one would cut the ball."""
        eye = self.build.eye

        def room(points: FloatArray) -> FloatArray:
            x, y, _ = np.moveaxis((points - eye.centre) / eye.ball, -1, 0)
            front = eye.ball[2] * np.sqrt(np.maximum(1 - x**2 - y**2, 0)) + eye.centre[2]
            return np.asarray(points[..., 2] - front)

        least = np.minimum(room(rest), _CLEARANCE)
        lacking = (least - room(rest + _STEPS[..., None] * way)) / _STEPS
        moving = np.abs(way).max(axis=1) > 0
        return way + np.outer(moving * np.maximum(lacking.max(axis=0), 0), [0.0, 0.0, 1.0])

    def mouth_close(self) -> FloatArray:
        """What brings the lips of a jaw that is open together, most of it by the lower lip."""
        mouth, lips, jaw = self.build.mouth, self.head.lips, self.jaw_open()
        half = lips.shape[1] // 2
        upper, lower = lips[LIP_EDGE, : half + 1], lips[LIP_EDGE, half:][::-1]
        meet = 0.7 * jaw[upper] + 0.3 * jaw[lower]
        meet[:, 2] = 0.0  # an upper lip that went back would meet the teeth
        aside = np.abs(self.rest[:, 0])
        target = np.column_stack([np.interp(aside, self.rest[upper, 0], part) for part in meet.T])
        target[:, 0] *= np.sign(self.rest[:, 0])
        across, high = self.rest[:, 0] / mouth.width, self.rest[:, 1] - mouth.centre[1]
        away = np.hypot(across / 1.05, high / 1.1)
        weight = self.soft * np.exp(-((np.maximum(away - 1, 0) / 0.75) ** 2))
        for row in lips[: LIP_BORDER + 1]:
            weight[row] = weight[self.head.mirror[row]] = 1.0
        return np.asarray(weight[:, None] * (target - jaw))

    def roll(self) -> FloatArray:
        """The red of both lips over the teeth."""
        return np.asarray(self.lips_press() * [0.0, 1.25, 1.4])

    def shrug_lower(self) -> FloatArray:
        """Chin and lower lip up, which lifts the upper lip."""
        x, y = self.build.chin
        chin = self.pull([((x, y + 0.9), (0.0, 0.5, 0.25), 0.85)])
        lip = self.lower[:, None] * self._on_lips((0.0, 0.42, 0.5), 0.9)
        return self.lower[:, None] * chin + lip + self._upper_lip((0.0, 0.34, 0.28))

    def tongue_out(self) -> FloatArray:
        """The tongue over the lower lip; the teeth let it through."""
        tongue = self.head.pieces["tongue"]
        z = self.rest[tongue, 2]
        along = (z - z.min()) / np.ptp(z)
        out = np.column_stack([0 * z, -0.05 - 0.8 * along**3, 1.0 + 2.1 * along])
        shape = 0.24 * self.jaw_open() + 0.5 * self.lower_lip_down() + 0.2 * self.upper_lip_up()
        for side in (tongue, self.head.mirror[tongue]):
            shape[side] = 0.24 * self.jaw_open()[side] + out
        return shape

    def _upper_lip(self, way: tuple[float, float, float]) -> FloatArray:
        return np.asarray((1 - self.lower)[:, None] * self._on_lips(way, 0.9))

    def _below_eye(self, lift: float) -> list[Pull]:
        x, y, _ = self.build.eye.centre
        return [((x, y - 1.45), (0.0, lift, 0.12), 0.8)]

    def _both(self, shape: FloatArray) -> FloatArray:
        return shape + self.mirrored(shape)

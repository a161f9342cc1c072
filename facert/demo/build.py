"""The proportions of the two heads: everything that makes one face differ from the other.

Right-handed, in cm: x towards the face's own left, y up, z forward. Only the left half is given.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

Point = tuple[float, float, float]
Colour = tuple[float, float, float]


@dataclass(frozen=True)
class Blob:
    """An ellipsoid of clay, added to the head with a soft seam of width `blend`.

    `dig` true takes the clay away instead.
    """

    centre: Point
    radii: Point
    blend: float
    dig: bool = False


@dataclass(frozen=True)
class Eye:
    """The left eye: an eyeball, and the almond that the lids leave open in front of it."""

    centre: Point
    ball: Point  # radii of the eyeball
    width: float  # half the distance of the corners
    upper: float  # height of the opening above its centre
    lower: float
    tilt: float  # rise of the outer corner per cm
    iris: float  # angle in radians, seen from the ball's centre
    pupil: float


@dataclass(frozen=True)
class Mouth:
    """The mouth, closed."""

    centre: tuple[float, float]
    width: float  # half the distance of the corners
    upper: float  # height of the upper lip
    lower: float
    fullness: float  # how far the lips stand out
    curve: float  # rise of the corners


@dataclass(frozen=True)
class Brow:
    """The left eyebrow in front view: inner end, highest point, outer end, and its thickness."""

    inner: tuple[float, float]
    arch: tuple[float, float]
    outer: tuple[float, float]
    thickness: float


@dataclass(frozen=True)
class Ear:
    """The left ear: a leaf that stands out from `root`, `reach` long and wide, drawn to a tip."""

    root: Point
    reach: tuple[float, float]
    lean: float  # radians, outwards from upright
    point: float  # 0 round, 1 pointed


@dataclass(frozen=True)
class Hair:
    """A cap around `crown` (a direction) as far as `angle` radians, locks of height `thickness`."""

    crown: Point
    angle: float
    thickness: float
    parting: float  # how much the hairline rises above the temples
    crest: float  # 0 a cap, towards 1 a narrow crest


@dataclass(frozen=True)
class Palette:
    """Colours, RGB from 0 to 1."""

    skin: Colour
    blush: Colour
    lips: Colour
    iris: Colour
    hair: Colour


@dataclass(frozen=True)
class Build:
    """One head: its clay, its features, and the resolution of its mesh."""

    blobs: tuple[Blob, ...]
    eye: Eye
    mouth: Mouth
    brow: Brow
    ear: Ear
    hair: Hair
    palette: Palette
    nose: tuple[float, float]  # the wing in front view
    cheek: tuple[float, float]
    chin: tuple[float, float]
    hinge: tuple[float, float]  # y and z of the jaw's axis
    jaw_angle: float  # radians, wide open
    motion: float  # size of the expressions, 1 for a human face
    spacing: float  # distance of vertices at the nose, in radians
    lid_points: int
    lip_points: int


ACTOR = Build(
    blobs=(
        Blob((0.0, 3.4, -2.3), (7.5, 8.2, 9.0), 0.5),  # cranium
        Blob((0.0, -2.0, 0.4), (6.2, 7.0, 6.2), 2.0),  # face
        Blob((0.0, -6.9, 3.0), (2.5, 2.2, 3.3), 2.6),  # jaw
        Blob((0.0, -7.9, 5.2), (1.3, 0.9, 1.0), 1.4),  # chin
        Blob((3.5, -4.9, 0.6), (1.9, 2.6, 3.2), 2.0),  # corner of the jaw
        Blob((4.1, -1.6, 3.3), (1.8, 1.6, 2.1), 1.6),  # cheekbone
        Blob((0.0, -5.1, 4.6), (2.7, 2.2, 2.3), 1.3),  # around the mouth
        Blob((2.5, 2.6, 5.1), (2.6, 0.8, 1.4), 1.1),  # brow ridge
        Blob((3.15, 0.75, 7.0), (1.6, 0.9, 1.0), 1.0, dig=True),  # socket
        Blob((0.0, 0.2, 6.3), (0.75, 2.6, 1.1), 0.9),  # bridge of the nose
        Blob((0.0, -1.6, 7.2), (0.75, 1.5, 1.2), 0.7),
        Blob((0.0, -2.45, 7.75), (0.95, 0.85, 1.0), 0.7),  # tip
        Blob((1.0, -2.75, 7.1), (0.62, 0.6, 0.8), 0.45),  # wing
        Blob((3.15, 0.75, 4.75), (1.58, 1.5, 1.48), 0.35),  # lids over the eyeball
        Blob((0.0, -9.5, -2.2), (4.5, 5.6, 4.3), 1.2),  # neck
    ),
    eye=Eye((3.15, 0.75, 4.75), (1.42, 1.36, 1.36), 1.5, 0.68, 0.5, 0.07, 0.52, 0.23),
    mouth=Mouth((0.0, -5.25), 2.4, 0.55, 0.72, 0.32, 0.11),
    brow=Brow((1.3, 2.35), (3.7, 3.05), (5.2, 2.2), 0.36),
    ear=Ear((6.9, 0.2, -1.2), (1.9, 3.3), 0.35, 0.0),
    hair=Hair((0.0, 0.8, -0.6), 1.42, 0.75, 0.25, 0.0),
    palette=Palette(
        skin=(0.87, 0.67, 0.55),
        blush=(0.86, 0.52, 0.45),
        lips=(0.74, 0.38, 0.36),
        iris=(0.27, 0.42, 0.50),
        hair=(0.22, 0.14, 0.10),
    ),
    nose=(1.1, -2.8),
    cheek=(4.0, -1.7),
    chin=(0.0, -8.2),
    hinge=(-1.0, -1.0),
    jaw_angle=0.30,
    motion=1.0,
    spacing=0.048,
    lid_points=20,
    lip_points=10,
)

ARKIT = replace(
    ACTOR,
    blobs=(*ACTOR.blobs[:-1], Blob((0.0, -8.6, -2.2), (4.5, 4.4, 4.3), 1.2)),  # a shorter neck
    palette=Palette(
        skin=(0.80, 0.62, 0.50),
        blush=(0.80, 0.49, 0.42),
        lips=(0.70, 0.37, 0.35),
        iris=(0.36, 0.24, 0.14),
        hair=(0.13, 0.12, 0.13),
    ),
    spacing=0.037,
    lid_points=28,
    lip_points=14,
)
"""The stand-in for a person whose face a phone tracked."""

CHARACTER = Build(
    blobs=(
        Blob((0.0, 3.4, -1.5), (8.2, 6.6, 7.6), 0.5),  # cranium
        Blob((0.0, -1.6, 0.3), (7.6, 5.4, 6.4), 2.0),  # face
        Blob((0.0, -5.0, 2.2), (4.8, 2.2, 3.6), 2.0),  # jaw
        Blob((0.0, -6.3, 4.9), (1.5, 0.9, 1.0), 1.2),  # chin
        Blob((5.0, -3.4, 0.8), (2.3, 2.3, 3.2), 2.0),  # corner of the jaw
        Blob((5.0, -1.7, 3.4), (2.0, 1.6, 2.1), 1.6),  # cheek
        Blob((0.0, -3.7, 4.4), (3.8, 1.9, 2.3), 1.5),  # around the mouth
        Blob((3.2, 4.3, 4.3), (2.8, 0.8, 1.5), 1.2),  # brow ridge
        Blob((3.5, 1.7, 7.0), (2.1, 1.6, 1.0), 1.0, dig=True),  # socket
        Blob((0.0, 0.4, 5.9), (0.8, 1.6, 0.9), 1.0),  # bridge of the nose
        Blob((0.0, -0.9, 6.9), (1.0, 0.75, 1.1), 0.7),  # tip
        Blob((1.0, -1.05, 6.5), (0.55, 0.5, 0.7), 0.4),  # wing
        Blob((3.45, 1.7, 3.95), (2.3, 2.25, 2.2), 0.4),  # lids over the eyeball
        Blob((0.0, -7.2, -1.5), (3.6, 4.6, 3.6), 1.2),  # neck
    ),
    eye=Eye((3.45, 1.7, 3.95), (2.06, 2.0, 1.9), 2.0, 1.35, 0.95, 0.12, 0.6, 0.26),
    mouth=Mouth((0.0, -3.8), 3.3, 0.42, 0.62, 0.3, 0.13),
    brow=Brow((1.4, 4.1), (4.4, 5.1), (6.1, 4.1), 0.5),
    ear=Ear((7.2, 1.4, -0.4), (1.9, 4.3), 1.0, 1.0),
    hair=Hair((0.0, 1.0, 0.0), 1.0, 2.4, 0.0, 0.78),
    palette=Palette(
        skin=(0.55, 0.72, 0.42),
        blush=(0.78, 0.52, 0.36),
        lips=(0.50, 0.36, 0.30),
        iris=(0.85, 0.55, 0.12),
        hair=(0.30, 0.12, 0.10),
    ),
    nose=(1.05, -1.1),
    cheek=(5.0, -1.9),
    chin=(0.0, -6.4),
    hinge=(-0.5, -1.0),
    jaw_angle=0.30,
    motion=1.25,
    spacing=0.056,
    lid_points=24,
    lip_points=9,
)

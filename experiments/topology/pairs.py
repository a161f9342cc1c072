"""Fifty source and target performances of 100 frames each, from real recordings.

The source is an actor's feature points: an identity of ICT-FaceKit under recorded weights, or real
optical markers. The target is the same performance of another character, whose true feature
points are compared. Five kinds of target, ten of each:

=============  ===========================================================================
``gains``      another identity whose controls are stronger or weaker, w times 0.4 to 1.6
``eased``      another identity whose controls answer late or early, w to the power of 0.5 to 2
``arkit``      MakeHuman's face in its ARKit shapes: another mesh, other shapes
``units``      MakeHuman's face in its own units, solved for the performance within bounds
``optical``    an identity whose bounded weights explain real optical markers: skin and noise
=============  ===========================================================================
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from experiments.topology.characters import IDENTITIES, affine_map, ict, ict_landmarks, makehuman
from experiments.topology.recordings import (
    OPTICAL,
    RECORDINGS,
    SEGMENT,
    expressive_frames,
    segments,
    weights_of,
)
from experiments.tracks import DATA, read_track
from facert.data.arrays import FloatArray, IntArray

EACH = 10
RAMPS = 50
# Markers that sit on one of the usual 68 landmarks.
ANCHORS = {
    "NoseTop": 27, "NoseHead": 30, "Reye_Outside": 36, "Reye_Inside": 39, "Leye_Inside": 42,
    "Leye_Outside": 45, "Mouth_Rend": 48, "Mouth_Lend": 54, "Mouth_Up": 51, "Mouth_Down": 57,
    "Reyebrow_Outside": 17, "Reyebrow_M": 19, "Reyebrow_Inside": 21, "Leyebrow_Inside": 22,
    "Leyebrow_M": 24, "Leyebrow_Outside": 26, "Chin": 8,
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class Pair:
    """Two performances of the same feature points, (100, M, 3) each, in centimetres."""

    kind: str
    source: FloatArray
    target: FloatArray


def make_pairs(seed: int = 0) -> list[Pair]:
    """All fifty, ten of each kind."""
    rng = np.random.default_rng(seed)
    pairs = []
    for kind, make in KINDS.items():
        recordings = OPTICAL if kind == "optical" else RECORDINGS
        target = "solved" if kind == "optical" else "arkit"
        for recording in recordings:
            count = len(range(recordings.index(recording), EACH, len(recordings)))
            parts = segments(recording, target, count, rng)
            pairs += [Pair(kind, *make(recording, part, rng)) for part in parts]
    return pairs


def make_ramps(seed: int = 0) -> list[Pair]:
    """Fifty smooth rises to a recorded expression and back, a third of the frames still.

    The target is another identity whose controls answer late or early.
    """
    rng = np.random.default_rng(seed)
    pairs = []
    for number in range(RAMPS):
        recording = RECORDINGS[number % len(RECORDINGS)]
        expression, names = expressive_frames(recording, "arkit", 1, rng)
        power = 2.0 ** rng.uniform(-1, 1, len(names))
        weights = np.clip(expression, 0, None) * _rise()[:, None]
        source, target = _actor(weights, names, rng), _actor(weights**power, names, rng)
        pairs.append(Pair("ramps", source, target))
    return pairs


def _rise() -> FloatArray:
    """From 0 to 1 and back, still at the beginning, in the middle and at the end, (100,)."""
    frames, level = np.arange(SEGMENT), (0.0, 0.0, 1.0, 1.0, 0.0, 0.0)
    linear = np.interp(frames, (0, 11, 45, 55, 88, 99), level)
    return np.asarray(linear**2 * (3.0 - 2.0 * linear))


Points = tuple[FloatArray, FloatArray]
"""Source and target (T, M, 3)."""


def _gains(recording: str, part: slice, rng: np.random.Generator) -> Points:
    weights, names = weights_of(recording, "arkit", part)
    gains = rng.uniform(0.4, 1.6, len(names))
    return _actor(weights, names, rng), _actor(gains * weights, names, rng)


def _eased(recording: str, part: slice, rng: np.random.Generator) -> Points:
    weights, names = weights_of(recording, "arkit", part)
    power = 2.0 ** rng.uniform(-1, 1, len(names))
    return _actor(weights, names, rng), _actor(np.clip(weights, 0, None) ** power, names, rng)


def _arkit(recording: str, part: slice, rng: np.random.Generator) -> Points:
    weights, names = weights_of(recording, "arkit", part)
    return _actor(weights, names, rng), _on_makehuman("arkit", weights, names)


def _units(recording: str, part: slice, rng: np.random.Generator) -> Points:
    actor = _actor(*weights_of(recording, "arkit", part), rng)
    return actor, _on_makehuman("unit", *weights_of(recording, "units", part))


def _optical(recording: str, part: slice, rng: np.random.Generator) -> Points:
    take = read_track(recording, "solved")
    weights, names = weights_of(recording, "solved", part)
    character = ict(rng.normal(size=IDENTITIES))
    settings = character.settings(weights, names)
    return take.source.values[part], character.move(settings, _marked(recording))


KINDS: dict[str, Callable[[str, slice, np.random.Generator], Points]] = {
    "gains": _gains,
    "eased": _eased,
    "arkit": _arkit,
    "units": _units,
    "optical": _optical,
}


def _actor(weights: FloatArray, names: tuple[str, ...], rng: np.random.Generator) -> FloatArray:
    """The feature points of a random identity."""
    character = ict(rng.normal(size=IDENTITIES))
    return character.move(character.settings(weights, names), character.points)


def _on_makehuman(shapes: str, weights: FloatArray, names: tuple[str, ...]) -> FloatArray:
    character = makehuman(shapes)
    return character.move(character.settings(weights, names), character.points)


def _marked(recording: str) -> IntArray:
    """The vertex below each optical marker, (41,)."""
    with np.load(DATA / "tracks" / f"{recording}.npz") as arrays:
        neutral, names = arrays["neutral_markers"], list(arrays["marker_names"])
    face = ict(np.zeros(IDENTITIES)).mesh.vertices
    landmarks = ict_landmarks()[list(ANCHORS.values())]
    here = neutral[[names.index(name) for name in ANCHORS]]
    laid = affine_map(here, landmarks)(neutral)
    return np.asarray(cKDTree(face).query(laid)[1])

"""The actor's performance: speech, feelings and blinks as overlapping gestures.

A gesture moves a few activations smoothly away from rest and back. Everything is a sum of
gestures, so neighbouring sounds blend into each other as they do in speech (coarticulation).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from facert.data.arrays import FloatArray
from facert.demo.expressions import ACTIVATIONS

Pose = Mapping[str, float]
SIDED = ("brow_outer_up", "brow_down", "blink", "smile", "frown")

VOWELS: dict[str, Pose] = {
    "a": {"jaw_open": 0.75, "lower_lip_down": 0.2},
    "e": {"jaw_open": 0.4, "stretch": 0.35, "upper_lip_up": 0.1},
    "i": {"jaw_open": 0.2, "stretch": 0.65, "lower_lip_down": 0.3},
    "o": {"jaw_open": 0.45, "funnel": 0.7},
    "u": {"jaw_open": 0.15, "pucker": 0.85},
}
CONSONANTS: dict[str, Pose] = {
    "m": {"lips_press": 0.85, "jaw_open": -0.35, "funnel": -0.3},
    "f": {"lips_press": 0.3, "upper_lip_up": 0.35, "jaw_open": -0.15},
    "t": {"lower_lip_down": 0.3, "stretch": 0.2, "jaw_open": -0.1},
    "sh": {"funnel": 0.55, "pucker": 0.2, "jaw_open": -0.1},
    "r": {"pucker": 0.45, "jaw_open": 0.05},
    "k": {"jaw_open": 0.15, "upper_lip_up": 0.15},
}
FEELINGS: dict[str, Pose] = {
    "calm": {},
    "joy": {"smile": 0.9, "cheek_raise": 0.7, "squint": 0.4, "brow_outer_up": 0.2},
    "anger": {"brow_down": 0.95, "nose_wrinkle": 0.4, "lips_press": 0.35, "squint": 0.45},
    "surprise": {"brow_inner_up": 0.8, "brow_outer_up": 0.9, "eye_wide": 0.85, "jaw_open": 0.35},
    "sadness": {"brow_inner_up": 0.9, "frown": 0.75, "squint": 0.25, "pucker": 0.1},
    "disgust": {"nose_wrinkle": 0.9, "upper_lip_up": 0.6, "brow_down": 0.4, "frown": 0.35},
    "doubt": {"brow_outer_up": 0.6, "mouth_left": 0.6, "lips_press": 0.3, "jaw_left": 0.3},
    "smirk": {"smile": 0.55, "mouth_right": 0.5, "squint": 0.3, "jaw_right": 0.25},
}


@dataclass(frozen=True, eq=False)
class Gestures:
    """Smooth moves: up within `rise` seconds, held for `hold` at full strength, and back, (G,)."""

    middle: FloatArray
    rise: FloatArray
    hold: FloatArray
    targets: FloatArray
    """`ACTIVATIONS` at full strength, (G, 26)."""

    def at(self, time: FloatArray) -> FloatArray:
        """Sum of all gestures (T, 26) at times (T,)."""
        away = np.abs(time[:, None] - self.middle) - self.hold / 2
        part = np.clip(1 - away / self.rise, 0, 1)
        return np.asarray((part * part * (3 - 2 * part)) @ self.targets)


def perform(seconds: float, fps: float, seed: int) -> FloatArray:
    """A performance: activations (T, 26) within [0, 1]; the same seed gives the same."""
    rng = np.random.default_rng(seed)
    time = np.arange(round(seconds * fps)) / fps
    tracks = (_feelings(seconds, rng), _speech(seconds, rng), _blinks(seconds, rng))
    activations = sum(track.at(time) for track in tracks) + _restlessness(time, rng)
    return np.asarray(np.clip(activations, 0, 1))


def pose(parts: Pose, left: float = 1.0, right: float = 1.0) -> FloatArray:
    """Activations (26,) of a named pose; `left` and `right` scale what has two sides."""
    values = dict(parts)
    for name in SIDED:
        if name in values:
            strength = values.pop(name)
            values |= {f"{name}_L": left * strength, f"{name}_R": right * strength}
    return np.array([values.get(name, 0.0) for name in ACTIVATIONS])


def _feelings(seconds: float, rng: np.random.Generator) -> Gestures:
    """Gestures of feelings one after the other, in shuffled rounds, stronger on one side."""
    length = 3.2
    count = int(np.ceil(seconds / length))
    rounds = [rng.permutation(list(FEELINGS)) for _ in range(count // len(FEELINGS) + 1)]
    names = np.concatenate(rounds)[:count]
    strength = rng.uniform(0.55, 1.1, count)
    lean = rng.uniform(-0.3, 0.3, count)
    targets = [
        amount * pose(FEELINGS[name], 1 + tilt, 1 - tilt)
        for name, amount, tilt in zip(names, strength, lean, strict=True)
    ]
    middle = length * (np.arange(count) + 0.5) + rng.uniform(-0.3, 0.3, count)
    return Gestures(
        middle, rng.uniform(0.5, 1.0, count), rng.uniform(1.2, 2.2, count), np.array(targets)
    )


def _speech(seconds: float, rng: np.random.Generator) -> Gestures:
    """Phrases of syllables, four to five a second, with pauses for breath."""
    onsets = []
    start = rng.uniform(0.3, 1.0)
    while start < seconds:
        syllables = rng.integers(5, 14)
        onsets.append(start + np.cumsum(rng.uniform(0.18, 0.28, syllables)))
        start = onsets[-1][-1] + rng.uniform(0.5, 1.6)
    onset = np.concatenate(onsets)
    vowels = [pose(VOWELS[name]) for name in rng.choice(list(VOWELS), len(onset))]
    consonants = [pose(CONSONANTS[name]) for name in rng.choice(list(CONSONANTS), len(onset))]
    loudness = rng.uniform(0.55, 1.1, (len(onset), 1))
    middle = np.concatenate([onset + 0.10, onset])
    return Gestures(
        middle,
        np.repeat([0.15, 0.11], len(onset)),
        np.repeat([0.05, 0.02], len(onset)),
        np.vstack([loudness * vowels, np.array(consonants)]),
    )


def _blinks(seconds: float, rng: np.random.Generator) -> Gestures:
    """A blink every few seconds, a quarter of a second long, one side a little weaker."""
    middle = np.cumsum(rng.uniform(1.4, 4.5, int(seconds / 1.4) + 1))
    middle = middle[middle < seconds]
    sides = rng.uniform(0.88, 1.0, (len(middle), 2))
    targets = [pose({"blink": 1.05}, left, right) for left, right in sides]
    return Gestures(
        middle,
        np.full(len(middle), 0.12),
        rng.uniform(0.02, 0.08, len(middle)),
        np.reshape(targets, (-1, len(ACTIVATIONS))),
    )


def _restlessness(time: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Small motion of a resting face: slow waves of a few hundredths, (T, 26)."""
    shape = (6, len(ACTIVATIONS))
    rate, phase = rng.uniform(0.1, 0.7, shape), rng.uniform(0, 2 * np.pi, shape)
    waves = np.sin(2 * np.pi * rate * time[:, None, None] + phase)
    return np.asarray(0.02 * waves.sum(axis=1))

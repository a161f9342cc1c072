"""Frames of real performances: single ones with expression, and segments in motion."""

from __future__ import annotations

import numpy as np

from experiments.tracks import read_track
from facert import Take
from facert.data.arrays import FloatArray

RECORDINGS = ("rom", "utterance_a", "utterance_b")
OPTICAL = ("optical_cheeks", "optical_eyebrows")
SEGMENT = 100  # frames
RATE = 30.0  # frames a second of a segment
_APART = 20  # frames between the beginnings of segments


def expressive_frames(
    recording: str, target: str, count: int, rng: np.random.Generator
) -> tuple[FloatArray, tuple[str, ...]]:
    """Random frames of the more expressive half of a recording, (n, P), and the controls."""
    take, params = _posed(recording, target)
    strength = np.linalg.norm(params, axis=1)
    frames = np.flatnonzero(strength >= np.median(strength))
    return params[rng.choice(frames, count, replace=False)], _names(take)


def segments(recording: str, target: str, count: int, rng: np.random.Generator) -> list[slice]:
    """Random segments of 100 frames at 30 a second without gaps, of the livelier half."""
    _, params = _posed(recording, target)
    whole = _whole_segments(recording, target)
    motion = np.array([params[part].std(axis=0).sum() for part in whole])
    lively = np.flatnonzero(motion >= np.median(motion))
    return [whole[index] for index in rng.choice(lively, count, replace=False)]


def liveliest(recordings: tuple[str, ...], control: str) -> tuple[str, slice]:
    """The recording and the segment in which a control moves most."""
    moves = {
        (recording, part.start): (float(params[part, names.index(control)].std()), part)
        for recording in recordings
        for params, names in [weights_of(recording, "arkit", slice(None))]
        for part in _whole_segments(recording, "arkit")
    }
    recording, start = max(moves, key=lambda place: moves[place][0])
    return recording, moves[recording, start][1]


def _whole_segments(recording: str, target: str) -> list[slice]:
    """Every segment of a recording that has no gap."""
    take, _ = _posed(recording, target)
    stride = round(take.fps / RATE)
    starts = range(0, len(take) - SEGMENT * stride, _APART)
    parts = [slice(start, start + SEGMENT * stride, stride) for start in starts]
    return [part for part in parts if np.diff(take.time[part]).max() < 2.5 / RATE]


def weights_of(recording: str, target: str, part: slice) -> tuple[FloatArray, tuple[str, ...]]:
    """The true parameters (T, P) of a segment, and their names."""
    take, params = _posed(recording, target)
    return params[part], _names(take)


def _posed(recording: str, target: str) -> tuple[Take, FloatArray]:
    take = read_track(recording, target)
    assert take.params is not None
    return take, take.params


def _names(take: Take) -> tuple[str, ...]:
    assert take.controls is not None
    return take.controls.names

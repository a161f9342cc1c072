"""Words and levels of the reasons of a verdict."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from facert.data.arrays import BoolArray, FloatArray
from facert.data.text import plural, printable
from facert.data.verdict import Level, where

NAMED = 3
"""Markers or controls that a line names."""


def level_of(share: float, look: float, bad: float) -> Level:
    """The level of a share of the frames, or another amount, by the least of two levels."""
    return "bad" if share >= bad else "look at it" if share >= look else "good"


def found_in(mask: BoolArray, time: FloatArray) -> str:
    """Frames of a mask (T,) as a share of all, and which."""
    frames = np.flatnonzero(mask)
    if len(frames) == len(mask):
        return "in all frames"
    share = f"{mask.mean():.0%}" if mask.mean() >= 0.01 else "less than 1%"
    return f"in {share} of the frames: {where(frames, time)}"


def most(amounts: FloatArray, names: Sequence[str], alike: float = 0.25) -> str:
    """The few names with the largest amounts (n,), those that come near to the largest one."""
    first = np.argsort(-amounts, kind="stable")
    chosen = [int(i) for i in first if amounts[i] > 0 and amounts[i] >= alike * amounts[first[0]]]
    shown = ", ".join(printable(names[index]) for index in chosen[:NAMED])
    more = len(chosen) - NAMED
    return f"{shown} and {plural(more, 'other')}" if more > 0 else shown

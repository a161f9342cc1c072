"""Reasons of a verdict: what is the matter with some frames, how bad that is, and what helps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from facert.data.arrays import BoolArray, FloatArray, IntArray, frozen
from facert.data.text import plural, printable

Level = Literal["good", "look at it", "bad"]
LEVELS: tuple[Level, ...] = get_args(Level)

NEAR = 0.5
"""Seconds: runs of frames that are not farther apart are shown as one."""
SHOWN = 3
"""Runs of frames that a line shows, the longest ones."""
NAMED = 3
"""Markers or controls that a line names."""


@dataclass(frozen=True, eq=False)
class Reason:
    """A reason of a verdict.

    Parameters
    ----------
    kind : str
        What it is about, in a word or two: "head motion", "new expressions"...
    level : {"good", "look at it", "bad"}
        How bad that is; "good" is a note that leaves a take good.
    text : str
        What was found, and how much of it.
    cure : str
        What to do about it; TAKE and MODEL stand for the names of the files.
    frames : array of int, shape (n,)
        Where it is, rising; empty for what concerns the take as a whole.
    """

    kind: str
    level: Level
    text: str
    cure: str
    frames: IntArray

    def __post_init__(self) -> None:
        frozen(self.frames)

    def cure_for(self, take: str, model: str) -> str:
        """The cure with the names of the files."""
        words = {"TAKE": take, "MODEL": model}
        return " ".join(words.get(word, word) for word in self.cure.split(" "))


def level_of(share: float, look: float, bad: float) -> Level:
    """The level of a share of the frames, or another amount, by the least of two levels."""
    return "bad" if share >= bad else "look at it" if share >= look else "good"


def runs_of(frames: IntArray, time: FloatArray) -> list[tuple[int, int]]:
    """First and last frame of each run of frames (n,); those near in time, (T,), are one."""
    if not len(frames):
        return []
    cuts = np.flatnonzero((np.diff(frames) > 1) & (np.diff(time[frames]) > NEAR)) + 1
    return [(int(run[0]), int(run[-1])) for run in np.split(frames, cuts)]


def where(frames: IntArray, time: FloatArray) -> str:
    """Frames in words, the longest runs, as options count them.

    >>> where(np.array([3, 4, 5]), np.arange(10) / 10.0)
    'frames 3-5 (0.3 s)'
    """
    runs = runs_of(frames, time)
    longest = sorted(runs, key=lambda run: run[0] - run[1])[:SHOWN]
    texts = [f"{_run(*run)} ({time[run[0]]:.1f} s)" for run in sorted(longest)]
    noun = "frame" if len(runs) == 1 and runs[0][0] == runs[0][1] else "frames"
    more = f" and {len(runs) - SHOWN} more" if len(runs) > SHOWN else ""
    return f"{noun} {', '.join(texts)}{more}"


def _run(first: int, last: int) -> str:
    return f"{first}" if first == last else f"{first}-{last}"


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

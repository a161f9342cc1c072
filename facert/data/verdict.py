"""The verdict on a retargeted take: what is the matter with which frames, and what helps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from facert.data.arrays import FloatArray, IntArray, frozen
from facert.data.text import for_shell

Level = Literal["good", "look at it", "bad"]
LEVELS: tuple[Level, ...] = get_args(Level)

NEAR = 0.5
"""Seconds: runs of frames that are not farther apart are shown as one."""
SHOWN = 3
"""Runs of frames that a line shows, the longest ones."""
APART = 1.0
"""Seconds between two of the worst frames."""


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
        """The cure with the names of the files, as a shell takes them."""
        words = {"TAKE": for_shell(take), "MODEL": for_shell(model)}
        return " ".join(words.get(word, word) for word in self.cure.split(" "))


@dataclass(frozen=True, eq=False)
class Verdict:
    """What to think of a retargeted take.

    Parameters
    ----------
    reasons : tuple of Reason
        The worst first.
    anomaly : array, shape (T,)
        How anomalous each frame is, to find the worst ones: beside other frames only.
    time : array, shape (T,)
        Seconds of the frames.
    """

    reasons: tuple[Reason, ...]
    anomaly: FloatArray
    time: FloatArray

    def __post_init__(self) -> None:
        frozen(self.anomaly)

    @property
    def level(self) -> Level:
        """The worst level of the reasons; "good" without any."""
        return max((reason.level for reason in self.reasons), key=LEVELS.index, default="good")

    def worst(self, count: int) -> IntArray:
        """The frames to look at first, at most so many, apart in time; in order of time."""
        chosen: list[int] = []
        for frame in np.argsort(-self.anomaly, kind="stable"):
            if len(chosen) == count or self.anomaly[frame] <= 0.0:
                break
            if all(abs(self.time[frame] - self.time[other]) >= APART for other in chosen):
                chosen.append(int(frame))
        return np.array(sorted(chosen), dtype=np.int64)


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

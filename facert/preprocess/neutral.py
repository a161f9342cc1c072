"""The actor at rest: the same expression in the recording that was learned from and in another.

Markers are stuck on anew, a tracker is calibrated anew; the difference at rest is taken out before
frames are mapped. Weights are bounded: where they rest below a half, their rest is moved and what
is above it stretched, so that a closed lid stays a closed lid.
"""

from __future__ import annotations

import logging
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from facert.data.arrays import FloatArray, IntArray
from facert.data.names import nearest
from facert.data.ranges import parse_frames
from facert.data.take import SourceKind
from facert.data.takes import Takes
from facert.data.text import plural
from facert.errors import InputError

log = logging.getLogger(__name__)

_FRAMES = re.compile(r"[\d.,: ]+")
_OF_FILE = re.compile(r"(.+?):([\d.,: ]+)")
RESTLESS = 0.3
"""Motion of this share of the take's is no rest."""
FULL = 1.0
"""A weight that is fully there."""


@dataclass(frozen=True, eq=False)
class Calibration:
    """A map of frames to the training recording, by the actor at rest in both."""

    # (d,): The actor at rest, where a weight's motion begins; infinite where it is only moved
    turn: FloatArray
    shift: FloatArray  # (d,): How far the rest is moved
    stretch: FloatArray  # (d,): By how much what is above `turn` is stretched, less 1

    @classmethod
    def of(cls, own: FloatArray, learned: FloatArray, kind: SourceKind) -> Calibration:
        """The calibration by the actor at rest in this and in that recording.

        Parameters
        ----------
        own, learned : array, shape (d,)
            NaN: not known, nothing is changed.
        kind : {"markers", "weights"}
        """
        shift = np.nan_to_num(learned - own)
        if kind == "markers":
            return cls(np.full_like(shift, np.inf), shift, np.zeros_like(shift))
        own = np.where(np.isnan(own) | np.isnan(learned), 0.0, own)
        # Angles of eyes and head may be anywhere at rest; they are moved, and nothing more.
        bounded = (own >= 0.0) & (np.maximum(own, own + shift) < FULL / 2.0)
        room = FULL - np.where(bounded, own, 0.0)
        return cls(np.where(bounded, own, np.inf), shift, np.where(bounded, -shift / room, 0.0))

    def apply(self, X: FloatArray) -> FloatArray:
        """Frames (T, d) or one of them, (d,); NaN stays."""
        return np.asarray(X + self.shift + np.maximum(X - self.turn, 0.0) * self.stretch)


def at_rest(X: FloatArray, frames: IntArray) -> FloatArray:
    """Mean of the frames named as neutral, (d,); NaN where none of them shows anything.

    Raises
    ------
    InputError
        When the frames are not all there.
    """
    if not len(frames) or frames.min() < 0 or frames.max() >= len(X):
        found = "none" if not len(frames) else f"{frames.min()} to {frames.max()}"
        raise InputError(
            "neutral", f"frames from 0 to {len(X) - 1}", found, "Name frames of this take."
        )
    motion, typical = X[frames].std(axis=0), np.nanstd(X, axis=0).max()
    if np.nanmax(motion, initial=0.0) > RESTLESS * typical:
        log.warning("the actor moves in the frames named as neutral: their mean is taken for rest")
    seen = ~np.isnan(X[frames])
    total = np.where(seen, X[frames], 0.0).sum(axis=0)
    return np.where(seen.any(axis=0), total / np.maximum(seen.sum(axis=0), 1), np.nan)


def rest_frames(text: str | None, takes: Takes) -> list[IntArray | None]:
    """The frames of each take in which the actor rests; None for a take that names none.

    Parameters
    ----------
    text : str or None
        Frames as "12" or "0..20"; of several takes "0..20; 3" in their order, or with their files
        as "a.h5:0..20; b.h5:3".
    takes : Takes

    Raises
    ------
    InputError
        For what is no such text, an unknown file, or the rest of a take without that of the first.
    """
    found: list[IntArray | None] = [None] * len(takes.parts)
    for place, part in enumerate((text or "").split(";") if text is not None else ()):
        name, frames = _split(part.strip())
        which = _named(name, takes) if name else place
        if which >= len(found):
            expected = plural(len(found), "take")
            raise InputError("neutral", f"frames of {expected}", repr(text), "Leave some out.")
        if found[which] is not None:
            expected = f"frames of {takes.names[which] or 'the take'} once"
            raise InputError("neutral", expected, repr(text), "Leave some out.")
        found[which] = np.array(parse_frames(frames, "neutral"), dtype=np.int64)
    if found[0] is None and any(frames is not None for frames in found):
        expected, fix = f"frames of {takes.names[0]} as well", "Others are calibrated to the first."
        raise InputError("neutral", expected, repr(text), fix)
    return found


def _split(text: str) -> tuple[str, str]:
    """The file and the frames of FILE:FRAMES; frames alone have none, though they may have a step.

    >>> _split("a.h5:0..20:2"), _split("0..20:2")
    (('a.h5', '0..20:2'), ('', '0..20:2'))
    """
    found = None if _FRAMES.fullmatch(text) else _OF_FILE.fullmatch(text)
    return ("", text) if found is None else (found[1], found[2])


def _named(name: str, takes: Takes) -> int:
    """The take of a file, by its whole name or the end of its path."""
    whole = [place for place, one in enumerate(takes.names) if one == name]
    ends = [place for place, one in enumerate(takes.names) if Path(one).name == Path(name).name]
    found = whole or ends
    if len(found) != 1:
        near = nearest(name, takes.names)
        fix = f"Did you mean {near!r}?" if near else "Write FILE:FRAMES, as in a.h5:0..20."
        raise InputError("neutral", f"one of {', '.join(takes.names)}", repr(name), fix)
    return found[0]


def median_at_rest(X: FloatArray, scale: float) -> FloatArray:
    """The median of frames in which the actor rests but may blink, (d,); NaN where none shows it.

    Parameters
    ----------
    X : array, shape (T, d)
        NaN: not observed.
    scale : float
        Standard deviation of a source in motion, in its units.
    """
    shown = ~np.isnan(X).all(axis=0)
    rest = np.full(X.shape[1], np.nan)
    rest[shown] = np.nanmedian(X[:, shown], axis=0)
    if np.nanmax(np.nanstd(X[:, shown], axis=0), initial=0.0) > RESTLESS * scale:
        log.warning("the actor moves when at rest: the median is taken for it")
    return rest


def most_neutral(poses: FloatArray) -> int:
    """The index of the pose, of (n, P), that is nearest to all controls at zero."""
    reach = np.maximum(np.abs(poses).max(axis=0), np.finfo(float).tiny)
    return int(np.square(poses / reach).sum(axis=1).argmin())

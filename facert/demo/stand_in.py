"""The stand-in: the demo's face shows what a phone tracked of somebody whose rig nobody has."""

from __future__ import annotations

import logging

import numpy as np

from facert.data.arrays import FloatArray
from facert.data.names import ARKIT_ANGLES, ARKIT_SHAPES, NameIndex, canonical
from facert.data.take import Take
from facert.demo.files import arkit_face
from facert.render.faces import Face, driven_face

log = logging.getLogger("facert")

WITHIN = 2.5
"""Shares reach so far at most, but for slips."""
_LEAST = 5  # names of ARKit
_OTHER_LIDS = {"eyeSquint": 1, "eyeWide": 1, "eyeLookUp": 3, "eyeLookDown": 3}
"""Shapes that move the lids as well, and how late they leave them to `eyeBlink`."""


def is_tracked(take: Take) -> bool:
    """Whether a take holds weights most of which bear names of ARKit, in any spelling.

    Angles of the head and of the eyes do not count.
    """
    if take.source.kind != "weights":
        return False
    names = [name for name in take.source.names if canonical(name) not in ARKIT_ANGLES]
    index = NameIndex.among(ARKIT_SHAPES, names, "/source/names", quiet=True)
    found = sum(index.find_whole(name) is not None for name in names)
    return found >= max(_LEAST, len(names) / 2)


def stand_in_face(take: Take) -> Face:
    """The face of ARKit's shapes in the weights of a take; blank where none was observed.

    A shape of which the take has the left and the right half gets their mean; other columns, such
    as the angles of the head, are left out.
    """
    return driven_face(take, arkit_face(), stand_in_weights(take))


def stand_in_weights(take: Take) -> FloatArray:
    """Weights (T, 52) of `ARKIT_SHAPES` from those of a take.

    NaN where nothing was observed of a frame; else what is hidden counts as 0. Lids that are closed
    are closed no further by other shapes, which would turn them inside out. Weights in percent are
    shown as shares, with a warning.
    """
    values, names = take.source.values, take.source.names
    index = NameIndex.among(names, ARKIT_SHAPES, "/source/names", halves=True, quiet=True)
    weights = np.zeros((len(values), len(ARKIT_SHAPES)))
    for place, shape in enumerate(ARKIT_SHAPES):
        columns = index.find_halves(shape)
        if columns:
            weights[:, place] = np.nan_to_num(values[:, columns]).mean(axis=1)
    weights /= _whole(weights)
    for side in ("Left", "Right"):
        blink = np.clip(weights[:, _place(f"eyeBlink{side}")], 0, 1)
        for shape, late in _OTHER_LIDS.items():
            weights[:, _place(f"{shape}{side}")] *= 1 - blink**late
        weights[:, _place(f"eyeBlink{side}")] = blink
    weights[np.isnan(values).all(axis=1)] = np.nan
    return weights


def _whole(weights: FloatArray) -> float:
    """What stands for 1 in weights (T, D): 100 where they are in percent, as most frames show."""
    largest = float(np.quantile(weights.max(axis=1), 0.9))
    if largest <= WITHIN:
        return 1.0
    log.warning("the weights go up to %.3g: taken for percent in the actor's face", largest)
    return 100.0


def _place(shape: str) -> int:
    return ARKIT_SHAPES.index(shape)

"""Cleaning a take: noise out, gaps filled, with how sure that is."""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from facert.data.arrays import BoolArray
from facert.data.names import NameIndex
from facert.data.take import Take
from facert.preprocess.motion.estimate import estimate

if TYPE_CHECKING:
    from facert.retarget.options import RetargetOptions
    from facert.retarget.retargeter import Retargeter

log = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class Cleaned:
    """A take with a cleaned source."""

    take: Take
    filled: BoolArray  # (T, M) or (T, D): What had not been observed and is now known
    # Standard deviation of the capture noise that was removed, in the take's units
    sigma: float | None = None


def clean(take: Take, sigma: float | None = None) -> Cleaned:
    """Fill gaps and remove noise by the take's own motion, `facert.preprocess.motion.estimate`.

    Parameters
    ----------
    take : Take
    sigma : float, optional
        Standard deviation of the capture noise, in the take's units; from the take by default.

    Returns
    -------
    Cleaned
        A marker or weight that was never observed stays NaN, with a warning.

    Raises
    ------
    InputError
        When nothing in the take moves.
    """
    source = take.source
    found = estimate(source.matrix, take.time, sigma)
    ever = np.asarray(source.valid.any(axis=0)).tolist()
    lost = [n for n, seen in zip(source.names, ever, strict=True) if not seen]
    if lost:
        log.warning("never observed, left open: %s", ", ".join(lost))
    cleaned = source.with_matrix(found.frames, found.std)
    return Cleaned(
        replace(take, source=cleaned), np.asarray(cleaned.valid & ~source.valid), found.sigma
    )


def clean_with_model(
    take: Take, retargeter: Retargeter, options: RetargetOptions | None = None
) -> Cleaned:
    """Fill gaps and remove noise by a trained model, which knows the actor from its training take.

    The result holds the model's markers or weights.

    Raises
    ------
    InputError
        When the source does not suit the model.
    """
    if not retargeter.method.stepwise:
        name = retargeter.settings.method
        log.warning("%s cleans by the take alone; shared models clean by what they learned", name)
    found = retargeter.retarget(take, options=options).source
    index = NameIndex.among(take.source.names, found.names, "/source/names", quiet=True)
    places = [index.find(name) for name in found.names]
    shown = np.zeros(found.valid.shape, dtype=np.bool_)
    there = [column for column, place in enumerate(places) if place is not None]
    shown[:, there] = take.source.valid[:, [place for place in places if place is not None]]
    return Cleaned(replace(take, source=found), np.asarray(found.valid & ~shown))

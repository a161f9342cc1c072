"""Cleaning of a take for mapping: a clean source in the units of a model, for `retarget`."""

from __future__ import annotations

import logging
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from facert.data.arrays import BoolArray, FloatArray
from facert.data.normalisation import Normalisation
from facert.data.take import Source, Take
from facert.data.text import plural
from facert.errors import InputError
from facert.preprocess.faults import Reach, without_faults
from facert.preprocess.faults.quantiles import quantile
from facert.preprocess.motion.estimate import estimate_if_it_moves
from facert.preprocess.neutral import Calibration, at_rest
from facert.preprocess.source_layout import SourceLayout

log = logging.getLogger(__name__)

FAR, ABSURD = 5.0, 1e6
"""Distances from the training take's mean, in normalised units, of which the log warns, and at
which nothing can be computed."""
UNLIKE = (20.0, 500.0)
"""Weights so many times as large as usual in training, or as small, are percent instead of
fractions, or the reverse: 100 times by a factor of five."""
WITHIN = 2.5
"""Most fractions are smaller than this."""


@dataclass(frozen=True)
class SourceOptions:
    """Options of cleaning a source before it is mapped.

    Parameters
    ----------
    detect : bool
        Take bad values as not observed: markers that are frozen, swapped, at zero, elsewhere or
        absurd, single spikes, absurd weights, and frames of weights without a face.
    smooth : bool
        Take noise out, and fill gaps, by the motion over neighbouring frames.
    sigma : float, optional
        Standard deviation of the capture noise, in the take's units; by default estimated from the
        take; a live stream begins with that of the training take and estimates its own.
    neutral : sequence of int, optional
        Frames in which the actor rests; see `facert.preprocess.neutral`.
    """

    detect: bool = True
    smooth: bool = True
    sigma: float | None = None
    neutral: Sequence[int] | None = None

    def __post_init__(self) -> None:
        if self.sigma is not None and not 0.0 <= self.sigma < math.inf:
            raise InputError("sigma", "a number from 0", repr(self.sigma), "Change it.")


@dataclass(frozen=True, eq=False)
class CleanSource:
    """A source with the markers or weights of a model, in their order."""

    source: Source  # Without bad markers, in the take's units
    # The actor at rest in the shape of a frame, where frames were named for it
    rest: FloatArray | None
    # (T, d_x): Calibrated frames in normalised units, NaN: not observed, and the same without
    # noise and gaps; the measured ones where nothing was smoothed
    measured: FloatArray
    clean: FloatArray
    std: FloatArray | None = None  # Standard deviation of the clean frames, in the take's units
    # Variance of the clean frames where they were not observed, in normalised units; 0 elsewhere
    input_variance: FloatArray | None = None

    @property
    def filled(self) -> FloatArray:
        """The measured frames with their gaps filled and their noise kept, (T, d_x)."""
        return np.where(np.isnan(self.measured), self.clean, self.measured)


def clean_source(
    take: Take,
    layout: SourceLayout,
    units: Normalisation,
    neutral: FloatArray,
    options: SourceOptions,
) -> CleanSource:
    """Hide bad markers of a take, calibrate and normalise its source, and smooth it over time.

    Parameters
    ----------
    take : Take
    layout : SourceLayout
        Layout of the model's source.
    units : Normalisation
        Normalisation of the model's source.
    neutral : array, shape (d_x,)
        The actor at rest in the take that it was trained on.
    options : SourceOptions

    Raises
    ------
    InputError
        When the source is of another kind, lacks names that the model needs, or lies so far off
        that nothing can be computed.
    """
    observed = (without_faults(take) if options.detect else take).source
    layout.require_kind(observed.kind)
    columns = layout.columns(observed.names)
    source, rest = columns.arrange(observed), None
    X = source.matrix
    if options.neutral is not None:
        frames = np.asarray(options.neutral, dtype=np.int64)
        own = at_rest(observed.matrix, frames)
        rest = own.reshape(observed.values.shape[1:])
        X = Calibration.of(columns.pick(own), neutral, layout.kind).apply(X)
    measured, given = units.apply(X), X
    far = Reach.of(units, layout.kind).beyond(measured) if options.detect else None
    if far is not None:
        X, measured = np.where(far, np.nan, X), np.where(far, np.nan, measured)
        source = source.with_matrix(np.where(far, np.nan, source.matrix))
    _check_distance(measured)
    unit = other_unit(given, units.mean) if layout.kind == "weights" else ""
    if unit:
        log.warning("the source's weights are about %s", unit)
    else:
        _warn_of_distance(measured, far, layout)
    found = estimate_if_it_moves(X, take.time, options.sigma) if options.smooth else None
    if found is None:
        return CleanSource(source, rest, measured, measured)
    log.info("%s", found.summary(take.units))
    input_variance = np.where(np.isnan(X), found.std / units.scale, 0.0) ** 2
    clean = units.apply(found.frames)
    return CleanSource(source, rest, measured, clean, found.std, input_variance)


def other_unit(weights: FloatArray, trained: FloatArray) -> str:
    """How weights (T, d_x) differ by their unit from their means in training (d_x,); or nothing."""
    sizes = np.abs(weights)
    known = (trained != 0.0) & ~np.isnan(sizes).all(axis=0)
    if not known.any():
        return ""
    usual, trained = np.nanmean(sizes[:, known], axis=0), np.abs(trained[known])
    ratio, highest = float(np.median(usual / trained)), quantile(sizes[:, known].T, 0.98)
    largest, expected = float(np.median(highest)), float(np.median(trained))
    if UNLIKE[0] < ratio < UNLIKE[1] and largest > WITHIN:
        return "100 times as large as in training: percent instead of fractions? Divide them by 100"
    if UNLIKE[0] * ratio < 1.0 < UNLIKE[1] * ratio and largest < 1.0 < expected:
        return "a hundredth of those in training: fractions, not percent? Multiply them by 100"
    return ""


def _warn_of_distance(measured: FloatArray, far: BoolArray | None, layout: SourceLayout) -> None:
    """Warn of a source (T, d_x) that lies far off, and of values in it that are hidden for that."""
    if far is not None:
        _warn_of_far(far, layout)
    if float(np.nanmedian(np.abs(measured))) > FAR:
        log.warning("the source lies far from the training take: check units and head motion")


def _warn_of_far(far: BoolArray, layout: SourceLayout) -> None:
    """Warn of values (T, d_x) that are hidden, as nothing in training was so far away."""
    columns = np.flatnonzero(far.any(axis=0))[:: layout.width] // layout.width
    names = [layout.names[column] for column in columns]
    frames = np.flatnonzero(far.any(axis=1))
    log.warning(
        "far beyond all that the training take showed, taken as not observed: %s, in %s from %d on",
        ", ".join(names),
        plural(len(frames), "frame"),
        frames[0],
    )


def _check_distance(frames: FloatArray) -> None:
    """Check that frames in normalised units are not absurdly far from zero.

    Raises
    ------
    InputError
        When they are so far that nothing can be computed.
    """
    distance = float(np.nanmax(np.abs(frames)))
    if distance > ABSURD:
        raise InputError(
            "/source",
            "positions near those of the training take",
            f"{distance:.1e} times its largest deviation away",
            "Check units and origin.",
        )

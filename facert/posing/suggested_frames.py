"""Frames that are worth posing.

A method knows the poses near those that it was shown. So the frames to pose are those that all
frames of the take are near to: the k-medoids of their features (`facert.posing.medoids`). Some
frames may be posed already; then the others are placed where these are far. Features are principal
coordinates, at least half-whitened, so that a lid counts beside a jaw (`facert.models.whitening`).

Among frames that serve nearly as well, those that show most are preferred, as the rest of a frame
is a guess; among frames that serve alike, those in which the face moves least. (To give up a little
of the coverage for calmer frames costs accuracy: these gather around the rest pose.)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.distance import cdist

from facert.data.arrays import BoolArray, FloatArray, IntArray
from facert.data.normalisation import Normalisation
from facert.data.take import SourceKind, Take
from facert.errors import InputError
from facert.models.gaussian import fill_gaps
from facert.models.whitening import whitening
from facert.posing.medoids import LEAST_GAIN, Choice
from facert.preprocess.training_set import MIN_OBSERVED
from facert.retarget.retargeter import Retargeter

# Of the whitening: markers move by what the skin does, weights have all the same range by nature.
POWERS: dict[SourceKind, float] = {"markers": 0.75, "weights": 0.5}
APART = 0.2  # seconds between two suggested frames, where the take is long enough
SLACK = 0.002  # by which the sum of distances may rise for a frame that shows more
MOST_FRAMES = 1500  # that are looked at; in longer takes neighbours in time are much the same


@dataclass(frozen=True, eq=False)
class Suggestion:
    """Frames to pose.

    Parameters
    ----------
    frames : array of int, shape (n,)
        Frame numbers, the most useful first.
    shares : array, shape (n,)
        Share of the take's frames that are nearest to each, posed frames counted as well.
    """

    frames: IntArray
    shares: FloatArray


def suggest_frames(
    take: Take, count: int, have: Sequence[int] | IntArray | Retargeter = (), seed: int = 0
) -> Suggestion:
    """The frames of a take that are most worth posing.

    Poses are not looked at: the suggestion can come before the first one.

    Parameters
    ----------
    take : Take
    count : int
    have : sequence of int, or Retargeter
        Frames that are posed already, e.g. ``take.labels``. Or a model: then the take's labels
        are, and what the model learned from, and frames count as much as the model is uncertain
        of them.
    seed : int
        Which frames of a take with more than `MOST_FRAMES` are looked at.

    Raises
    ------
    InputError
        When the take has too few frames that show at least half of the source, or the model does
        not fit it or tells no standard deviation.
    """
    model = have if isinstance(have, Retargeter) else None
    posed = _checked_frames(take.labels if isinstance(have, Retargeter) else have, len(take))
    usable = take.source.valid.mean(axis=1) >= MIN_OBSERVED
    seen = _at_most(np.setdiff1d(np.flatnonzero(usable), posed), seed)
    if not 1 <= count <= len(seen):
        raise InputError(
            "count",
            "1 up to the number of frames without a pose that show half of the source",
            f"{count} of {len(seen)}",
            "Ask for fewer, or give a longer take.",
        )
    if model is None:
        choice = _choice(take, seen, posed[usable[posed]], count)
    else:
        take = replace(take, source=model.layout.arrange(take.source))
        choice = _choice(take, seen, posed[usable[posed]], count, model.labelled)
        choice = choice.weighted(_uncertainty(model, take)[seen])
    chosen = choice.ranked(_preferred(choice, choice.medoids(count), take, seen))
    return Suggestion(seen[chosen], _shares(choice, chosen))


def _choice(
    take: Take, seen: IntArray, posed: IntArray, count: int, learned: FloatArray | None = None
) -> Choice:
    """How far the frames that can be suggested are from each other, and from posed ones.

    The latter may be frames of another take, `learned` (l, d).
    """
    features = _features(take, np.concatenate([seen, posed]), learned)
    others, known = features[: len(seen)], features[len(seen) :]
    distances, covered = cdist(others, others), np.full(len(seen), np.inf)
    apart = min(APART, 0.25 * float(take.time[-1] - take.time[0]) / (count + len(posed)))
    if len(known):
        covered = cdist(others, known).min(axis=1)
        barred = _near(take.time[posed], take.time[seen], apart).any(axis=0)
        distances[:, barred] = max(distances.max(), covered.max())  # as good as no pose at all
    rivals = _near(take.time[seen], take.time[seen], apart) | np.eye(len(seen), dtype=np.bool_)
    return Choice(distances, covered, rivals)


def _uncertainty(model: Retargeter, take: Take) -> FloatArray:
    """Standard deviation of the model's poses, root mean square over controls, (T,); above 0."""
    std = model.retarget(take).std
    if std is None:
        raise InputError(
            "have",
            "a model that tells how certain it is",
            model.settings.method,
            "Train another method (auto does), or go on from the labels.",
        )
    spread = np.sqrt(np.mean(std**2, axis=1))
    return np.asarray(np.maximum(spread, np.finfo(np.float64).tiny))


def _checked_frames(frames: Sequence[int] | IntArray, length: int) -> IntArray:
    found = np.unique(np.asarray(frames))
    if not found.size:
        return np.empty(0, dtype=np.int64)
    if found.dtype.kind not in "iu" or not 0 <= found[0] <= found[-1] < length:
        raise InputError(
            "have",
            f"frames from 0 to {length - 1}",
            f"{found[0]} to {found[-1]}",
            "Give the numbers of the frames that are posed, e.g. take.labels.",
        )
    return found.astype(np.int64)


def _at_most(frames: IntArray, seed: int) -> IntArray:
    chosen = np.random.default_rng(seed).permutation(frames)[:MOST_FRAMES]
    return np.sort(chosen)


def _features(take: Take, frames: IntArray, learned: FloatArray | None) -> FloatArray:
    """Whitened principal coordinates of some frames and of `learned` ones after them, (n, d)."""
    matrix = take.source.matrix[frames]
    if learned is not None:
        matrix = np.vstack([matrix, learned])
    matrix = matrix[:, ~np.isnan(matrix).all(axis=0)]
    normalised = Normalisation.of(matrix, f"/source/{take.source.kind}").apply(matrix)
    filled = fill_gaps(normalised)
    features: FloatArray = (filled - filled.mean(axis=0)) @ whitening(
        filled, POWERS[take.source.kind]
    )
    return features


def _near(time: FloatArray, other: FloatArray, apart: float) -> BoolArray:
    """Which frames are less than so many seconds apart, (n, m)."""
    return np.asarray(np.abs(time[:, None] - other) < apart)


def _preferred(choice: Choice, chosen: IntArray, take: Take, seen: IntArray) -> IntArray:
    """Each exchanged for one that shows more, or moves less, if that serves as well."""
    hidden, speeds = (~take.source.valid).sum(axis=1)[seen], _speeds(take)[seen]
    chosen = chosen.copy()
    for slot in range(len(chosen)):
        costs = choice.exchange_costs(chosen)[slot]
        good = costs <= (1.0 + SLACK) * choice.cost(chosen)
        if good.any():
            costs[~good | (hidden > hidden[good].min())] = np.inf
            alike = costs <= (1.0 + LEAST_GAIN) * costs.min()
            chosen[slot] = np.where(alike, speeds, np.inf).argmin()
    return chosen


def _speeds(take: Take) -> FloatArray:
    """Of each frame, (T,): mean over what is seen both in the frame before and in that after."""
    matrix, frames = take.source.matrix, np.arange(len(take))
    before, after = np.maximum(frames - 1, 0), np.minimum(frames + 1, len(take) - 1)
    moved = np.abs(matrix[after] - matrix[before])
    there = ~np.isnan(moved)
    mean = np.where(there, moved, 0.0).sum(axis=1) / np.maximum(there.sum(axis=1), 1)
    seconds = np.maximum(take.time[after] - take.time[before], np.finfo(np.float64).tiny)
    return np.asarray(mean / seconds)


def _shares(choice: Choice, chosen: IntArray) -> FloatArray:
    near = np.column_stack([choice.distances[:, chosen], choice.covered])
    counts = np.bincount(near.argmin(axis=1), minlength=len(chosen) + 1)
    return np.asarray(counts[:-1] / len(near))

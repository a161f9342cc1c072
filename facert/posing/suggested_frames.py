"""Frames that are worth posing.

A method knows the poses near those that it was shown. So the frames to pose are those that all
frames of the take are near to: the k-medoids of their features (`facert.posing.medoids`). Some
frames may be posed already; then the others are placed where these are far. Features are principal
coordinates, at least half-whitened, so that a lid counts beside a jaw (`facert.models.whitening`).

Among frames that serve nearly as well, those that show most are preferred, as the rest of a frame
is imputed; among frames that serve alike, those in which the face moves least. (To give up a little
of the coverage for calmer frames costs accuracy: these gather around the rest pose.)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.spatial.distance import cdist

from facert.data.arrays import BoolArray, FloatArray, IntArray
from facert.data.labelling import without_predicted
from facert.data.matching_takes import as_takes
from facert.data.normalisation import Normalisation
from facert.data.subject import about
from facert.data.take import SourceKind, Take
from facert.data.takes import Takes
from facert.errors import InputError
from facert.models.gaussian import TOGETHER, fill_gaps
from facert.models.whitening import whitening
from facert.posing.medoids import LEAST_GAIN, MedoidProblem
from facert.preprocess.motion.motion_factors import fill_by_factors
from facert.preprocess.training_set import MIN_OBSERVED
from facert.retarget.retargeter import Retargeter
from facert.settings import Settings

# Of the whitening: markers move by what the skin does, weights have all the same range by nature.
POWERS: dict[SourceKind, float] = {"markers": 0.75, "weights": 0.5}
APART = 0.2  # seconds between two suggested frames, where the take is long enough
SLACK = 0.002  # by which the sum of distances may rise for a frame that shows more
MOST_FRAMES = 1500  # candidates; in longer takes neighbours in time are much the same
MANY = 1500  # columns, beyond which a matrix of all by all takes long


@dataclass(frozen=True, eq=False)
class Suggestion:
    """Frames to pose.

    Parameters
    ----------
    frames : array of int, shape (n,)
        Frame numbers, the most useful first.
    shares : array, shape (n,)
        Share of all frames that are nearest to each, posed frames counted as well.
    takes : array of int, shape (n,)
        The take of each, from 0.
    """

    frames: IntArray
    shares: FloatArray
    takes: IntArray


Have = Sequence[int] | Sequence[Sequence[int]] | IntArray | Sequence[IntArray] | Retargeter


def suggest_frames(
    take: Take | Sequence[Take] | Takes, count: int, have: Have = (), seed: int = 0
) -> Suggestion:
    """The frames of a take, or of several, that are most worth posing.

    Poses are not looked at: the suggestion can come before the first one.

    Parameters
    ----------
    take : Take, or sequence of Take
    count : int
    have : sequence of int, or Retargeter
        Frames that are posed already, e.g. ``take.labels``; of several takes a sequence for each.
        Or a model: then the takes' labels are, and what the model learned from, and frames count
        as much as the model is uncertain of them. Poses that a model predicted are no labels.
    seed : int
        Which frames are looked at, where there are more than `MOST_FRAMES`.

    Raises
    ------
    InputError
        When too few frames show at least half of the source, the takes do not fit together, or
        the model does not fit them or predicts no standard deviation.
    """
    takes, model = as_takes(take), have if isinstance(have, Retargeter) else None
    if isinstance(have, Retargeter):
        posed = takes.indices([without_predicted(part).labels for part in takes.parts])
    else:
        posed = _frames_of(takes, have)
    found = _suggested(takes, count, posed, model, seed)
    places, frames = takes.located(found.frames)
    return replace(found, frames=frames, takes=places)


def _frames_of(takes: Takes, have: Sequence[Any] | IntArray) -> IntArray:
    """Posed frames among those of all takes, checked."""
    if len(takes.parts) == 1:
        return _checked_frames(have, len(takes.parts[0]))
    each = list(have) or [()] * len(takes.parts)
    if len(each) != len(takes.parts) or any(np.ndim(frames) != 1 for frames in each):
        expected = f"frames of each of {len(takes.parts)} takes"
        raise InputError("have", expected, f"{len(each)}", "Give a list for each take.")
    pairs = zip(each, takes.parts, strict=True)
    return takes.indices([_checked_frames(frames, len(part)) for frames, part in pairs])


def _suggested(
    takes: Takes, count: int, posed: IntArray, model: Retargeter | None, seed: int
) -> Suggestion:
    """The suggestion by the numbers of frames among those of all takes."""
    take = takes.joined
    usable = take.source.valid.mean(axis=1) >= MIN_OBSERVED
    candidates = np.setdiff1d(np.flatnonzero(usable), posed)
    candidates = np.sort(np.random.default_rng(seed).permutation(candidates)[:MOST_FRAMES])
    if not 1 <= count <= len(candidates):
        raise InputError(
            "count",
            "1 up to the number of frames without a pose that show half of the source",
            f"{count} of {len(candidates)}",
            "Ask for fewer, or give a longer take.",
        )
    if model is not None:
        take = replace(take, source=model.layout.arrange(take.source))
    learned = None if model is None else model.labelled
    problem = _medoid_problem(take, candidates, posed[usable[posed]], count, learned)
    if model is not None:
        problem = problem.weighted(_uncertainty(model, takes)[candidates])
    hidden, speeds = (
        (~take.source.valid).sum(axis=1),
        np.concatenate(list(map(_speeds, takes.parts))),
    )
    chosen = _preferred(problem, problem.medoids(count), hidden[candidates], speeds[candidates])
    chosen = problem.ranked(chosen)
    near = np.column_stack([problem.distances[:, chosen], problem.covered]).argmin(axis=1)
    shares = np.bincount(near, minlength=count + 1)[:count] / len(candidates)
    return Suggestion(candidates[chosen], shares, np.zeros(count, dtype=np.int64))


def _medoid_problem(
    take: Take, candidates: IntArray, posed: IntArray, count: int, learned: FloatArray | None
) -> MedoidProblem:
    """Distances of the candidates from each other, from posed frames and from `learned` (l, d)."""
    features = _features(take, np.concatenate([candidates, posed]), learned)
    others, known = features[: len(candidates)], features[len(candidates) :]
    distances, covered = cdist(others, others), np.full(len(candidates), np.inf)
    apart = min(APART, 0.25 * float(take.time[-1] - take.time[0]) / (count + len(posed)))
    time = take.time[candidates]
    if len(known):
        covered = cdist(others, known).min(axis=1)
        barred = _near(take.time[posed], time, apart).any(axis=0)
        distances[:, barred] = max(distances.max(), covered.max())  # as good as no pose at all
    rivals = _near(time, time, apart) | np.eye(len(time), dtype=np.bool_)
    return MedoidProblem(distances, covered, rivals)


def _uncertainty(model: Retargeter, takes: Takes) -> FloatArray:
    """Standard deviation of the model's poses, root mean square over controls, (T,); above 0."""
    found = []
    for part, name in takes.named:
        with about(name):
            found.append(_spread(model, part))
    return np.concatenate(found)


def _spread(model: Retargeter, take: Take) -> FloatArray:
    std = model.retarget(take).std
    if std is None:
        default, method = Settings().method, model.settings.method
        go_on = "go on from the labels."
        other = f"Train another method ({default} does), or {go_on}"
        raise InputError(
            "have",
            "a model that predicts how certain it is",
            method,
            go_on.capitalize() if method == default else other,
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


def _features(take: Take, frames: IntArray, learned: FloatArray | None) -> FloatArray:
    """Whitened principal coordinates of some frames and of `learned` ones after them, (n, d)."""
    matrix = take.source.matrix[frames]
    if learned is not None:
        matrix = np.vstack([matrix, learned])
    matrix = matrix[:, ~np.isnan(matrix).all(axis=0)]
    normalised = Normalisation.of(matrix, f"/source/{take.source.kind}").apply(matrix)
    many = normalised.shape[1] > TOGETHER
    filled = fill_by_factors(normalised) if many else fill_gaps(normalised)
    if filled.shape[1] > max(MANY, len(filled)):  # they span as many directions as there are rows
        centred = filled - filled.mean(axis=0)
        squares, u = np.linalg.eigh(centred @ centred.T)
        filled = (u * np.sqrt(np.maximum(squares, 0.0)))[:, ::-1]
    axes = whitening(filled, POWERS[take.source.kind])
    return np.asarray((filled - filled.mean(axis=0)) @ axes)


def _near(time: FloatArray, other: FloatArray, apart: float) -> BoolArray:
    """Mask of pairs of frames less than so many seconds apart, (n, m)."""
    return np.asarray(np.abs(time[:, None] - other) < apart)


def _preferred(
    problem: MedoidProblem, chosen: IntArray, hidden: IntArray, speeds: FloatArray
) -> IntArray:
    """The chosen, each exchanged for one that shows more, or moves less, if that serves as well.

    `hidden` (n,) and `speeds` (n,) are of all candidates.
    """
    chosen = chosen.copy()
    for slot in range(len(chosen)):
        costs = problem.exchange_costs(chosen)[slot]
        good = costs <= (1.0 + SLACK) * problem.cost(chosen)
        if good.any():
            costs[~good | (hidden > hidden[good].min())] = np.inf
            alike = costs <= (1.0 + LEAST_GAIN) * costs.min()
            chosen[slot] = np.where(alike, speeds, np.inf).argmin()
    return chosen


def _speeds(take: Take) -> FloatArray:
    """The speed of each frame, (T,): mean over what both the frame before and that after show."""
    matrix, frames = take.source.matrix, np.arange(len(take))
    before, after = np.maximum(frames - 1, 0), np.minimum(frames + 1, len(take) - 1)
    moved = np.abs(matrix[after] - matrix[before])
    there = ~np.isnan(moved)
    mean = np.where(there, moved, 0.0).sum(axis=1) / np.maximum(there.sum(axis=1), 1)
    seconds = np.maximum(take.time[after] - take.time[before], np.finfo(np.float64).tiny)
    return np.asarray(mean / seconds)

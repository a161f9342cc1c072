"""Reasons that lie in what was recorded: the head, another day's markers, new expressions, gaps.

What posed frames do not explain of a frame (`facert.retarget.novelty`) has a cause, and each cause
its cure. So the causes are taken out one after the other: what goes when a frame is aligned rigidly
to the training take was the head; what all frames have in common was placed or measured otherwise;
what is left is new to the model.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from facert.data.arrays import BoolArray, FloatArray
from facert.data.take import Source, Take
from facert.data.verdict import Level, Reason
from facert.preprocess.clean_source import other_unit
from facert.preprocess.faults import Reach, find_faults
from facert.preprocess.head_motion import rigid_motion
from facert.retarget.model import TrainedModel
from facert.retarget.novelty import (
    LEAST_SHARE,
    NEW,
    over_names,
    relative_lengths,
    relevance,
    unexplained,
    usual_variance,
)
from facert.retarget.reasons import found_in, level_of, most

UNLIKE = ("head motion", "far from training", "new expressions", "other unit")
"""Kinds of reasons for which frames are unlike the posed ones."""
EXPLAINED = 0.6
"""A cause is named where less than this share of what was unexplained is left without it."""
ANYWAY = 0.2
"""A rigid motion explains a part of whatever all frames have in common: it has to leave less than
that explains anyway, and this share of the amount."""
HEAD_MARKERS = 5
"""With fewer, an expression may pass for motion of the head."""
MOVED = 0.5
"""Share of how far it went in posed frames, from which on a head counts as moved: an expression
moves it a little."""
TILT = 0.3
"""What all frames have in common counts from this amount on: one frame may reach it by chance."""
SIZES = (0.6, 1.7)
"""A face that is smaller or larger by more is in another unit."""
FEW, MANY = 0.02, 0.2
"""Shares of the frames that are new: to look at, and bad."""
LONG = 0.5
"""The share from which on a moving head is bad."""
NOISY = 0.025
"""Standard deviation of the cleaned source, in normalised units, of a take to be looked at."""
HIDDEN = (0.1, 0.5)
"""Shares of a take's values that were bad: to look at, and bad."""
OFTEN = 0.05
"""A marker is named that was bad in this share of the frames."""
LOST = 0.5
"""A frame is lost that shows less than this share of the source."""
GONE = (0.02, 0.3)
"""Shares of lost frames: to look at, and bad."""


@dataclass(frozen=True, eq=False)
class Unlike:
    """How unlike the posed frames each frame is, and why.

    Amounts are RMS over markers of what posed frames do not explain, relative to the usual motion.
    """

    amounts: FloatArray  # (T,): As the frames are
    left: FloatArray  # (T, n): By marker, without what head and placing explain
    head: BoolArray  # (T,): What made a frame unlike was the head's motion
    placed: BoolArray  # (T,): It was what all frames have in common
    offset: FloatArray  # (n,): What they have in common, by marker
    degrees: FloatArray  # (T,): By which the head is turned

    @property
    def new(self) -> BoolArray:
        """Frames that are unlike by themselves, (T,)."""
        return np.asarray(over_names(self.left) > NEW)

    @property
    def head_warning(self) -> str:
        """A line for the log where the head moves in a part of the frames; empty else."""
        if self.head.mean() < LEAST_SHARE:
            return ""
        degrees, share = self.degrees[self.head].max(), self.head.mean()
        return (
            f"in {share:.0%} of the frames the head moves, by up to {degrees:.0f} degrees against "
            "the training take: facert stabilise takes that out"
        )

    @property
    def placed_warning(self) -> str:
        """A line for the log where all frames differ alike from the training take; empty else."""
        if self.placed.mean() < 1.0 - LEAST_SHARE:
            return ""
        return (
            "the source differs from the training take by the same amount throughout: another day "
            "or actor? --neutral FRAMES names frames at rest"
        )


def unlike(frames: FloatArray, model: TrainedModel) -> Unlike | None:
    """Compare clean, normalised frames (T, d_x) with the posed ones; None for models without."""
    if model.labelled is None or not len(model.labelled):
        return None
    kind = model.layout.kind
    posed = model.source_units.apply(model.labelled)
    lengths = _relevant_lengths(posed, model)
    vectors = unexplained(frames, posed)
    amounts = over_names(lengths(vectors))
    head, degrees = np.zeros(len(frames), dtype=np.bool_), np.zeros(len(frames))
    strange = bool((amounts > NEW).any())  # else the head is none either, and aligning takes time
    if strange and kind == "markers" and len(model.layout.names) >= HEAD_MARKERS:
        still, degrees, moved = _without_head(frames, posed, model)
        without = over_names(lengths(still))
        steady = over_names(lengths(vectors - np.median(vectors, axis=0)))
        better = without < np.minimum(EXPLAINED * amounts, steady + ANYWAY * amounts)
        head = moved & (amounts > NEW) & better
        vectors = np.where(head[:, None], still, vectors)
    left = lengths(vectors)
    common = np.median(vectors, axis=0)
    offset = lengths(common[None])[0]
    apart = lengths(vectors - common)
    most_of_it = over_names(apart) < EXPLAINED * over_names(left)
    placed = (over_names(left) > TILT) & most_of_it & (over_names(offset[None]) > TILT)
    left = np.where(placed[:, None], apart, left)
    return Unlike(amounts, left, head, placed, offset, degrees)


def _relevant_lengths(posed: FloatArray, model: TrainedModel) -> Callable[[FloatArray], FloatArray]:
    """What measures residuals (T, d_x) by marker, or by weight as far as it matters, (T, n)."""
    kind, variance = model.layout.kind, usual_variance(posed, model.motion)
    matter = np.ones(len(model.layout.names))
    if kind == "weights":
        poses = model.method.predict(posed).Y
        matter = np.sqrt(relevance(posed, poses, variance, model.layout.names))
    return lambda residuals: relative_lengths(residuals, variance, kind) * matter


def _without_head(
    frames: FloatArray, posed: FloatArray, model: TrainedModel
) -> tuple[FloatArray, FloatArray, BoolArray]:
    """What is unexplained of frames (T, d_x) that are aligned to the mean face of training.

    Also the degrees by which they were turned, (T,), and which were moved farther than the posed
    ones.
    """
    units = model.source_units
    shape = units.mean.reshape(-1, 3)
    aligned, lengths, degrees = [], [], []
    for some in (frames, posed):
        points = units.undo(some).reshape(len(some), -1, 3)
        motion = rigid_motion(shape, points)
        aligned.append(units.apply(motion.undo(points).reshape(len(some), -1)))
        away = np.linalg.norm(motion.apply(shape) - shape, axis=2)
        lengths.append(np.sqrt(np.mean(away**2, axis=1)))
        degrees.append(motion.degrees)
    moved = lengths[0] > MOVED * lengths[1].max()
    return unexplained(*aligned), degrees[0], np.asarray(moved)


def source_reasons(
    take: Take | None, result: Take, model: TrainedModel, detect: bool
) -> tuple[list[Reason], FloatArray | None]:
    """Reasons in the source, and how unlike the posed ones each frame is, (T,), if that is known.

    Parameters
    ----------
    take : Take or None
        As it was recorded, where it is there.
    result : Take
        With the cleaned source.
    model : TrainedModel
    detect : bool
        Whether bad values of the take were hidden.
    """
    reasons = [] if take is None else list(_of_recording(take, model, detect))
    if result.source.names != model.layout.names or result.source.kind != model.layout.kind:
        return reasons, None  # poses alone, as in a table
    frames = model.source_units.apply(result.source.matrix)
    other = _other_unit(frames, model)
    if other is not None:
        return [other], np.ones(len(frames))
    found = unlike(frames, model)
    if found is None:
        return reasons, None
    reasons += [*_of_unlike(found, result.time, model), *_noise(result, model)]
    return reasons, found.amounts


def _of_unlike(found: Unlike, time: FloatArray, model: TrainedModel) -> Iterator[Reason]:
    """Reasons of frames that are unlike the posed ones."""
    names = model.layout.names
    if found.head.any():
        degrees = found.degrees[found.head].max()
        text = f"the head moves, by up to {degrees:.0f} degrees against the training take"
        level = level_of(float(found.head.mean()), FEW, LONG)
        cure = "facert stabilise TAKE OUT.h5 takes it out; then retarget that"
        yield _reason("head motion", level, found.head, time, text, cure)
    if found.placed.any():
        what = "markers lie" if model.layout.kind == "markers" else "weights are"
        text = f"{what} elsewhere throughout ({most(found.offset, names)})"
        cure = "another day or actor: --neutral FRAMES, in which the face rests"
        much = float(over_names(found.offset[None])[0]) > NEW
        level = level_of(float(found.placed.mean()), FEW, MANY if much else np.inf)
        yield _reason("far from training", level, found.placed, time, text, cure)
    if found.new.any():
        amounts = np.mean(found.left[found.new] ** 2, axis=0)
        text = f"the face does what no posed frame showed (mostly {most(amounts, names)})"
        cure = "facert suggest TAKE --have MODEL names frames to pose; train on both takes"
        level = level_of(float(found.new.mean()), FEW, MANY)
        yield _reason("new expressions", level, found.new, time, text, cure)


def _noise(result: Take, model: TrainedModel) -> Iterator[Reason]:
    """The reason of a source whose noise could not be taken out."""
    if result.source.std is None:
        return
    left = np.nanmedian(result.source.std, axis=0) / model.source_units.scale
    left = np.sqrt(np.mean(left.reshape(len(left), -1) ** 2, axis=1))
    amount = float(np.sqrt(np.nanmean(left**2)))
    if amount > NOISY:
        names = most(np.nan_to_num(left), model.layout.names)
        text = f"noise that is left is {amount:.0%} of the motion (most in {names})"
        cure = "fine motion is lost: a better solve in the tracker helps, more poses do not"
        yield Reason("noise", "look at it", text, cure, np.empty(0, dtype=np.int64))


def _reason(
    kind: str, level: Level, mask: BoolArray, time: FloatArray, text: str, cure: str
) -> Reason:
    """The reason of a mask of frames (T,)."""
    return Reason(kind, level, f"{text} {found_in(mask, time)}", cure, np.flatnonzero(mask))


def _of_recording(take: Take, model: TrainedModel, detect: bool) -> Iterator[Reason]:
    """Reasons in what was observed: bad values, and frames that show too little."""
    source = model.layout.columns(take.source.names, quiet=True).arrange(take.source)
    bad = _bad(take, source, model) if detect else np.zeros(source.valid.shape, dtype=np.bool_)
    noun, shares = source.kind[:-1], bad.mean(axis=0)
    if shares.max() >= OFTEN:
        mask = np.asarray(bad.any(axis=1))
        names = most(shares, source.names)
        text = f"bad values hidden, {bad.mean():.1%} of all (mostly {names}) "
        level = level_of(float(bad.mean()), *HIDDEN)
        cure = f"look at the {noun} in the tracker, or leave it out; facert clean TAKE lists all"
        text += found_in(mask, take.time)
        yield Reason(f"bad {source.kind}", level, text, cure, np.flatnonzero(mask))
    lost = (source.valid & ~bad).mean(axis=1) < LOST
    if lost.any():
        level = level_of(float(lost.mean()), *GONE)
        text = f"less than half of the {source.kind} seen {found_in(lost, take.time)}"
        cure = "what is there is guessed: record it anew, or pose it by hand"
        yield Reason("gaps", level, text, cure, np.flatnonzero(lost))


def _bad(take: Take, source: Source, model: TrainedModel) -> BoolArray:
    """What was hidden of a source in the model's order as bad or far off, (T, n)."""
    posed = take.labels if source.kind == "weights" else None
    faults = find_faults(take.source, posed).hidden_from(take.source)
    kept = model.layout.columns(take.source.names, quiet=True).arrange(faults)
    far = Reach.of(model.source_units, source.kind).beyond(model.source_units.apply(kept.matrix))
    bad = source.valid & ~kept.valid
    if far is not None:
        bad = bad | far.reshape(*bad.shape, -1).any(axis=2)
    return np.asarray(bad)


def _other_unit(frames: FloatArray, model: TrainedModel) -> Reason | None:
    """The reason of a source (T, d_x) in another unit than that of the training."""
    everywhere = np.arange(len(frames))
    given = model.source_units.undo(frames)
    if model.layout.kind == "weights":
        other = other_unit(given, model.source_units.mean)
        if not other:
            return None
        text, _, cure = other.partition("? ")
        return Reason("other unit", "bad", f"the weights are about {text}?", cure, everywhere)
    size = _size(given) / _size(model.source_units.mean[None])
    if SIZES[0] < size < SIZES[1]:
        return None
    text = f"the face is {size:.3g} times as large as in training"
    cure = "state the unit: facert convert TAKE OUT.h5 --in-units mm --units cm"
    return Reason("other unit", "bad", text, cure, everywhere)


def _size(frames: FloatArray) -> float:
    """Size of the face in frames (T, 3 M): RMS distance of the markers from their middle."""
    points = frames.reshape(len(frames), -1, 3)
    away = points - points.mean(axis=1, keepdims=True)
    return float(np.median(np.sqrt(np.mean((away**2).sum(axis=2), axis=1)))) or 1.0

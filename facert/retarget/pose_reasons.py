"""Reasons that lie in the poses that came out: clipped controls, uncertainty, jumps, idle ones."""

from __future__ import annotations

from collections.abc import Iterator
from shlex import quote

import numpy as np

from facert.data.arrays import BoolArray, FloatArray
from facert.data.resampling import PAUSE
from facert.data.take import Take
from facert.data.text import listed, plural, printable
from facert.data.verdict import Reason
from facert.retarget.model import TrainedModel
from facert.retarget.reasons import found_in, level_of, most

CUT = 0.1
"""A control is clipped where its prediction went beyond its bound by this share of its range."""
CLIPPED = (0.15, np.inf)
"""Shares of the frames with a clipped control: to look at, and bad."""
UNSURE, MORE = 0.12, 1.3
"""A frame is unsure whose standard deviation is this share of the controls' ranges, and so many
times as large as in posed frames."""
UNSURE_SHARE = 0.05
"""A take is to be looked at of which this share is unsure."""
POOR = 0.2
"""Error at poses left out, relative to the controls' ranges, of a model to be looked at."""
JUMP = 0.35
"""A pose jumps that leaves its neighbours by this share of the controls' ranges, RMS."""
JUMPS = (3.0, 60.0)
"""Jumps a minute: to look at, and bad."""
SOME = 2**12
"""Posed frames, of very many, that show what deviation is usual."""
RESTING = 0.25
"""An end of a range that is nearer to the usual pose than this share of it is one of rest."""
REACHED = 1e-6
"""A control is at its bound that is so near to it, by its range: files round."""
STILL = 0.01
"""A control that moves by less than this share of its range is at rest."""


def ranges_of(model: TrainedModel) -> FloatArray:
    """How far each control goes in the poses that the model knows, or by its limits, (P,)."""
    declared = model.controls.limits
    known = None if model.poses is None else np.ptp(model.poses, axis=0)
    if known is not None and known.any():
        return np.asarray(known)
    if declared is not None and np.isfinite(declared).all():
        return np.asarray(np.ptp(declared, axis=1))
    return np.full(len(model.controls.names), 4.0 * model.target_units.scale)


def relative_to(ranges: FloatArray, amounts: FloatArray) -> FloatArray:
    """RMS over the controls of amounts (T, P) relative to that of their ranges (P,), (T,)."""
    size = float(np.sqrt(np.mean(ranges**2))) or 1.0
    return np.asarray(np.sqrt(np.mean(amounts**2, axis=1)) / size)


def pose_reasons(
    result: Take, model: TrainedModel, unlike: BoolArray
) -> tuple[list[Reason], FloatArray]:
    """Reasons in the poses of a result, and how unsure each frame is, (T,).

    In frames that are `unlike` the posed ones, (T,), a control is clipped for that reason.
    """
    assert result.params is not None  # retargeted
    ranges = ranges_of(model)
    unsure = np.zeros(len(result)) if result.std is None else relative_to(ranges, result.std)
    unsure = np.nan_to_num(unsure)  # somebody's pose has no deviation
    reasons = [
        *_clipped(result, model, ranges, unlike),
        *_unsure(unsure, usual_std(model, ranges), result.time, unlike),
        *_poor(model, ranges),
        *_jumps(result, ranges),
        *_idle(result, model, ranges),
    ]
    return reasons, unsure


def _clipped(
    result: Take, model: TrainedModel, ranges: FloatArray, unlike: BoolArray
) -> Iterator[Reason]:
    """Controls whose predictions were cut at a bound that is no rest."""
    beyond = beyond_bounds(result, model)
    if beyond is None:
        return
    cut = (beyond > CUT * ranges) & ~unlike[:, None]
    mask = np.asarray(cut.any(axis=1))
    if not mask.any():
        return
    shares = cut.mean(axis=0)
    farthest = np.max(beyond / np.where(ranges > 0.0, ranges, np.inf), axis=0)
    worst = int(shares.argmax())
    names = most(shares, model.controls.names)
    text = f"{names} cut flat, by up to {farthest[worst]:.0%} of the range, "
    frame = int(np.where(cut[:, worst], beyond[:, worst], -1.0).argmax())
    cure = _cure_of_clipped(result, model, frame, worst)
    level = level_of(float(mask.mean()), *CLIPPED)
    text += found_in(mask, result.time)
    yield Reason("clipped controls", level, text, cure, np.flatnonzero(mask))


def _cure_of_clipped(result: Take, model: TrainedModel, frame: int, control: int) -> str:
    """What helps a control that is cut in a frame: by a limit, or where its poses end."""
    assert result.params is not None
    assert model.bounds is not None  # it is cut
    bounds, limits = model.bounds[control], model.controls.limits
    end = int(np.abs(bounds - result.params[frame, control]).argmin())
    slack, name = REACHED * float(np.ptp(bounds)), printable(model.controls.names[control])
    if limits is not None and abs(limits[control, end] - bounds[end]) <= slack:
        low, high = limits[control]
        where = f"{name} reaches its limit {low:g}..{high:g} (the rig's, stated, or guessed)"
        wider = f"facert convert --limits {quote(f'{name}=LO..HI')}"
        return f"{where}: widen it by {wider} and train, or a gain below 1 by --controls"
    pose = f"no pose goes farther: pose frame {frame} of this take, where {name} "
    return f"{pose}goes farthest, or train with --limits none"


def beyond_bounds(result: Take, model: TrainedModel) -> FloatArray | None:
    """How far predictions went beyond the bounds that they were clipped to, (T, P), in their units.

    Ends of a control's range at which it rests do not count: a prediction there is a little below
    as often as above. None where there are no bounds, or the result has not the model's source.
    """
    bounds, params = model.bounds, result.params
    if bounds is None or params is None or result.source.names != model.layout.names:
        return None
    known = bounds if model.poses is None else model.poses.T
    rest = np.median(known, axis=1)[:, None]
    ends = np.where(
        np.abs(bounds - rest) > RESTING * np.ptp(bounds, axis=1)[:, None], bounds, np.nan
    )
    reached = np.abs(params[:, :, None] - ends) <= REACHED * np.ptp(bounds, axis=1)[:, None]
    rows = np.flatnonzero(reached.any(axis=(1, 2)))
    beyond = np.zeros(params.shape)
    if len(rows):
        frames = model.source_units.apply(result.source.matrix[rows])
        free = model.target_units.undo(model.method.unclipped().predict(frames).Y)
        low, high = ends.T
        over = np.fmax(free - high, low - free)  # NaN where there is no end
        beyond[rows] = np.nan_to_num(np.maximum(over, 0.0))
    return beyond


def usual_std(model: TrainedModel, ranges: FloatArray) -> float:
    """Standard deviation in posed frames, relative to the controls' ranges (P,)."""
    if model.labelled is None or not len(model.labelled):
        return 0.0
    some = np.linspace(0, len(model.labelled) - 1, min(len(model.labelled), SOME)).round()
    posed = model.labelled[some.astype(np.int64)]  # each is compared with all
    std = model.method.predict(model.source_units.apply(posed)).std
    if std is None:
        return 0.0
    return float(np.median(relative_to(ranges, std * model.target_units.scale)))


def _unsure(
    unsure: FloatArray, usual: float, time: FloatArray, unlike: BoolArray
) -> Iterator[Reason]:
    """Frames whose standard deviation is large, beyond what is usual and not for being unlike."""
    mask = (unsure > max(UNSURE, MORE * usual)) & ~unlike
    if mask.any():
        level = level_of(float(mask.mean()), UNSURE_SHARE, np.inf)
        text = f"standard deviation {unsure[mask].mean():.0%} of the range, {usual:.0%} is usual, "
        cure = "fill what is hidden there, or pose frames: facert suggest TAKE --have MODEL"
        text += found_in(mask, time)
        yield Reason("unsure", level, text, cure, np.flatnonzero(mask))


def _poor(model: TrainedModel, ranges: FloatArray) -> Iterator[Reason]:
    """The reason of a model that errs much at the very poses that it learned from."""
    error = model.figures.get("cross-validation error")
    size = float(np.sqrt(np.mean(ranges**2)))
    if isinstance(error, float) and error > POOR * size > 0.0:
        text = f"{plural(model.labels, 'pose')} explain little: each is missed by the others by "
        text += f"{error / size:.0%} of the range"
        cure = "facert suggest TAKE --have MODEL names frames to pose"
        yield Reason("few poses", "look at it", text, cure, np.empty(0, dtype=np.int64))


def _jumps(result: Take, ranges: FloatArray) -> Iterator[Reason]:
    """Frames whose pose leaves those before and after."""
    assert result.params is not None
    mask = jumps(result.params, result.time, ranges)
    frames = np.flatnonzero(mask)
    if not len(frames):
        return
    minutes = max((result.time[-1] - result.time[0]) / 60.0, 1.0 / 6.0)
    level = level_of(len(frames) / minutes, *JUMPS)
    text = f"{plural(len(frames), 'jump')}: {found_in(mask, result.time)}"
    cure = "look at the source there: facert clean TAKE, or blank the rows"
    yield Reason("jumps", level, text, cure, frames)


def jumps(params: FloatArray, time: FloatArray, ranges: FloatArray) -> BoolArray:
    """Frames whose pose (T, P) is far off the middle of its neighbours', (T,)."""
    mask = np.zeros(len(params), dtype=np.bool_)
    if len(params) > 2:
        off = params[1:-1] - (params[:-2] + params[2:]) / 2.0
        steps = np.diff(time)
        together = np.maximum(steps[1:], steps[:-1]) < PAUSE * np.median(steps)
        mask[1:-1] = together & (relative_to(ranges, off) > JUMP)
    return mask


def _idle(result: Take, model: TrainedModel, ranges: FloatArray) -> Iterator[Reason]:
    """A note on controls that never move: in no posed frame, or not in this take."""
    assert result.params is not None
    names = np.array(model.controls.names)
    never = names[ranges == 0.0]
    none = np.empty(0, dtype=np.int64)
    if len(never) and len(never) < len(names):
        text = f"no pose moves {listed(never.tolist(), 3)}: at rest throughout"
        yield Reason("idle controls", "good", text, "pose frames that use them", none)
    still = names[(ranges > 0.0) & (np.ptp(result.params, axis=0) <= STILL * ranges)]
    if len(still):
        verb = "moves" if len(still) == 1 else "move"
        text = f"{listed(still.tolist(), 3)} hardly {verb} in this take"
        yield Reason("idle controls", "good", text, "none, if the actor does not either", none)

"""Checks of poses that somebody set, before anything is learned from them.

Poses come from people and exporters: one cell slips, a row or a column is in percent, an angle is
in degrees where shares are expected, an exporter cuts everything off. All these train without an
error. What is found is warned of with control, value and fix; nothing is changed.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass
from shlex import quote

import numpy as np

from facert.data.arrays import LARGEST, BoolArray, FloatArray, require_size
from facert.data.limits import SEVERAL, beyond, known_poses_of
from facert.data.spelling import words
from facert.data.take import Take
from facert.data.text import listed, plural
from facert.errors import InputError
from facert.preprocess.faults.absurd import NATURAL
from facert.preprocess.faults.quantiles import quantile

log = logging.getLogger("facert")

ABSURD, LARGE, OFTEN, NAMED = 3.0, 0.75, 3, 5
"""A value of a label is absurd that is so many times as far as its control goes, by its limits, by
this quantile of all values, and by the controls that have so many values; so many are named."""
SHARE, PERCENT = NATURAL
SHARES, BIG = 2.5, 12.0
"""Controls that are shares go so far at most, and those in percent or degrees at least so far:
between the two there are rigs with controls from 0 to 10."""
MOST = 0.5
"""So much of a rig is shares, or so many of a pose's values are in percent."""
FULL = 1.05
"""A share is so much at most, as in a row of shares beside rows in percent."""
FEW = 0.1
PILED, PILE = 3, 0.25
"""So many poses, and this share of those that move a control, at its very highest value; and half
of them where that is its end anyway."""
TINY = 0.25
"""So far, as a share of what is usual, goes a control whose values are alike by rounding alone."""
GRID = 0.05
"""Values that people set by hand are multiples of this."""
_PERCENT = (
    "in percent, it seems, where the limits are those of fractions, 0 to 1: %(shown)s; divide by "
    "100"
)
_EITHER = (
    "in percent or degrees among fractions, it seems: %(shown)s; divide percent by 100 and degrees "
    "by the largest angle, or, if this is how the rig counts, say so: facert convert --limits "
    "'%(first)s'"
)
_DEGREES = (
    "angles among shares: %(shown)s; the others are learned a little better when all have like "
    "ranges; with facert convert --limits '%(first)s' they pass without a word"
)
_ANGLES = frozenset({
    "angle", "angles", "deg", "degree", "degrees", "euler", "orient", "pitch", "roll", "rot",
    "rotate", "rotation", "yaw", "rx", "ry", "rz", "rotx", "roty", "rotz",
})  # fmt: skip
_LIPS = frozenset({"mouth", "lip", "lips"})


@dataclass(frozen=True, eq=False)
class _Labels:
    """Poses of labelled frames."""

    names: tuple[str, ...]  # (P,)
    frames: list[str]  # (l,): As people are shown them
    values: FloatArray  # (l, P)
    limits: FloatArray | None  # (P, 2)
    animation: FloatArray | None  # (n, P)

    @property
    def sizes(self) -> FloatArray:
        """Absolute values, (l, P)."""
        return np.abs(self.values)


def warn_of_labels(take: Take, name_of: Callable[[int], str] = str) -> None:
    """Log what is odd about the poses of a take: scales, slips, plateaus, controls at rest.

    `name_of` is what people are shown of a frame's number, where the take is several.

    Raises `InputError` for poses in a unit that nothing can be computed in, naming one such number.
    """
    if take.params is None or take.controls is None or not len(take.labels):
        return
    controls, values = take.controls, take.params[take.labels]
    frames = [name_of(frame) for frame in take.labels.tolist()]
    for row, column in np.argwhere(np.abs(values) > LARGEST)[:1].tolist():
        where = f"the pose of frame {frames[row]}, {controls.names[column]}"
        found, fix = f"{values[row, column]:.3g}", "Mend the pose, or check the units."
        raise InputError(where, "a number of a sensible size", found, fix)
    require_size(values, "/target/params")
    if take.animation is not None:
        require_size(take.animation, "/animation/params")
    labels = _Labels(controls.names, frames, values, controls.limits, take.animation)
    rows = _rows_in_percent(labels)
    columns = _large_columns(labels, rows)
    _warn_of_rows(labels, rows)
    _warn_of_columns(labels, columns)
    seen = rows[:, None] | columns
    _warn_of_slips(labels, seen)
    _warn_of_plateaus(labels, columns)
    _name_unmoved(take)


def _large_columns(labels: _Labels, rows: BoolArray) -> BoolArray:
    """Controls in percent or degrees where most are shares, (P,), but for the poses in `rows`.

    Several of their values are no shares, and one at least is large: a face is mostly at rest, and
    a jaw that is hardly open is at 1 percent as well. A single such value may be a slip.
    """
    sizes = np.where(rows[:, None], 0.0, labels.sizes)
    highest, widest = sizes.max(axis=0), _widest(labels.limits)
    moving, fractions = highest > 0.0, (widest > 0.0) & (widest <= SHARES)
    shares = moving & ((highest <= SHARES) | fractions)
    reach = np.where(fractions, SHARES * widest, np.maximum(BIG, widest))
    large = (highest > reach) & ((sizes > SHARES).sum(axis=0) >= SEVERAL)
    if not large.any() or shares.sum() < MOST * moving.sum():
        return np.zeros(len(highest), dtype=np.bool_)
    large |= highest > reach  # where several controls are in percent, one value is no slip
    if large.sum() > MOST * moving.sum():
        large |= fractions & (highest > FULL)
    return np.asarray(large)


def _rows_in_percent(labels: _Labels) -> BoolArray:
    """Poses in percent beside others in shares, (l,).

    Most controls of such poses have shares elsewhere, and hardly a value between the two.
    """
    sizes = labels.sizes
    shares, percent = (sizes > 0.0) & (sizes <= FULL), sizes > 0.04 * PERCENT
    mixed = shares.any(axis=0) & percent.any(axis=0)
    between = (sizes > FULL) & ~percent
    mixed &= between.sum(axis=0) <= FEW * (sizes > 0.0).sum(axis=0)
    none = np.zeros(len(sizes), dtype=np.bool_)
    if mixed.sum() < max(OFTEN, MOST * percent.any(axis=0).sum()):
        return none
    counts = percent[:, mixed].sum(axis=1)
    found = (counts >= OFTEN) & (counts > shares[:, mixed].sum(axis=1))
    found &= (sizes > FULL).sum(axis=1) > MOST * (sizes > 0.0).sum(axis=1)
    others = shares[~found].any(axis=1)
    return np.asarray(found) if others.any() else none


def _warn_of_rows(labels: _Labels, rows: BoolArray) -> None:
    if not rows.any():
        return
    frames = listed([labels.frames[row] for row in np.flatnonzero(rows).tolist()])
    found = np.where(rows[:, None], labels.sizes, -1.0)
    row, control = np.unravel_index(int(found.argmax()), found.shape)
    log.warning(
        "the poses of %s (%s) are in percent, it seems, as %s at %.3g, beside others of 0 to 1: "
        "divide them by 100",
        *(f"{plural(int(rows.sum()), 'frame')}", frames),
        *(labels.names[control], labels.values[row, control]),
    )


def _warn_of_columns(labels: _Labels, columns: BoolArray) -> None:
    """Warn of controls in percent or degrees; those that are angles by their names are named.

    Where the limits say that a control is a share, it is in percent.
    """
    highest = labels.values[labels.sizes.argmax(axis=0), np.arange(len(labels.names))]
    angles = np.array([_is_angle(name) for name in labels.names])
    widest = np.broadcast_to(_widest(labels.limits), angles.shape)
    stated = (widest > 0.0) & (widest <= SHARES)
    for found, text, level in (
        (columns & stated, _PERCENT, logging.WARNING),
        (columns & ~stated & ~angles, _EITHER, logging.WARNING),
        (columns & ~stated & angles, _DEGREES, logging.INFO),
    ):
        if found.any():
            farthest = np.argsort(-np.abs(highest), kind="stable")
            places = farthest[found[farthest]]
            shown = listed([f"{labels.names[i]} up to {highest[i]:.4g}" for i in places])
            first = places[0]
            far = np.ceil(abs(highest[first]) / 10.0) * 10.0
            limits = f"{-far if labels.values[:, first].min() < 0 else 0:g}..{far:g}"
            example = f"{labels.names[first]}={limits}"
            log.log(level, text, {"shown": shown, "first": example})


def _is_angle(name: str) -> bool:
    """Whether a control is an angle by its name; lips that roll in are none."""
    there = set(words(name))
    return bool(_ANGLES & there) and not _LIPS & there


def _warn_of_slips(labels: _Labels, seen: BoolArray) -> None:
    """Warn of single values far beyond all that is like them, or beyond their limits."""
    sizes = labels.sizes
    reach = ABSURD * _reach(sizes, labels.limits)
    if labels.animation is not None and len(labels.animation):
        reach = np.maximum(reach, np.abs(labels.animation).max(axis=0))
    absurd = (sizes > reach) & ~seen
    for control in np.flatnonzero(absurd.any(axis=0))[:NAMED].tolist():
        row = int(np.where(absurd[:, control], sizes[:, control], 0.0).argmax())
        more = int(absurd[:, control].sum()) - 1
        value = labels.values[row, control]
        share = BIG <= abs(value) <= PERCENT and reach[control] <= ABSURD * SHARES
        log.warning(
            "the pose of frame %s%s has %s at %.3g, many times as much as other poses and controls:"
            " correct it if it is a slip%s",
            *(labels.frames[row], f" (and {plural(more, 'other')})" if more else ""),
            *(labels.names[control], value),
            f", such as percent for {value / PERCENT:.3g}" if share else "",
        )
    if labels.limits is None:
        return
    outside = np.where(absurd.any(axis=0) | seen, 0.0, beyond(labels.limits, labels.values))
    for control in np.flatnonzero(outside.any(axis=0))[:NAMED].tolist():
        row, (low, high) = int(outside[:, control].argmax()), labels.limits[control]
        value = labels.values[row, control]
        wider = f"{labels.names[control]}={min(low, value):.3g}..{max(high, value):.3g}"
        log.warning(
            "the pose of frame %s has %s at %.3g, beyond its limits %g..%g, to which predictions "
            "are clipped: correct it, or facert convert --limits %s",
            *(labels.frames[row], labels.names[control], value, low, high),
            quote(wider) if "'" in wider else f"'{wider}'",
        )


def _warn_of_plateaus(labels: _Labels, skipped: BoolArray) -> None:
    """Warn of controls whose highest value, though no limit, many poses share to the digit."""
    highest = labels.sizes.max(axis=0)
    low = TINY * float(quantile(highest[highest > 0.0], LARGE)) if highest.any() else 0.0
    within: list[str] = []
    at_end: list[str] = []
    for control in np.flatnonzero(~skipped & (highest > low)).tolist():
        found = _plateau(labels.values[:, control])
        if found is not None:
            count, used, high = found
            at = _is_limit(labels, control, high)
            if at and count < MOST * used:
                continue
            text = f"{labels.names[control]} at {high:.4g} in {count} of {used}"
            (at_end if at else within).append(text)
    if within:
        log.warning(
            "cut off, it seems, as many poses have the same highest value: %s; export them "
            "without clipping, or pose what lies beyond",
            listed(within),
        )
    if at_end:
        log.info(
            "often exactly where they end: %s; if an exporter cut them off there and the rig goes "
            "further, export them without clipping",
            listed(at_end),
        )


def _plateau(values: FloatArray) -> tuple[int, int, float] | None:
    """How many values (l,) are the highest one, of how many that are not 0, and which one.

    None where they are few, or values are round, as somebody sets them.
    """
    used, high = values[values != 0.0], float(values.max())
    count = int((used >= high - 1e-9 * abs(high)).sum()) if high > 0.0 else 0
    if count < max(PILED, PILE * len(used)):
        return None
    rest = used[used < high]
    by_hand = np.abs(rest / GRID - np.rint(rest / GRID)) < 1e-6
    if len(np.unique(rest)) < PILED or by_hand.mean() >= MOST:
        return None
    return count, len(used), high


def _is_limit(labels: _Labels, control: int, high: float) -> bool:
    """Whether a highest value is where a control ends anyway: 1, 10, 100, or its limit."""
    ends = [SHARE, 10.0, PERCENT]
    if labels.limits is not None:
        ends.append(float(labels.limits[control, 1]))
    return any(abs(high - end) <= 1e-6 * end for end in ends if np.isfinite(end))


def _name_unmoved(take: Take) -> None:
    assert take.controls is not None
    poses = known_poses_of(take)
    still = [
        name
        for name, low, high in zip(
            take.controls.names, poses.min(axis=0), poses.max(axis=0), strict=True
        )
        if low == high
    ]
    if still and len(poses) > 1:
        controls = plural(len(still), "control")
        log.info("%s that no pose moves, and no prediction will: %s", controls, listed(still, 12))


def _widest(limits: FloatArray | None) -> FloatArray:
    """How far limits let a control go, (P,); 0 without, or where they are as good as infinite."""
    if limits is None:
        return np.zeros(1)
    sizes = np.abs(limits)
    return np.asarray(np.where(sizes < LARGEST, sizes, 0.0).max(axis=1))


def _own(sizes: FloatArray) -> FloatArray:
    """The middle of the values of each control that are not 0, (P,), of sizes (l, P).

    0 where there is one at most: one alone is like none.
    """
    used = np.where(sizes > 0.0, sizes, np.nan)
    counts = (sizes > 0.0).sum(axis=0)
    ordered = np.nan_to_num(np.sort(used, axis=0))  # NaN comes last
    middle = ordered[np.maximum(counts - 1, 0) // 2, np.arange(sizes.shape[1])]
    return np.asarray(np.where(counts > 1, middle, 0.0))


def _reach(sizes: FloatArray, limits: FloatArray | None) -> FloatArray:
    """How far controls go, by the sizes of their values in poses (l, P), or by their limits, (P,).

    Shares go to 1; percent and degrees, of which half of a control's values are beyond 1, to about
    100; and all as far as half of the values of another control that is often used.
    """
    own, used = _own(sizes), np.where(sizes > 0.0, sizes, np.nan)
    large = float(quantile(used.ravel(), LARGE)) if (sizes > 0.0).any() else 0.0
    others = own[(sizes > 0.0).sum(axis=0) >= OFTEN].max(initial=0.0)
    own = np.maximum(own, large)
    reach = np.maximum(np.where(own > SHARE, np.maximum(own, PERCENT), SHARE), others)
    if limits is None:
        return np.asarray(reach)
    widest = np.abs(limits).max(axis=1)
    return np.asarray(np.where((widest < LARGEST) & (widest > 0.0), widest, reach))

"""Limits of controls: as somebody states them, else as a rig has them, else as poses show them."""

from __future__ import annotations

import logging
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from facert.data.arrays import BoolArray, FloatArray
from facert.data.names import NameIndex, fitting, instead_of
from facert.data.rig import Rig
from facert.data.take import Controls, Take
from facert.data.text import listed, plural
from facert.errors import InputError

log = logging.getLogger("facert")

SHARE = (0.0, 1.0)
"""What shapes are limited to, and every control whose poses stay within."""
SIGNED = (-1.0, 1.0)
"""What a control that drives a bone is limited to, if its poses go below 0."""
UNLIMITED = (-np.inf, np.inf)
NO_LIMITS = "none"
OVERDRIVEN = 2.0
"""A pose beyond a limit that nobody stated is meant so, up to this many times the limit."""
SEVERAL = 2
"""So many poses farther beyond are no slips: the control is counted otherwise, and not widened."""
SLACK = 1e-6  # of the limits: what a float32 is off by

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_RANGE = re.compile(rf"\s*({_NUMBER})\s*\.\.\s*({_NUMBER})\s*")


@dataclass(frozen=True)
class StatedLimits:
    """Limits that somebody states for some controls."""

    pattern: str
    """A name in any spelling, or one with wildcards; empty for all controls."""
    limits: tuple[float, float]


def parse_limits(texts: Sequence[str]) -> tuple[StatedLimits, ...]:
    """The limits of ``0..1``, ``none``, ``NAME=0..10`` or ``NAME=none``; those of all first.

    Raises `InputError` for anything else.
    """
    stated = [_stated(text) for text in texts]
    return tuple(sorted(stated, key=lambda one: bool(one.pattern)))


def _stated(text: str) -> StatedLimits:
    name, equals, value = text.rpartition("=")
    found = _RANGE.fullmatch(value)
    if bool(equals) == bool(name.strip()):
        if value.strip() == NO_LIMITS:
            return StatedLimits(name.strip(), UNLIMITED)
        if found is not None and float(found[1]) <= float(found[2]) < np.inf:
            return StatedLimits(name.strip(), (float(found[1]), float(found[2])))
    expected = "LO..HI with LO <= HI, none, or NAME=LO..HI"
    raise InputError("--limits", expected, repr(text), "For instance --limits jaw=0..30.")


def rig_controls(rig: Rig, drivers: Sequence[str] = ()) -> Controls:
    """The controls of a rig with their limits: its shapes, which go from 0 to 1.

    Controls that drive something else, by the names in `drivers`, have none: nothing states them.
    """
    index = NameIndex.among(rig.names, list(drivers), "--drivers", quiet=True)
    names = (*rig.names, *(name for name in drivers if index.find(name) is None))
    driven = len(names) - len(rig.names)
    limits = np.vstack([np.tile(SHARE, (len(rig.names), 1)), np.tile(UNLIMITED, (driven, 1))])
    return Controls(names, limits)


def with_limits(take: Take, stated: Sequence[StatedLimits] = (), of_rig: bool = False) -> Take:
    """A take whose controls have limits: those stated, else those that it has.

    Of a take without any, controls whose poses stay within 0 and 1 are limited to that, and the
    log says so. Limits that nobody stated are widened to poses that go a little beyond them. With
    those `of_rig`, controls without any are driven, and limited to -1..1 where poses go below 0.

    Raises `InputError` for stated limits of a control that there is not.
    """
    if take.controls is None:
        if stated:
            fix = "Leave it out, or give --poses."
            raise InputError("--limits", "a take with controls", "none", fix)
        return take
    names, known = take.controls.names, known_poses_of(take)
    asked = _asked(names, stated)
    given = ~np.isnan(asked[:, 0])
    limits = take.controls.limits
    if limits is None:
        limits = _shown(names, known, given)
    elif of_rig:
        limits = _of_driven(names, limits, known, given)
    limits = _widened(names, limits, known, given)
    controls = Controls(names, np.where(given[:, None], asked, limits))
    return replace(take, controls=controls)


def known_poses_of(take: Take) -> FloatArray:
    """All poses of a take, (n, P): those of its labelled frames, then those of its animation."""
    assert take.controls is not None
    parts = [np.empty((0, len(take.controls.names)))]
    if take.params is not None:
        parts.append(take.params[take.labels])
    if take.animation is not None:
        parts.append(take.animation)
    return np.vstack(parts)


def beyond(limits: FloatArray, poses: FloatArray) -> FloatArray:
    """How far poses (n, P) are beyond the limits (P, 2), (n, P); 0 for a rounding error."""
    low, high = limits.T
    away = np.maximum(np.maximum(low - poses, poses - high), 0.0)
    return np.asarray(np.where(away > SLACK * _reach(limits), away, 0.0))


def bounds_of(limits: FloatArray | None, poses: FloatArray) -> FloatArray:
    """Bounds of controls (P, 2): finite limits, and the range of the poses (n, P) elsewhere."""
    spans = np.stack([poses.min(axis=0), poses.max(axis=0)], axis=1)
    return spans if limits is None else np.where(np.isfinite(limits), limits, spans)


def _reach(limits: FloatArray) -> FloatArray:
    """How far from 0 limits let a control go, (P,); 0 where it is unlimited."""
    return np.asarray(np.abs(np.where(np.isfinite(limits), limits, 0.0)).max(axis=1))


def _asked(names: Sequence[str], stated: Sequence[StatedLimits]) -> FloatArray:
    """The stated limits of each control, (P, 2); NaN where none are."""
    asked = np.full((len(names), 2), np.nan)
    for one in stated:
        columns = fitting(one.pattern, names) if one.pattern else list(range(len(names)))
        if not columns:
            meant = instead_of(one.pattern, names)
            fix = f"Did you mean {meant}?" if meant else f"There are {listed(names)}."
            raise InputError("--limits", "a control, or a pattern", repr(one.pattern), fix)
        asked[columns] = one.limits
    return asked


def _shown(names: Sequence[str], poses: FloatArray, given: BoolArray) -> FloatArray:
    """Limits by the poses alone, (P, 2), which the log names; infinite where these show none."""
    limits = np.tile(UNLIMITED, (len(names), 1))
    shares = np.asarray(((poses >= SHARE[0]) & (poses <= SHARE[1])).all(axis=0))
    moves = np.ptp(poses, axis=0) > 0.0 if len(poses) else np.zeros(len(names), dtype=np.bool_)
    if 2 * int((shares & moves).sum()) < max(1, int(moves.sum())):
        return limits
    found = shares & ~given
    limits[found] = SHARE
    if found.any():
        others = "" if found.all() else ", which all their poses keep to"
        count = f"all {len(names)} controls" if found.all() else plural(int(found.sum()), "control")
        log.info(
            "%s limited to 0..1%s: a prediction may go so far; --rig and --limits say otherwise",
            *(count, others),
        )
    return limits


def _of_driven(
    names: Sequence[str], limits: FloatArray, poses: FloatArray, given: BoolArray
) -> FloatArray:
    """Limits (P, 2) with those of driven controls by the poses (n, P), which the log names.

    A control that goes both ways has the same limit on either side, however its poses lie.
    """
    reach = np.abs(poses).max(axis=0, initial=0.0)
    found = np.isinf(limits).all(axis=1) & ~given & (reach > 0.0) & (reach <= OVERDRIVEN)
    signed = (poses < 0.0).any(axis=0)
    result = limits.copy()
    for chosen, (low, high) in ((found & ~signed, SHARE), (found & signed, SIGNED)):
        result[chosen] = low, high
        if chosen.any():
            of_them = listed([names[i] for i in np.flatnonzero(chosen).tolist()])
            log.info(
                "driven, and limited to %g..%g by their poses: %s; --limits NAME=LO..HI says "
                "otherwise",
                *(low, high, of_them),
            )
    return result


def _widened(
    names: Sequence[str], limits: FloatArray, poses: FloatArray, given: BoolArray
) -> FloatArray:
    """Limits (P, 2) that let in poses (n, P) a little beyond them, which the log names."""
    away = beyond(limits, poses)
    near = away <= (OVERDRIVEN - 1.0) * _reach(limits)
    meant = ~given & (away > 0.0) & near & ((~near).sum(axis=0) < SEVERAL)
    if not meant.any():
        return limits
    low = np.minimum(limits[:, 0], np.where(meant, poses, np.inf).min(axis=0))
    high = np.maximum(limits[:, 1], np.where(meant, poses, -np.inf).max(axis=0))
    widened = np.flatnonzero(meant.any(axis=0)).tolist()
    ranges = [f"{names[i]} {low[i]:.3g}..{high[i]:.3g}" for i in widened]
    log.info("limits widened to poses beyond them: %s; --limits keeps them", listed(ranges))
    return np.stack([low, high], axis=1)

"""Takes, and old animation, matched to each other: units, names of the source, controls.

The first take decides: what differs in others is converted, put into its order or refused, with the
files and the name in the message.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from facert.data.arrays import FloatArray
from facert.data.labelling import predicted_poses
from facert.data.limits import known_poses_of
from facert.data.names import NameIndex, match, nearest
from facert.data.subject import about
from facert.data.take import Controls, Source, Take, named_curves
from facert.data.takes import Takes
from facert.data.text import listed, plural
from facert.data.units import checked_unit, with_units, with_up_axis
from facert.errors import InputError

log = logging.getLogger("facert")

LEAST_SHARED = 0.5
"""Takes share at least so much of the smaller one's markers or weights; else it is another set."""
FAR_MORE, PERCENT = 20.0, 10.0
"""Poses are in another unit that go so many times as far as others; shares do not go so far."""
ABSENT = 0.5
"""Controls that an animation may lack, as a share: those that it never moves."""


def as_takes(
    given: Take | Sequence[Take] | Takes,
    animation: Take | Sequence[Take] = (),
    names: Sequence[str] = (),
    animation_names: Sequence[str] = (),
) -> Takes:
    """Takes with the units, names and controls of the first, and old animation of its controls.

    Parameters
    ----------
    given : Take, or sequence of Take
    animation : Take, or sequence of Take
        Poses of the character without a frame: the poses of a take, and its animation; of one
        without controls, its weights. Controls are matched in any spelling.
    names, animation_names : sequence of str
        The files, for messages; by default "take 1", "animation 1" and so on. A single take has
        no name in them.

    Raises
    ------
    InputError
        Naming the take, for another kind of source, an unknown unit, markers of another set, or
        controls that differ.
    """
    if isinstance(given, Takes):
        return given
    parts = [given] if isinstance(given, Take) else list(given)
    if not parts:
        raise InputError("takes", "a take at least", "none", "Give one.")
    old = [animation] if isinstance(animation, Take) else list(animation)
    names = ("",) if len(parts) == 1 else tuple(names) or _numbered("take", len(parts))
    if len(parts) == 1 and not old:
        return Takes((parts[0],), names, parts[0].animation)
    animation_names = tuple(animation_names) or _numbered("animation", len(old))
    parts = _with_sources_of_one(parts, names)
    posed = [Named(*one) for one in zip(parts, names, strict=True) if _has_poses(one[0])]
    poses = [Named(*one) for one in zip(old, animation_names, strict=True)]
    controls = _common_controls(posed, poses)
    if controls is None:
        return Takes(tuple(parts), names)
    parts = [_with_controls(*one, controls) for one in zip(parts, names, strict=True)]
    rows = [part.animation for part in parts if part.animation is not None]
    known = np.vstack([known_poses_of(part) for part in parts])
    for one in poses:
        with about(one.name):
            rows.append(_animation(one, controls))
            _warn_of_scale(rows[-1], known)
    return Takes(tuple(parts), names, np.concatenate(rows) if rows else None)


class Named(NamedTuple):
    """A take, and its file."""

    take: Take
    name: str


def without_poses(take: Take) -> Take:
    """What was recorded, alone."""
    bare = replace(take, animation=None).with_poses(take.controls, None)
    return replace(bare, controls=None)


def _numbered(noun: str, count: int) -> tuple[str, ...]:
    return tuple(f"{noun} {number}" for number in range(1, count + 1))


def _has_poses(take: Take) -> bool:
    return take.controls is not None and (len(take.labels) > 0 or take.animation is not None)


def _with_sources_of_one(parts: Sequence[Take], names: Sequence[str]) -> list[Take]:
    """Takes with the unit and the up axis of the first, and the names of all."""
    units = next((part.units for part in parts if part.units), "")
    first = _in_units(parts[0], names[0], units)
    for part, name in zip(parts[1:], names[1:], strict=True):
        if part.source.kind != first.source.kind:
            expected, found = f"{first.source.kind}, as {names[0]} has", part.source.kind
            raise InputError("/source", expected, found, "Train on one kind.", name)
    converted = [first, *(_converted(part, name, first) for part, name in _rest(parts, names))]
    wanted, columns = _union([part.source.names for part in converted], names)
    return [
        part if part.source.names == wanted else replace(part, source=_spread(part, wanted, places))
        for part, places in zip(converted, columns, strict=True)
    ]


def _rest(parts: Sequence[Take], names: Sequence[str]) -> list[tuple[Take, str]]:
    return list(zip(parts[1:], names[1:], strict=True))


def _converted(part: Take, name: str, first: Take) -> Take:
    """A take with markers in the unit and the axes of the first."""
    found = _in_units(part, name, first.units)
    if part.source.kind == "weights" or not first.up_axis or not part.up_axis:
        return found
    with about(name):
        if part.up_axis != first.up_axis:
            log.info("turned so that %s points up", first.up_axis)
            found = _take(with_up_axis(found, first.up_axis, part.up_axis), found.units)
    return found


def _in_units(part: Take, name: str, units: str) -> Take:
    """A take with markers in a unit; one that states none is taken to be in it."""
    if part.source.kind == "weights" or part.units == units:
        return part
    with about(name):
        wanted = checked_unit(units, "units of the takes")
        if part.units:
            log.info("converted from %s to %s", part.units, wanted)
        return _take(with_units(part, wanted), units)


def _take(found: object, units: str) -> Take:
    assert isinstance(found, Take)  # a take stays one
    return replace(found, units=units)


def _union(
    lists: Sequence[Sequence[str]], files: Sequence[str]
) -> tuple[tuple[str, ...], list[list[int]]]:
    """All names, those of the first take first, and the place of each take's among them."""
    known, columns = list(lists[0]), [list(range(len(lists[0])))]
    for names, file in zip(lists[1:], files[1:], strict=True):
        with about(file):
            index = NameIndex.among(known, names, "/source/names")
            found = [index.find(name) for name in names]
            _require_same_set(names, found, known, files[0])
        own = [place for place in found if place is not None]
        lone = [name for name, place in zip(names, found, strict=True) if place is None]
        left = [name for place, name in enumerate(known) if place not in own]
        _log_lone(lone, left, file)
        columns.append(
            [
                len(known) + lone.index(n) if p is None else p
                for n, p in zip(names, found, strict=True)
            ]
        )
        known += lone
    return tuple(known), columns


def _require_same_set(
    names: Sequence[str], found: Sequence[int | None], known: Sequence[str], first: str
) -> None:
    """Refuse names of another set, and two that would be one of the first take's."""
    places = [place for place in found if place is not None]
    twice = next((place for place in places if places.count(place) > 1), None)
    if twice is not None:
        one, other = (name for name, place in zip(names, found, strict=True) if place == twice)
        expected, both = f"a name each for {one!r} and {other!r}", f"only {known[twice]!r}"
        raise InputError("/source/names", f"{expected} in {first}", both, "Rename one of them.")
    if len(places) < LEAST_SHARED * min(len(names), len(known)):
        lost = next(name for name, place in zip(names, found, strict=True) if place is None)
        expected, fix = f"the names of {first}, such as {known[0]!r}", "Take the same set in both."
        near = nearest(lost, known)
        fix = f"Did you mean {near!r}? {fix}" if near else fix
        raise InputError("/source/names", expected, f"{lost!r} and others", fix)


def _log_lone(lone: Sequence[str], left: Sequence[str], file: str) -> None:
    """Log names that one take alone has; warn where two of them may be one."""
    if lone:
        text = "%s: in no take before, where they are taken as not observed: %s"
        log.info(text, file, listed([repr(name) for name in lone]))
    if left:
        text = "%s: taken as not observed, as it lacks them: %s"
        log.info(text, file, listed([repr(name) for name in left]))
    for name in lone:
        near = nearest(name, left)
        if near is not None:
            log.warning("%s: %r is in no take before: did you mean %r?", file, name, near)


def _spread(part: Take, wanted: Sequence[str], places: Sequence[int]) -> Source:
    """The source of a take under the names of all; NaN for what it lacks."""
    values = part.source.values
    spread = np.full((len(values), len(wanted), *values.shape[2:]), np.nan)
    spread[:, list(places)] = values
    return Source(spread, tuple(wanted))


def _common_controls(posed: Sequence[Named], animation: Sequence[Named]) -> Controls | None:
    """Names of the first take that is posed, and the widest limits that any states.

    Poses of a take that states none are within them as well.
    """
    if not posed:
        return None
    first = posed[0].take.controls
    assert first is not None  # it is posed
    limits = [_limits(one, first) for one in (*posed, *animation)]
    stated = [one for one in limits if one is not None]
    if not stated:
        return first
    shown = zip(posed, limits, strict=False)
    stated += [_reach(one, first) for one, own in shown if own is None]
    low, high = np.array([one[:, 0] for one in stated]), np.array([one[:, 1] for one in stated])
    with np.errstate(invalid="ignore"):
        widest = np.stack([np.fmin.reduce(low), np.fmax.reduce(high)], axis=1)
    open_ended = np.isnan(widest)
    return Controls(first.names, np.where(open_ended, [-np.inf, np.inf], widest))


def _limits(one: Named, controls: Controls) -> FloatArray | None:
    """Limits (P, 2) that a take states for these controls; NaN for one that it lacks."""
    own = one.take.controls
    if own is None or own.limits is None:
        return None
    index = NameIndex.among(own.names, controls.names, "/target/names", quiet=True)
    places = [index.find(name) for name in controls.names]
    nothing = np.full(2, np.nan)
    return np.array([nothing if place is None else own.limits[place] for place in places])


def _reach(one: Named, controls: Controls) -> FloatArray:
    """Least and largest value of these controls in the poses of a take, (P, 2)."""
    names, poses = _poses_without_frames(one)
    with about(one.name):
        columns = match(controls.names, names, "/target/names")
    return np.stack([poses.min(axis=0), poses.max(axis=0)], axis=1)[columns]


def _with_controls(part: Take, name: str, controls: Controls) -> Take:
    """A take with its poses in the order of the controls."""
    if not _has_poses(part):
        return part.with_poses(controls, None)
    assert part.controls is not None  # it has poses
    own = part.controls.names
    if own == controls.names and part.controls.limits is controls.limits:
        return part
    with about(name):
        columns = match(controls.names, own, "/target/names")
        if len(columns) != len(own):
            extra = next(name for place, name in enumerate(own) if place not in columns)
            expected, found = f"{len(columns)} controls as in the first take", f"{extra!r} as well"
            raise InputError("/target/names", expected, found, "Pose the same controls.")
    return part.with_controls(controls, lambda rows: rows[:, columns])


def _animation(one: Named, controls: Controls) -> FloatArray:
    """The poses of a take for these controls, (n, P); those that it lacks are at rest."""
    if predicted_poses(one.take):
        log.info("a model predicted its poses: taken for animation as they are")
    names, poses = _poses_without_frames(one)
    index = NameIndex.among(names, controls.names, "names of the animation")
    places = [index.find(control) for control in controls.names]
    absent = [n for n, place in zip(controls.names, places, strict=True) if place is None]
    extra = [name for place, name in enumerate(names) if place not in places]
    if any(nearest(name, extra) for name in absent) or len(absent) > ABSENT * len(places):
        index.places(absent, "names of the animation")  # names which, and the nearest name
    if absent:
        what = ", ".join(map(repr, absent))
        log.warning("taken to be at 0 throughout, as it lacks them: %s", what)
    if extra:
        controls_ = plural(len(extra), "control")
        text = "%s that the takes do not have, passed over (%s)"
        log.info(text, controls_, listed([repr(name) for name in extra]))
    found = np.zeros((len(poses), len(places)))
    for column, place in enumerate(places):
        if place is not None:
            found[:, column] = poses[:, place]
    whole = ~np.isnan(found).any(axis=1)
    if not whole.any():
        raise InputError("the animation", "whole poses", "gaps in every one", "Fill them.")
    log.info("%s of old animation", plural(int(whole.sum()), "pose"))
    return found[whole]


def _warn_of_scale(animation: FloatArray, known: FloatArray) -> None:
    """Warn of animation (n, P) in percent beside known poses (l, P) in shares, or the reverse."""
    if not len(known):
        return
    reach = np.stack([np.abs(poses).max(axis=0) for poses in (animation, known)])
    reach = reach[:, (reach > 0.0).all(axis=0)]
    if not reach.size:
        return
    ratio, (_, usual) = float(np.median(reach[0] / reach[1])), np.median(reach, axis=1)
    if ratio > FAR_MORE:
        text = "its poses go about %.2g times as far as those of the takes: percent instead of "
        log.warning(text + "fractions? Divide them by 100", ratio)
    elif ratio * FAR_MORE < 1.0 and usual > PERCENT:
        text = "its poses go about %.2g times as far as those of the takes: fractions instead of "
        log.warning(text + "percent? Multiply them by 100", ratio)


def _poses_without_frames(one: Named) -> tuple[Sequence[str], FloatArray]:
    """Names and all poses of a take, (n, P): those of its frames, and its animation."""
    take = one.take
    if not _has_poses(take):
        return named_curves(take)
    assert take.controls is not None  # it has poses
    frames = None if take.params is None else take.params[take.labels]
    rows = [poses for poses in (frames, take.animation) if poses is not None]
    return take.controls.names, np.concatenate(rows)

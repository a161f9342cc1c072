"""A pose that is being edited: some controls are pinned, the others follow."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from facert.data.arrays import FloatArray, IntArray
from facert.data.sides import counterparts
from facert.data.take import Controls
from facert.posing.completed_pose import FAR
from facert.posing.completion import Completion, Posed
from facert.posing.correction import correct
from facert.preprocess.known_poses import Given, KnownPoses

KEPT = 32  # sets of pinned controls whose completion is kept: going back to one costs nothing


@dataclass(frozen=True, eq=False)
class Edit:
    """What was done to a pose."""

    pins: Mapping[int, float]
    """Values of the controls that are held."""
    start: FloatArray | None
    """What the pose began with, (P,); None for the neutral pose."""
    std: FloatArray | None
    chosen: bool
    """Whether a person chose to begin with it, rather than the frame having it."""

    @property
    def is_change(self) -> bool:
        """Whether the pose is another than the frame began with."""
        return bool(self.pins) or self.chosen


class PoseEditor:
    """A pose of which some controls are pinned.

    Without a pose to begin with, the others follow by `facert.posing.completion`; from one that
    was retargeted, they are corrected with the pinned ones by `facert.posing.correction`. Without
    known poses they stay.

    Parameters
    ----------
    controls : Controls
        P of them.
    known : KnownPoses, optional
        Poses that the character is known to make.
    """

    def __init__(self, controls: Controls, known: KnownPoses | None = None) -> None:
        self.controls = controls
        self.known = known
        self.pins: dict[int, float] = {}
        self.counterparts: IntArray = counterparts(controls.names)
        self._completion = lru_cache(KEPT)(self._learn_completion)
        self._start: FloatArray | None = None
        self._start_std: FloatArray | None = None
        self._chosen = False
        self._posed = self._solve(0, 0)

    @property
    def edit(self) -> Edit:
        """What was done so far; `restore` goes back to it."""
        return Edit(dict(self.pins), self._start, self._start_std, self._chosen)

    @property
    def pose(self) -> FloatArray:
        """The pose, (P,)."""
        return self._posed.pose

    @property
    def std(self) -> FloatArray:
        """Standard deviation of each control, (P,); 0 of those that are pinned."""
        return self._posed.std

    @property
    def rest(self) -> FloatArray:
        """The neutral pose, (P,): every control at 0, or as near as its limits allow."""
        return np.clip(np.zeros(len(self.controls.names)), *slider_bounds(self).T)

    @property
    def one_sided_pin(self) -> int | None:
        """The control that was pinned last, if its counterpart is not pinned at its value."""
        pin = next(reversed(self.pins), None)
        if pin is None or self.counterparts[pin] == pin:
            return None
        return pin if self.pins.get(int(self.counterparts[pin])) != self.pins[pin] else None

    @property
    def from_neutral(self) -> bool:
        """Whether editing began at the neutral pose."""
        return self._start is None

    @property
    def far(self) -> bool:
        """Whether the pins are far from every known pose: then the rest of the pose is a guess."""
        if self.known is None or self._start is not None or not self.pins:
            return False
        given = self._given()
        return self._completion(tuple(sorted(self.pins))).farness(given.values) > FAR

    def begin(self, pose: FloatArray | None, std: FloatArray | None = None) -> None:
        """Start from a frame's pose (P,) with nothing pinned; from the neutral one without it."""
        self.restore(Edit({}, pose, std, chosen=False))

    def begin_anew(self, pose: FloatArray | None) -> None:
        """Start from a pose that a person chose instead, or the neutral one."""
        self.restore(Edit({}, pose, None, chosen=True))

    def restore(self, edit: Edit) -> None:
        """Go back to what was done once."""
        self.pins = dict(edit.pins)
        self._start, self._start_std, self._chosen = edit.start, edit.std, edit.chosen
        self._posed = self._solve(0, 0)

    def pin(self, control: int, value: float) -> None:
        """Hold a control at a value."""
        self.pin_all({control: value})

    def pin_all(self, pins: Mapping[int, float]) -> None:
        """Hold some controls as well, within their declared limits: numbers are typed, too."""
        held = self.pose.copy()
        held[list(pins)] = list(pins.values())
        held = self._limited(held)
        for control in pins:
            self.pins.pop(control, None)  # the one that was pinned last comes last
            self.pins[control] = float(held[control])
        self._posed = self._solve(0, 0)

    def let_go(self, control: int) -> None:
        """Let a control follow the others again."""
        self.pins.pop(control, None)
        self._posed = self._solve(0, 0)

    def let_all_go(self) -> None:
        """Let all controls follow."""
        self.pins = {}
        self._posed = self._solve(0, 0)

    def mirror(self) -> None:
        """Exchange left and right; controls without a side stay as they are."""
        pose = self._limited(self.pose[self.counterparts])
        pins = {int(self.counterparts[pin]): 0.0 for pin in self.pins}
        self.restore(Edit({pin: float(pose[pin]) for pin in pins}, pose, None, chosen=True))

    def pin_counterpart(self, control: int) -> None:
        """Hold a pinned control's counterpart on the other side at its value."""
        self.pin(int(self.counterparts[control]), self.pins[control])

    def learn(self, known: KnownPoses | None) -> None:
        """Replace the known poses that completions are learned from."""
        self.known = known
        self._completion.cache_clear()
        self._posed = self._solve(0, 0)

    def samples(self, count: int, seed: int) -> FloatArray:
        """Other plausible poses with the same pins, (count, P); none without known poses."""
        return self._solve(count, seed).samples

    def adopt(self, sample: FloatArray) -> None:
        """Go on from a sample: the pins stay, and the other controls begin where it has them."""
        self._start, self._start_std, self._chosen = sample, None, True
        self._posed = self._solve(0, 0)

    def _solve(self, samples: int, seed: int) -> Posed:
        base = self.rest if self._start is None else self._start
        given = self._given()
        if self.known is None:
            pose = base.copy()
            pose[given.controls] = given.values
            return Posed(pose, np.zeros_like(pose), np.empty((0, len(pose))))
        rng = np.random.default_rng(seed)
        if self.pins and self._start is None:
            return self._completion(tuple(sorted(self.pins))).pose(given, samples, rng)
        if self.pins:
            return correct(base, self._start_std, self.known, given, samples, rng)
        spread = np.zeros_like(base) if self._start_std is None else self._start_std
        drawn = self.known.poses[rng.permutation(len(self.known.poses))[:samples]]
        return Posed(base, spread, drawn)

    def _limited(self, pose: FloatArray) -> FloatArray:
        """A pose (P,) within the declared limits: those of two sides may differ."""
        limits = self.controls.limits
        return pose if limits is None else np.asarray(np.clip(pose, *limits.T))

    def _given(self) -> Given:
        chosen = sorted(self.pins)
        values = np.array([self.pins[control] for control in chosen], dtype=np.float64)
        return Given(np.array(chosen, dtype=np.int64), values)

    def _learn_completion(self, controls: tuple[int, ...]) -> Completion:
        assert self.known is not None  # the caller has looked
        return Completion.learn(self.known, np.array(controls, dtype=np.int64))


def slider_bounds(editor: PoseEditor) -> FloatArray:
    """Lowest and highest value of each control's slider, (P, 2).

    The declared limits; where there are none, what is known, and 0 to 1 in any case.
    """
    limits = editor.controls.limits
    bounds = np.tile([0.0, 1.0], (len(editor.controls.names), 1))
    if editor.known is not None:
        low, high = editor.known.poses.min(axis=0), editor.known.poses.max(axis=0)
        bounds = np.stack([np.minimum(low, 0.0), np.maximum(high, 1.0)], axis=1)
    return bounds if limits is None else np.where(np.isfinite(limits), limits, bounds)

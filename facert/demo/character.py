"""The character's rig: its own controls, eased, coupled and limited, unlike the actor's muscles.

An animator who gives the character the actor's expression turns the controls until their
*effect* is right. `animate` does the same: it works out the effects that express the actor's
activations, undoes the couplings, undoes the easing, and stops at the limits.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np

from facert.data.arrays import FloatArray
from facert.demo.expressions import ACTIVATIONS

EASE = 2.0


@dataclass(frozen=True)
class Control:
    """One slider of the rig."""

    name: str
    shape: Mapping[str, float]
    """What it does at 1, as a blend of the activations on the character's own mesh."""
    low: float = 0.0
    high: float = 1.0
    """Limits of the slider are `low` and `high`."""
    power: float = 1.0
    """Easing: the effect of a slider at c is c ** (1 / power), fast at first and then slow, on both
    sides of zero: a hint of a smile needs little, the last of it much."""

    def setting(self, effect: FloatArray) -> FloatArray:
        """The slider's position for a wanted effect, within the limits."""
        eased = np.sign(effect) * np.abs(effect) ** self.power
        return np.asarray(np.clip(eased, self.low, self.high))


CONTROLS = (
    Control("brow_L", {"brow_outer_up_L": 1.0, "brow_inner_up": 0.25}, -1, 1, EASE),
    Control("brow_R", {"brow_outer_up_R": 1.0, "brow_inner_up": 0.25}, -1, 1, EASE),
    Control("brow_worry", {"brow_inner_up": 1.2}, power=EASE),
    Control(
        "brow_angry", {"brow_down_L": 1.0, "brow_down_R": 1.0, "nose_wrinkle": 0.2}, power=EASE
    ),
    Control("lid_L", {"blink_L": 1.0}, -0.4, 1, EASE),
    Control("lid_R", {"blink_R": 1.0}, -0.4, 1, EASE),
    Control("squint", {"squint": 1.0}, power=EASE),
    Control("cheeks", {"cheek_raise": 1.2}, power=EASE),
    Control("sneer", {"nose_wrinkle": 1.0, "upper_lip_up": 0.5}, power=EASE),
    Control("smile", {"smile_L": 1.1, "smile_R": 1.1}, power=EASE),
    Control("smile_side", {"smile_L": 0.55, "smile_R": -0.55}, -1, 1, 1.0),
    Control("frown", {"frown_L": 1.0, "frown_R": 1.0}, power=EASE),
    Control("mouth_wide", {"stretch": 1.1}, -1, 1, EASE),
    Control("mouth_kiss", {"pucker": 1.0}, power=EASE),
    Control("mouth_round", {"funnel": 1.1}, power=EASE),
    Control("mouth_side", {"mouth_left": 1.0}, -1, 1, EASE),
    Control("jaw_open", {"jaw_open": 1.0}, power=1.5),
    Control("jaw_side", {"jaw_left": 1.0}, -1, 1, EASE),
    Control("lips_press", {"lips_press": 1.0}, power=EASE),
    Control("upper_lip", {"upper_lip_up": 1.0}, power=EASE),
    Control("lower_lip", {"lower_lip_down": 1.0}, power=EASE),
)


def animate(activations: FloatArray) -> FloatArray:
    """The pose (T, 21) an animator would give for the actor's activations (T, 26)."""
    effects = _effects(SimpleNamespace(**dict(zip(ACTIVATIONS, activations.T, strict=True))))
    return np.column_stack([control.setting(effects[control.name]) for control in CONTROLS])


def control_shapes(shapes: FloatArray) -> FloatArray:
    """Displacements (21, V, 3) of the controls at 1, from those of the activations (26, V, 3)."""
    blend = np.array(
        [[control.shape.get(name, 0.0) for name in ACTIVATIONS] for control in CONTROLS]
    )
    return np.asarray(np.tensordot(blend, shapes, axes=1))


def _effects(a: SimpleNamespace) -> dict[str, FloatArray]:
    """The effect of each control that expresses activations, given by name; couplings undone."""
    brows_down = (a.brow_down_L + a.brow_down_R) / 2
    smile = (a.smile_L + a.smile_R) / 2
    frown = (a.frown_L + a.frown_R) / 2
    return {
        "brow_L": 1.3 * a.brow_outer_up_L - 0.6 * a.brow_down_L,
        "brow_R": 1.3 * a.brow_outer_up_R - 0.6 * a.brow_down_R,
        # Worry and anger pull at the same skin: each weakens the other.
        "brow_worry": 1.3 * a.brow_inner_up * (1 - 0.7 * brows_down),
        "brow_angry": 1.2 * brows_down * (1 - 0.7 * a.brow_inner_up) + 0.25 * a.nose_wrinkle,
        "lid_L": a.blink_L - 0.4 * a.eye_wide + 0.15 * a.squint,
        "lid_R": a.blink_R - 0.4 * a.eye_wide + 0.15 * a.squint,
        "squint": 2.0 * a.squint * (1 - 0.6 * a.cheek_raise),
        "cheeks": 0.6 * a.cheek_raise + 0.8 * smile**2,
        "sneer": 1.3 * a.nose_wrinkle * (0.5 + a.upper_lip_up),
        # The corners travel less when the jaw is down, so the smile is turned up further.
        "smile": 1.1 * smile * (1 + a.jaw_open),
        "smile_side": (a.smile_L - a.smile_R) / (0.5 + smile),
        "frown": 1.3 * frown * (1 - smile),
        "mouth_wide": 1.3 * a.stretch * (1 - 0.6 * smile) - 0.5 * a.pucker * a.jaw_open,
        # A narrow mouth is a kiss when it is closed and a round one when it is open.
        "mouth_kiss": 1.2 * a.pucker * (1 - 0.8 * a.jaw_open),
        "mouth_round": a.funnel * (0.5 + 0.8 * a.jaw_open) + 0.7 * a.pucker * a.jaw_open,
        "mouth_side": (a.mouth_left - a.mouth_right) * (1.5 - 0.6 * smile),
        "jaw_open": 1.3 * a.jaw_open * (1 - 0.6 * a.lips_press),
        "jaw_side": 2.0 * (a.jaw_left - a.jaw_right) * (1 + a.jaw_open),
        "lips_press": 1.3 * a.lips_press * (1 - 0.7 * a.jaw_open),
        "upper_lip": 1.4 * a.upper_lip_up * (1 - 0.5 * smile),
        "lower_lip": 2.0 * a.lower_lip_down * (1 - 0.5 * a.jaw_open),
    }

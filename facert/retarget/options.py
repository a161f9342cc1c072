"""How a source is treated before it is mapped, and controls after."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from facert.errors import InputError
from facert.retarget.adjustments import Adjustments


@dataclass(frozen=True)
class RetargetOptions:
    """What a person may choose for each take, whatever the model.

    Parameters
    ----------
    detect : bool
        Take frozen, swapped and otherwise bad markers as not observed.
    smooth : bool
        Take noise out, and fill gaps, by what neighbouring frames tell.
    sigma : float, optional
        Standard deviation of the capture noise, in the take's units; by default estimated from the
        take; a live stream begins with that of the training take and measures its own.
    neutral : sequence of int, optional
        Frames in which the actor rests; see `facert.preprocess.neutral`.
    adjustments : Adjustments, optional
        Of single controls.
    """

    detect: bool = True
    smooth: bool = True
    sigma: float | None = None
    neutral: Sequence[int] | None = None
    adjustments: Adjustments | None = None

    def __post_init__(self) -> None:
        if self.sigma is not None and not 0.0 <= self.sigma < math.inf:
            raise InputError("sigma", "a number from 0", repr(self.sigma), "Change it.")


AS_IT_IS = RetargetOptions(detect=False, smooth=False)
"""Every frame on its own, and every number believed."""

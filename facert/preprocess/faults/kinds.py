"""What may be wrong with the values of a source, and where it is."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from facert.data.arrays import BoolArray, frozen
from facert.data.take import Source
from facert.data.text import plural


@dataclass(frozen=True, eq=False)
class Faults:
    """Faults of a source by kind, each (T, M) or (T, D)."""

    zero: BoolArray
    frozen: BoolArray
    swapped: BoolArray
    spiked: BoolArray
    strayed: BoolArray
    absurd: BoolArray
    blank: BoolArray

    def __post_init__(self) -> None:
        for kind in fields(self):
            frozen(getattr(self, kind.name))  # cached: what one caller changed would stay

    @classmethod
    def of(cls, shape: tuple[int, ...], **kinds: BoolArray) -> Faults:
        """The faults of the given kinds, and none of the others."""
        return cls(**{kind.name: np.zeros(shape, np.bool_) for kind in fields(cls)} | kinds)

    @property
    def any(self) -> BoolArray:
        """Faults of any kind, (T, M) or (T, D)."""
        return np.asarray(np.any([getattr(self, kind.name) for kind in fields(self)], axis=0))

    def __str__(self) -> str:
        """Counts by kind, e.g. ``"12 frozen, 3 spikes"``; ``"none"``."""
        counts = [(int(getattr(self, kind.name).sum()), kind.name) for kind in fields(self)]
        texts = (
            plural(count, "spike") if kind == "spiked" else f"{count} {kind}"
            for count, kind in counts
            if count
        )
        return ", ".join(texts) or "none"

    def hidden_from(self, source: Source) -> Source:
        """The source with its faults set to NaN.

        Raises
        ------
        InputError
            When nothing is left.
        """
        if not self.any.any():
            return source
        mask = self.any[:, :, None] if source.kind == "markers" else self.any
        return Source(np.where(mask, np.nan, source.values), source.names)

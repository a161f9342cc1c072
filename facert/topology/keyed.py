"""A source performance with a few key frames of the target: what propagation starts from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from facert.data.arrays import FloatArray, IntArray
from facert.errors import InputError
from facert.topology.labels import checked_labels

LEAST = 2


@dataclass(frozen=True, eq=False)
class KeyedPerformance:
    """Source frames, and the target at some of them.

    Raises
    ------
    InputError
        For fewer than two keys, keys that are no frames or doubled, numbers that are not finite,
        or shapes that do not fit together.
    """

    # (T, M, D): Feature points of the actor; D = 3 for markers. Weights are one point of D
    # coordinates.
    source: FloatArray
    keys: IntArray  # (K,): The labelled frames, in any order
    # (K, G, C): The target there. Either G = M: each feature point has its own target, of C = 3
    # coordinates; or G = 1: the parameters of a rig, which depend on the whole face.
    labels: FloatArray

    def __post_init__(self) -> None:
        _require_finite(self.source, "source")
        _require_finite(self.labels, "key poses")
        object.__setattr__(self, "keys", checked_labels(self.keys, len(self.source)))
        if len(self.keys) < LEAST:
            raise InputError(
                "keys", f"{LEAST} key frames or more", f"{len(self.keys)}", "Pose more frames."
            )
        groups = sorted({1, self.source.shape[1]})
        if len(self.labels) != len(self.keys) or self.labels.shape[1] not in groups:
            raise InputError(
                "key poses",
                f"shape ({len(self.keys)}, {' or '.join(map(str, groups))}, C)",
                f"{self.labels.shape}",
                "Give one target a key, for each feature point or for all together.",
            )

    def __len__(self) -> int:
        """Number of frames T."""
        return len(self.source)

    @property
    def by_point(self) -> bool:
        """Whether each feature point has a target of its own."""
        return bool(self.source.shape[1] == self.labels.shape[1] > 1)

    @property
    def frames(self) -> FloatArray:
        """Whole source frames, (T, M D)."""
        return self.source.reshape(len(self.source), -1)

    @property
    def explaining(self) -> FloatArray:
        """Part of the source that each target follows, (G, T, d)."""
        return self.source.transpose(1, 0, 2) if self.by_point else self.frames[None]

    def less(self, estimate: FloatArray) -> KeyedPerformance:
        """The performance with the key poses less an estimate (T, G, C), at the same source."""
        return KeyedPerformance(self.source, self.keys, self.labels - estimate[self.keys])


def even_keys(frames: int, every: int) -> IntArray:
    """Frames 0, `every`, 2 `every`, ... and the last one, after which no key follows.

    Raises
    ------
    InputError
        When `every` is less than 1.
    """
    if every < 1:
        raise InputError("--every", "1 or more", f"{every}", "For instance 10.")
    return np.unique(np.append(np.arange(0, frames, every), frames - 1))


def _require_finite(values: FloatArray, field: str) -> None:
    if values.ndim != 3 or not values.size or not np.isfinite(values).all():
        found = f"shape {values.shape}" if np.isfinite(values).all() else "NaN or infinity"
        raise InputError(field, "finite numbers", found, "Fill or drop what was not observed.")

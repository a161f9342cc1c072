"""The result of training: a method, and what brings a source to it and poses back."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from facert.data.arrays import FloatArray
from facert.data.normalisation import Normalisation
from facert.data.take import Controls, SourceKind, Take
from facert.data.text import listed, plural, printable
from facert.methods.base import Method
from facert.preprocess.motion.motion import Motion
from facert.preprocess.source_layout import SourceLayout
from facert.settings import Settings

OF_A_RUN = ("seconds",)
"""Figures of one run of a training: no two are alike."""


@dataclass(frozen=True)
class TrainedModel:
    """A trained method with all that mapping a take needs.

    Parameters
    ----------
    method : Method
        Works in normalised units.
    layout : SourceLayout
        What the source must hold.
    units : str
        Unit of the training take's markers; empty when unknown.
    controls : Controls
        What the result holds.
    bounds : array, shape (P, 2), or None
        What poses are clipped to.
    source_units, target_units : Normalisation
        Maps between the units of source and target and normalised ones.
    figures : dict
        How training went, for people.
    labels : int
        Posed frames that it was trained on.
    poses : array, shape (n, P), or None
        Poses that the character is known to make, for `facert.posing`.
    motion : Motion or None
        How the source moves, in normalised units, for live streams.
    neutral : array, shape (d_x,)
        The source with the actor at rest, in its units; NaN where it is not known.
    labelled : array, shape (l, d_x), or None
        The source in the posed frames, gaps filled; files of earlier versions lack it.
    name : str
        The file that it was read from; empty when it was not.
    takes : tuple of str
        Names of the takes that it was trained on, where they are known.
    """

    method: Method
    layout: SourceLayout
    units: str
    controls: Controls
    bounds: FloatArray | None
    source_units: Normalisation
    target_units: Normalisation
    figures: dict[str, Any]
    neutral: FloatArray
    labels: int = 0
    poses: FloatArray | None = None
    motion: Motion | None = None
    labelled: FloatArray | None = None
    name: str = ""
    takes: tuple[str, ...] = ()

    def without_known(self, take: Take) -> Take:
        """The take without the poses that this was trained on, for an error on unseen ones."""
        if self.poses is None or take.params is None or take.controls is None:
            return take
        if set(take.controls.names) != set(self.controls.names):
            return take
        if self.labels > len(self.poses):  # not all of them were kept
            return replace(take, params=None, std=None, corrections=None)
        columns = [take.controls.names.index(name) for name in self.controls.names]
        seen = (take.params[:, None, columns] == self.poses[None]).all(axis=2).any(axis=1)
        return replace(take, params=np.where(seen[:, None], np.nan, take.params))

    @property
    def source_kind(self) -> SourceKind:
        """``"markers"`` or ``"weights"``."""
        return self.layout.kind

    @property
    def source_names(self) -> tuple[str, ...]:
        """Names of the markers or weights that the model knows."""
        return self.layout.names

    @property
    def settings(self) -> Settings:
        """The settings it was trained with, defaults filled in."""
        return self.method.settings

    @property
    def description(self) -> str:
        """The model in a line: its file, method, and what it learned from."""
        poses = plural(self.labels, "pose")
        origin = f" of {listed(self.takes, 3)}" if self.takes else ""
        name = f"{printable(self.name)}: " if self.name else ""
        return f"{name}{self.settings.method}, {poses}{origin}"

    @property
    def facts(self) -> dict[str, Any]:
        """Names, units, settings and figures of the model, as plain values.

        They depend on what it learned from alone: the same training gives the same file.
        """
        return {
            "source_kind": self.source_kind,
            "source_names": list(self.source_names),
            "units": self.units,
            "target_names": list(self.controls.names),
            "settings": self.settings.as_dict(),
            "figures": {n: value for n, value in self.figures.items() if n not in OF_A_RUN},
        }

"""A performance as a page shows it: faces, errors, standard deviations, and where to look."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from facert.data.arrays import FloatArray, IntArray
from facert.data.names import shape_drivers
from facert.data.rig import Rig
from facert.data.shared_controls import require_shared, shared_controls
from facert.data.take import Take
from facert.errors import InputError
from facert.evaluation.metrics import vertex_errors, vertex_gram
from facert.pages.paint import Scale
from facert.render.faces import Face, posed_face, require_deviations, require_poses

if TYPE_CHECKING:
    from facert.retarget.retargeter import Retargeter

APART = 0.5  # seconds between two frames that are listed
_LOOKED_AT = 48  # frames that show how far a scale goes


@dataclass(frozen=True, eq=False)
class Performance:
    """A take of poses, with the character and the true poses where they are known.

    Raises
    ------
    InputError
        When rig or truth do not fit the take.
    """

    take: Take
    """Frames of the source; with poses, and their standard deviation, if there are some."""
    key_poses: IntArray
    """Frames that somebody posed."""
    rig: Rig | None = None
    """The character."""
    truth: Take | None = None
    """True poses of the same frames."""

    def __post_init__(self) -> None:
        for take in (self.take, self.truth):
            if take is not None and len(take.labels):
                require_poses(take)
                require_deviations(take)
        if self.truth is None:
            return
        fix = "Give the truth of this take."
        shared = require_shared(self.truth, self.take, fix)
        if shared.of_truth or shared.of_result:
            raise InputError("--truth", "poses of the take's controls", "others, or none", fix)

    @cached_property
    def face(self) -> Face | None:
        """The character, where rig and poses are known."""
        if self.rig is None or not len(self.take.labels):
            return None
        return posed_face(self.take, self.rig, "character")

    @cached_property
    def true_face(self) -> Face | None:
        """The character in the true poses."""
        if self.rig is None or self.truth is None:
            return None
        return posed_face(self.truth, self.rig, "truth")

    @cached_property
    def std(self) -> FloatArray | None:
        """Predicted standard deviation of the pose, root mean square over controls, (T,)."""
        std = self._deviations
        return None if std is None else np.asarray(np.sqrt(np.mean(std**2, axis=1)))

    @cached_property
    def _deviations(self) -> FloatArray | None:
        """Predicted standard deviations, (T, P); 0 where a pose is somebody's."""
        return None if self.take.std is None else np.nan_to_num(self.take.std)

    @cached_property
    def true_params(self) -> FloatArray | None:
        """The true poses in the order of the take's controls, (T, P)."""
        shared = None if self.truth is None else shared_controls(self.truth, self.take)
        return None if shared is None else shared.truth.params

    @cached_property
    def errors(self) -> FloatArray | None:
        """Error of each frame, (T,), in the rig's units if there is one, else of the controls.

        Root mean square over vertices or controls; NaN where the truth or the pose is not known.
        """
        if self.true_params is None or self.take.params is None:
            return None
        off = self.take.params - self.true_params
        if self.rig is None:
            return np.asarray(np.sqrt(np.mean(off**2, axis=1)))
        assert self.take.controls is not None
        return vertex_errors(off, vertex_gram(self.rig, self.take.controls))

    def vertex_errors(self, frame: int) -> FloatArray | None:
        """Error of each vertex in a frame, (V,), in the rig's units."""
        if self.face is None or self.true_face is None:
            return None
        rows = np.array([frame])
        off = self.face.motion.fetch(rows)[0] - self.true_face.motion.fetch(rows)[0]
        return np.asarray(np.linalg.norm(off, axis=1))

    def vertex_std(self, frame: int) -> FloatArray | None:
        """Predicted standard deviation of each vertex, (V,), with independent controls."""
        if self._squared_shapes is None or self._deviations is None:
            return None
        return np.asarray(np.sqrt(self._deviations[frame] ** 2 @ self._squared_shapes))

    @cached_property
    def _squared_shapes(self) -> FloatArray | None:
        """Squared distance by which each control moves each vertex, (P, V)."""
        if self.rig is None or self.take.controls is None:
            return None
        drivers = shape_drivers(self.take.controls.names, self.rig.names)
        shapes = np.tensordot(drivers, self.rig.shapes, axes=1)
        body = len(self.rig.whole.vertices) - len(self.rig.neutral)
        return np.pad(np.sum(shapes**2, axis=2), ((0, 0), (0, body)))

    def scale(self) -> Scale:
        """The scale of colours for `vertex_errors`, else for `vertex_std`."""
        units = self.rig.units if self.rig is not None else ""
        some = np.unique(np.linspace(0, len(self.take) - 1, _LOOKED_AT).astype(int)).tolist()
        measure = self.vertex_errors if self.true_face is not None else self.vertex_std
        found = [values for frame in some if (values := measure(frame)) is not None]
        values = np.array(found)
        return Scale.of(values[np.isfinite(values)], units)


def retargeted(
    take: Take, retargeter: Retargeter, rig: Rig | None = None, truth: Take | None = None
) -> Performance:
    """A take as a model retargets it.

    The take's own poses are key poses; where it is posed throughout and no other truth is given,
    they are the truth.
    """
    posed_throughout = len(take.labels) == len(take)
    result = replace(retargeter.retarget(take), source=take.source)
    if truth is None and posed_throughout:
        truth = take
    return Performance(result, take.labels[:0] if posed_throughout else take.labels, rig, truth)


def highest(values: FloatArray, time: FloatArray, count: int) -> list[int]:
    """Frames of the highest values (T,), highest first, `APART` or more from each other."""
    left = np.where(np.isfinite(values), values, -np.inf)
    chosen: list[int] = []
    while len(chosen) < count and np.isfinite(left.max()):
        frame = int(left.argmax())
        chosen.append(frame)
        left[np.abs(time - time[frame]) < APART] = -np.inf
    return chosen

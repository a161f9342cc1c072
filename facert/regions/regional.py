"""A method for each region of the face, blended where a control belongs to several.

A region's method never sees the rest of the face: its controls follow its own markers alone. It
works in units of its own, those that it would have if the region were all there is: a lid is to
its region what a jaw is to the face.

With w_rc the weight of region r in control c, which sum to 1, and y_rc, s_rc the region's
prediction,

    y_c = Σ_r w_rc y_rc,      s_c² = Σ_r w_rc s_rc²,

the variance of the blend if the errors of regions go together, and more than it otherwise. One
region of everything is the method itself.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar, Self

import numpy as np

from facert.data.array_group import (
    DAMAGED,
    ArrayGroup,
    Shaped,
    check_axes,
    part_of,
    require_known_arrays,
)
from facert.data.arrays import FloatArray, IntArray
from facert.data.normalisation import Normalisation
from facert.data.regions import MOST
from facert.errors import InputError
from facert.methods.base import (
    Labelled,
    Method,
    Prediction,
    Stream,
    TrainingReport,
    Unlabelled,
    WarmStart,
)
from facert.methods.dense import is_dense
from facert.methods.registry import make_method
from facert.models.leading_directions import DENSE
from facert.models.optim.monitor import Monitor
from facert.settings import Settings

WHOLE = 1e-9  # by which the weights of a control may miss 1


@dataclass(frozen=True, eq=False)
class RegionLayout(ArrayGroup):
    """The columns of normalised arrays that each of r regions sees and moves, and its units."""

    # (r, d_x): 1 for what a region sees of the source, else 0
    columns: Annotated[FloatArray, "rx"]
    # (r, d_y): Its weight in each control; 0 for those that it does not move. They sum to 1 over
    # regions.
    weights: Annotated[FloatArray, "ry"]
    # (r, 2): Normalised units of the region in those of the face, of source and target
    units: Annotated[FloatArray, "r2"]
    # (r, 2): σ_c and the noise floor of the source, in the region's units
    noise: Annotated[FloatArray, "r2"]

    def __post_init__(self) -> None:
        super().__post_init__()
        if len(self.columns) > MOST:
            raise InputError("layout", f"at most {MOST} regions", f"{len(self.columns)}", DAMAGED)
        if not self.columns.any(axis=1).all() or not self.weights.any(axis=1).all():
            raise InputError("layout", "regions that see and move something", "another", DAMAGED)
        if (self.weights < 0).any() or (np.abs(self.weights.sum(axis=0) - 1.0) > WHOLE).any():
            raise InputError("layout.weights", "weights that sum to 1", "others", DAMAGED)
        if not (self.units > 0).all():
            raise InputError("layout.units", "numbers above 0", "others", DAMAGED)


@dataclass(frozen=True)
class _RegionMethod:
    """One region: its method, what of the face it sees and moves, and its units."""

    method: Method
    columns: IntArray
    controls: IntArray
    source_unit: float
    target_unit: float

    def labelled(self, whole: Labelled) -> Labelled:
        return Labelled(self._frames(whole.X), self._poses(whole.Y))

    def unlabelled(self, whole: Unlabelled) -> Unlabelled:
        bounds = None if whole.bounds is None else self._poses(whole.bounds)
        return Unlabelled(self._frames(whole.X), self._poses(whole.Y), bounds)

    def observed(
        self, X: FloatArray, input_variance: FloatArray | None
    ) -> tuple[FloatArray, FloatArray | None]:
        """Frames and the variance of what was filled in, in the region's units."""
        if input_variance is None:
            return self._frames(X), None
        return self._frames(X), input_variance.take(self.columns, axis=1) / self.source_unit**2

    def pose_figures(self, report: TrainingReport) -> dict[str, float]:
        """Errors that the region reports, in the units of the face."""
        return {name: value * self.target_unit for name, value in report.pose_figures.items()}

    def in_face_units(self, own: Prediction) -> Prediction:
        std = None if own.std is None else own.std * self.target_unit
        return Prediction(own.Y * self.target_unit, std, own.X * self.source_unit)

    def begin_at(self, old: _RegionMethod, source: Normalisation, target: Normalisation) -> None:
        """Let the method begin at the old one, with the region's part of the face's units."""
        assert isinstance(self.method, WarmStart)
        self.method.begin_at(
            old.method,
            _of_region(source, self.columns, old.source_unit, self.source_unit),
            _of_region(target, self.controls, old.target_unit, self.target_unit),
        )

    # take, unlike an index, keeps the order in memory: sums of all columns come out the same.

    def _frames(self, X: FloatArray) -> FloatArray:
        return X.take(self.columns, axis=1) / self.source_unit

    def _poses(self, Y: FloatArray) -> FloatArray:
        return Y.take(self.controls, axis=1) / self.target_unit


class Regional:
    """The method of the settings, once a region.

    Parameters
    ----------
    settings : Settings
        With regions, for their names.
    layout : RegionLayout, optional
        Layout of the same regions in the same order; `load` finds it in the file.
    """

    most_unlabelled: ClassVar[int | None] = None
    stepwise: ClassVar[bool] = False

    def __init__(self, settings: Settings, layout: RegionLayout | None = None) -> None:
        self.settings = settings
        if layout is not None:
            self._set_layout(layout, layout.columns.sum(axis=1) > DENSE)

    @property
    def dimensions(self) -> tuple[int, int]:
        """d_x and d_y of the face."""
        return self.layout_.columns.shape[1], self.layout_.weights.shape[1]

    def begin_at(self, other: Method, source: Normalisation, target: Normalisation) -> None:
        """Let each region begin at its own; see `WarmStart.begin_at`."""
        assert isinstance(other, Regional)
        for part, old in zip(self.parts_, other.parts_, strict=True):
            part.begin_at(old, source, target)

    def fit(
        self,
        labelled: Labelled,
        unlabelled: Unlabelled,
        monitor: Monitor | None = None,  # noqa: ARG002  regions would look alike to it
    ) -> TrainingReport:
        """Train the method of each region on its part of the data.

        Parameters
        ----------
        labelled, unlabelled : Labelled, Unlabelled
            Data of the whole face, normalised and complete.
        monitor : Monitor, optional
            Not used.

        Raises
        ------
        KeyboardInterrupt
            When the training of a region was interrupted: the others have none.
        """
        reports = []
        for part in self.parts_:
            report = part.method.fit(part.labelled(labelled), part.unlabelled(unlabelled))
            if report.result is not None and report.result.status == "interrupted":
                raise KeyboardInterrupt
            reports.append(report)
        errors = [part.pose_figures(r) for part, r in zip(self.parts_, reports, strict=True)]
        figures = [report.figures for report in reports]
        names = self._names
        return TrainingReport(
            figures=_together(names, figures), pose_figures=_together(names, errors)
        )

    def predict(self, frames: FloatArray, input_variance: FloatArray | None = None) -> Prediction:
        """Map frames (T, d_x), each on its own; NaN: not observed. See `Method.predict`."""
        own = [part.method.predict(*part.observed(frames, input_variance)) for part in self.parts_]
        return self._blend(own, frames)

    def on(self, device: str) -> Self:
        """A copy with every region's method on the device; see `Method.on`."""
        return self._with([part.method.on(device) for part in self.parts_])

    def unclipped(self) -> Self:
        """A copy with every region's method without limits; see `Method.unclipped`."""
        return self._with([part.method.unclipped() for part in self.parts_])

    def _with(self, methods: Sequence[Method]) -> Self:
        """A copy with other methods for the regions."""
        other = copy(self)
        parts = zip(self.parts_, methods, strict=True)
        other.parts_ = [replace(part, method=method) for part, method in parts]
        return other

    def stream(self) -> Stream:
        """Begin to map frames one after the other, a stream a region."""
        return _RegionalStream(self)

    def save(self) -> dict[str, FloatArray]:
        """The layout, and what each method learned."""
        arrays = {f"layout.{name}": array for name, array in self.layout_.arrays.items()}
        for index, part in enumerate(self.parts_):
            arrays |= {f"{index}.{name}": array for name, array in part.method.save().items()}
        return arrays

    def check(self, arrays: Mapping[str, Shaped]) -> tuple[int, int]:
        """Dimensions d_x and d_y of arrays that `load` could take over; see `Method.check`.

        Which columns a region has, the numbers of the layout say: here they are no more than all.
        """
        parts = [f"{index}." for index in range(len(self._names))]
        layout = {f"layout.{name}": letters for name, letters in RegionLayout.all_axes().items()}
        require_known_arrays([n for n in arrays if not n.startswith(tuple(parts))], layout)
        sizes = check_axes(arrays, layout)
        self._require_count(sizes["r"])
        whole = replace(self.settings, regions=None)
        for name, part in zip(self._names, parts, strict=True):
            own = part_of(arrays, part)
            d_x, d_y = make_method(whole, is_dense(own)).check(own)
            if d_x > sizes["x"] or d_y > sizes["y"]:
                expected = f"at most {sizes['x']} and {sizes['y']} columns"
                raise InputError(f"region {name}", expected, f"{d_x} and {d_y}", DAMAGED)
        return sizes["x"], sizes["y"]

    def load(self, arrays: Mapping[str, FloatArray]) -> None:
        """Take over what `save` returned.

        Raises
        ------
        InputError
            When an array is absent or the shapes do not fit together.
        """
        self.check(arrays)
        own = [part_of(arrays, f"{index}.") for index in range(len(self._names))]
        self._set_layout(RegionLayout.of(arrays, "layout."), [is_dense(part) for part in own])
        for index, part in enumerate(self.parts_):
            part.method.load(own[index])
            if part.method.dimensions != (len(part.columns), len(part.controls)):
                expected = f"{len(part.columns)} and {len(part.controls)} columns"
                found = f"{part.method.dimensions}"
                raise InputError(f"region {self._names[index]}", expected, found, DAMAGED)

    @property
    def _names(self) -> Sequence[str]:
        regions = self.settings.regions
        return [] if regions is None or isinstance(regions, str) else regions.names

    def _require_count(self, count: int) -> None:
        if count != len(self._names):
            raise InputError("layout", f"{len(self._names)} regions", f"{count}", DAMAGED)

    def _set_layout(self, layout: RegionLayout, dense: Iterable[bool]) -> None:
        self._require_count(len(layout.columns))
        self.layout_ = layout
        self.parts_ = [self._part(index, bool(own)) for index, own in enumerate(dense)]

    def _part(self, index: int, dense: bool) -> _RegionMethod:
        layout = self.layout_
        sigma_c, floor = layout.noise[index].tolist()
        own = replace(self.settings, regions=None, sigma_c=sigma_c, source_noise_floor=floor)
        return _RegionMethod(
            make_method(own, dense),
            np.flatnonzero(layout.columns[index]),
            np.flatnonzero(layout.weights[index]),
            *layout.units[index].tolist(),
        )

    def _blend(self, predictions: Sequence[Prediction], frames: FloatArray) -> Prediction:
        """Blend the regions' predictions of frames (T, d_x); source that no region sees is kept."""
        poses = np.zeros((len(frames), self.layout_.weights.shape[1]))
        variances, seen = np.zeros_like(poses), np.zeros_like(frames)
        has_std = all(prediction.std is not None for prediction in predictions)
        for part, weights, own in zip(self.parts_, self.layout_.weights, predictions, strict=True):
            face, w = part.in_face_units(own), weights[part.controls]
            poses[:, part.controls] += w * face.Y
            seen[:, part.columns] += face.X
            if face.std is not None:
                variances[:, part.controls] += w * face.std**2
        eyes = self.layout_.columns.sum(axis=0)
        source = np.where(eyes > 0, seen / np.maximum(eyes, 1.0), frames)
        return Prediction(poses, np.sqrt(variances) if has_std else None, source)


def untrained_method(settings: Settings, dense: bool, layout: RegionLayout | None = None) -> Method:
    """The method of the settings; with regions, one that has it for each of them.

    Without a layout, a regional method is ready for `Method.load` alone. Of a dense source the
    method, or that of a region that is dense itself, sees the leading directions.
    """
    if settings.regions is not None:
        return Regional(settings, layout)
    return make_method(settings, dense)


def _of_region(face: Normalisation, columns: IntArray, old: float, new: float) -> Normalisation:
    """Convert the face's units, relative to its old ones, to those of a region."""
    return Normalisation(face.mean[columns] / old, face.scale * new / old)


class _RegionalStream:
    """Maps frames one after the other, with a stream a region."""

    def __init__(self, method: Regional) -> None:
        self.method = method
        self.streams = [part.method.stream() for part in method.parts_]

    def step(self, frame: FloatArray, input_variance: FloatArray | None = None) -> Prediction:
        """Map one more frame (1, d_x)."""
        parts = zip(self.streams, self.method.parts_, strict=True)
        own = [stream.step(*part.observed(frame, input_variance)) for stream, part in parts]
        return self.method._blend(own, frame)


def _together(names: Sequence[str], regions: Sequence[Mapping[str, float]]) -> dict[str, float]:
    """Join the regions' figures: shared ones once, the rest under the regions' names."""
    first, *others = regions
    common = {
        name: value for name, value in first.items() if all(o.get(name) == value for o in others)
    }
    own = {
        f"{name}: {figure}": value
        for name, figures in zip(names, regions, strict=True)
        for figure, value in figures.items()
        if figure not in common
    }
    return {**common, **own}

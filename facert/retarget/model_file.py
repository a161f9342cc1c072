"""Model files: everything that retargeting needs, in one safetensors file.

What is written is read again before it takes the place of an older file: there is no model file
that cannot be loaded.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from facert.data.array_group import Shaped, check_axes, part_of, require_known_arrays
from facert.data.arrays import FloatArray
from facert.data.normalisation import Normalisation
from facert.data.take import Controls, SourceKind
from facert.data.typed import require_type
from facert.data.version import VERSION
from facert.errors import InputError, NumericalError, reading
from facert.io.guarded import parsing
from facert.io.registry import format_of
from facert.io.tensors import FIX, read_tensors, write_tensors
from facert.methods.base import Method
from facert.methods.dense import is_dense
from facert.preprocess.known_poses import MOST
from facert.preprocess.motion.motion import FACTORS, Motion
from facert.preprocess.source_layout import SourceLayout
from facert.regions.regional import untrained_method
from facert.retarget.model import TrainedModel
from facert.settings import Settings

FORMAT = "facert-model"
NO_LIMIT = float(np.finfo(np.float64).max)
DUE = {"source.mean": "x", "source.scale": "1", "target.mean": "y", "target.scale": "1"}
OPTIONAL = {
    "source.neutral": "x",
    "source.labelled": "lx",
    "target.poses": "ny",
    "target.limits": "y2",
    "target.bounds": "y2",
}
"""Shapes of the arrays that are not the method's or the motion's: x for d_x, y for d_y."""
Model = TypeVar("Model", bound=TrainedModel)


@dataclass(frozen=True)
class ModelMetadata:
    """What a model file says beside its arrays."""

    source_kind: SourceKind
    source_names: tuple[str, ...]
    target_names: tuple[str, ...]
    settings: Mapping[str, Any]  # `Settings` looks at them itself
    units: str = ""
    # How training went; None for a number that is not finite
    figures: Mapping[str, Any] = field(default_factory=dict)
    # Releases before 0.2 counted the labels in the figures alone, and left out the rest
    labels: int | None = None
    takes: tuple[str, ...] = ()
    motion_scale: float | None = None
    versions: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        own = {name: _figure(name, value) for name, value in self.figures.items()}
        object.__setattr__(self, "figures", own)
        labels = self.counted_labels
        if not isinstance(labels, (int, float)) or labels < 0 or labels % 1:
            raise _misfit("the metadata/labels", "a count", f"{labels!r}")

    @classmethod
    def of(cls, model: TrainedModel) -> ModelMetadata:
        """The metadata of a model."""
        return cls(
            source_kind=model.source_kind,
            source_names=model.source_names,
            target_names=model.controls.names,
            settings=model.settings.as_dict(),
            units=_plain(model.units),
            figures={_plain(name): value for name, value in model.facts["figures"].items()},
            labels=model.labels,
            takes=tuple(map(_plain, model.takes)),
            motion_scale=None if model.motion is None else model.source_units.scale,
            versions=library_versions(),
        )

    @property
    def columns(self) -> tuple[int, int]:
        """d_x and d_y, by the names."""
        return len(self.source_names) * (3 if self.source_kind == "markers" else 1), len(
            self.target_names
        )

    @property
    def counted_labels(self) -> Any:
        """Posed frames that it was trained on."""
        return self.figures.get("labelled frames", 0) if self.labels is None else self.labels


def write_model(model: TrainedModel, path: Path, overwrite: bool) -> None:
    """Write everything to one safetensors file.

    Raises
    ------
    OutputExistsError
        When the file exists and `overwrite` is false.
    InputError
        When what was written is not a model that can be read again.
    NumericalError
        When the model gives no finite poses for the frames that it learned from.
    """
    arrays, metadata = _arrays(model), ModelMetadata.of(model)

    def read_again(written: Path) -> None:
        found = read_model(written, TrainedModel)
        same = _arrays(found)
        if ModelMetadata.of(found) != metadata or same.keys() != arrays.keys():
            raise _misfit("the metadata", "what was written", "something else")
        other = next((n for n in arrays if not np.array_equal(arrays[n], same[n])), None)
        if other is not None:
            raise _misfit(other, "what was written", "something else")
        if model.labelled is not None:
            _require_finite_poses(found, model.labelled)

    try:
        write_tensors(path, arrays, metadata, FORMAT, overwrite, read_again)
    except InputError as error:
        if error.fix != FIX:
            raise
        error.where, error.fix = str(path), "Check names, units and limits of what it learned from."
        raise


def _arrays(model: TrainedModel) -> dict[str, FloatArray]:
    """All arrays of a model, as its file holds them."""
    known = np.isfinite(model.neutral).all()  # an earlier release did not know the actor at rest
    optional = {
        "target.limits": _stored(model.controls.limits),
        "target.bounds": _stored(model.bounds),
        "target.poses": model.poses,
        "source.neutral": model.neutral if known else None,
        "source.labelled": model.labelled,
    }
    arrays = {f"method.{name}": array for name, array in model.method.save().items()}
    arrays |= {name: array for name, array in optional.items() if array is not None}
    for view, units in (("source", model.source_units), ("target", model.target_units)):
        arrays |= {f"{view}.mean": units.mean, f"{view}.scale": np.array([units.scale])}
    if model.motion is not None:
        arrays |= {f"motion.{n}": array for n, array in model.motion.arrays.items()}
    return arrays


def _require_finite_poses(model: TrainedModel, frames: FloatArray) -> None:
    with np.errstate(all="ignore"):
        poses = model.method.predict(model.source_units.apply(frames)).Y
    if not np.isfinite(poses).all():
        raise NumericalError("the model gives no finite poses for frames that it learned from")


def _figure(name: str, value: object) -> float | str | None:
    if isinstance(value, float) and not math.isfinite(value):
        return None
    plain = _plain(value) if isinstance(value, str) else value
    found: float | str | None = require_type(
        float | str | None, plain, f"the metadata/figures/{name}", FIX
    )
    return found


def _plain(text: str) -> str:
    """Text that UTF-8 can hold: file names need not be such."""
    return text.encode("utf-8", "backslashreplace").decode()


def _stored(limits: FloatArray | None) -> FloatArray | None:
    """Limits as a file holds them: its numbers are finite."""
    return None if limits is None else np.clip(limits, -NO_LIMIT, NO_LIMIT)


def _limits_of(stored: FloatArray | None) -> FloatArray | None:
    """The limits that a file holds, infinite where there is none."""
    if stored is None:
        return None
    return np.where(np.abs(stored) < NO_LIMIT, stored, np.copysign(np.inf, stored))


def read_model(path: Path, make: type[Model]) -> Model:
    """Read a model from its file, as a `TrainedModel` or a class that adds to it.

    Raises
    ------
    InputError
        When the file is missing, damaged, not a model, or does not fit together.
    """
    if not path.exists():
        fix = "Give the model with -m, or make it: facert train."
        raise InputError("model", "a file that train wrote", "nothing", fix, str(path))
    found = format_of(path, "read", "take", "rig")
    if found is not None:
        fix = "Give the model itself with -m; facert pose learns from a take by --poses."
        known = f"a take or a rig ({found.endings[0]})"
        raise InputError("model", "a file that train wrote", known, fix, str(path))
    methods: list[Method] = []

    def check(declared: Mapping[str, Shaped], metadata: ModelMetadata) -> None:
        methods.append(_untrained(metadata, is_dense(part_of(declared, "method."))))
        _check_shapes(declared, metadata, methods[0])

    arrays, metadata = read_tensors(path, FORMAT, ModelMetadata, check)
    # Whatever goes wrong from here on is in the numbers.
    with reading(path), _damage(), np.errstate(all="ignore"):
        (method,) = methods
        method.load(part_of(arrays, "method."))
        return _made(make, path.name, arrays, metadata, method)


@contextmanager
def _damage() -> Iterator[None]:
    """Whatever goes wrong with the numbers of a file is the file's fault."""
    with parsing("the model", "numbers that go together", FIX):
        try:
            yield
        except NumericalError as error:
            raise ValueError(str(error)) from error


def _made(
    make: type[Model],
    name: str,
    arrays: Mapping[str, FloatArray],
    metadata: ModelMetadata,
    method: Method,
) -> Model:
    """The model of arrays whose shapes fit together."""
    limits, bounds = (_limits_of(arrays.get(f"target.{name}")) for name in ("limits", "bounds"))
    controls = Controls(metadata.target_names, limits)
    source_units, target_units = (_units(arrays, view) for view in ("source", "target"))
    scale = source_units.scale
    if metadata.motion_scale not in (None, scale):
        raise _misfit("motion", f"the unit of the source, {scale}", f"{metadata.motion_scale}")
    if len(set(metadata.source_names)) < len(metadata.source_names):
        raise _misfit("source_names", "names that are all different", "one of them twice")
    return make(
        method=method,
        layout=SourceLayout(metadata.source_kind, metadata.source_names),
        units=metadata.units,
        controls=controls,
        bounds=Controls(controls.names, bounds).limits,
        source_units=source_units,
        target_units=target_units,
        figures={n: math.nan if f is None else f for n, f in metadata.figures.items()},
        neutral=arrays.get("source.neutral", np.full(source_units.mean.shape, np.nan)),
        labels=int(metadata.counted_labels),
        poses=arrays.get("target.poses"),
        motion=_motion(part_of(arrays, "motion.")),
        labelled=arrays.get("source.labelled"),
        name=name,
        takes=metadata.takes,
    )


def _untrained(metadata: ModelMetadata, dense: bool) -> Method:
    """The method that a file is of."""
    settings = Settings().with_changes(dict(metadata.settings))
    try:
        return untrained_method(settings, dense)
    except InputError as error:
        error.fix = "Install the facert that wrote it."
        raise


def _check_shapes(declared: Mapping[str, Shaped], metadata: ModelMetadata, method: Method) -> None:
    """Refuse a file whose parts disagree: mapping would fail, or worse, not fail."""
    columns = metadata.columns
    sizes = {"x": columns[0], "y": columns[1], "1": 1, "2": 2}
    for name, letters in {**DUE, **OPTIONAL}.items():
        if name in declared or name in DUE:
            _check_shape(declared.get(name), [sizes.get(letter) for letter in letters], name)
    parts = "method.", "motion."
    require_known_arrays([n for n in declared if not n.startswith(parts)], {**DUE, **OPTIONAL})
    _check_motion(part_of(declared, "motion."), columns[0])
    learned = method.check(part_of(declared, "method."))
    for view, count, found in zip(("source", "target"), columns, learned, strict=True):
        if found != count:
            raise _misfit(f"{view}.observations", f"{count} columns", f"{found}")
    for name, most in (("target.poses", MOST), ("source.labelled", metadata.counted_labels)):
        rows = declared[name].shape[0] if name in declared else 0
        if rows > most:
            raise _misfit(name, f"at most {most} rows", f"{rows}")


def _check_shape(array: Shaped | None, sizes: list[int | None], name: str) -> None:
    """Check the shape of an array; None stands for any size above 0."""
    expected = f"{sizes[-1]} numbers" if len(sizes) == 1 else f"{sizes[-1]} columns"
    if array is None:
        raise _misfit(name, expected, "nothing")
    shape = array.shape
    fits = len(shape) == len(sizes) and 0 not in shape
    if not fits or any(due not in (None, size) for due, size in zip(sizes, shape, strict=True)):
        raise _misfit(name, expected, f"shape {shape}")


def _check_motion(declared: Mapping[str, Shaped], columns: int) -> None:
    if not declared:
        return
    axes = Motion.all_axes()
    require_known_arrays(declared, axes)
    sizes = check_axes(declared, axes)
    if sizes["x"] != columns:
        raise _misfit("motion.rest", f"{columns} numbers", f"{sizes['x']}")
    if sizes["q"] > FACTORS:
        raise _misfit("motion.rates", f"at most {FACTORS} numbers", f"{sizes['q']}")


def _motion(own: Mapping[str, FloatArray]) -> Motion | None:
    """The motion of the source; None where the frames of the take did not follow each other."""
    if not own:
        return None
    motion = Motion.of(own)
    positive = (motion.rates, motion.rest, motion.rest_rates, motion.clock, motion.factors.noise)
    if not all((array > 0.0).all() for array in positive):
        raise _misfit("motion", "numbers above 0", "others")
    return motion


def _units(arrays: Mapping[str, FloatArray], view: str) -> Normalisation:
    scale = float(arrays[f"{view}.scale"].item())
    if not scale > 0.0:
        raise _misfit(f"{view}.scale", "a number above 0", f"{scale}")
    return Normalisation(arrays[f"{view}.mean"], scale)


def library_versions() -> dict[str, str]:
    """Versions of the libraries that computed a result, for its metadata."""
    others = {name: version(name) for name in ("torch", "numpy", "scipy")}
    return {"facert": VERSION, **others}


def _misfit(field: str, expected: str, found: str) -> InputError:
    return InputError(field, expected, found, FIX)

"""Model files: everything that retargeting needs, in one safetensors file."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any, TypeVar, get_args

import numpy as np

from facert.data.array_group import check_axes
from facert.data.arrays import FloatArray
from facert.data.normalisation import Normalisation
from facert.data.take import Controls, SourceKind
from facert.data.version import CREATED_BY
from facert.errors import InputError, reading
from facert.io.tensors import read_tensors, write_tensors
from facert.preprocess.motion.motion import Motion
from facert.preprocess.source_layout import SourceLayout
from facert.regions.regional import untrained_method
from facert.retarget.model import TrainedModel
from facert.settings import Settings

FORMAT = "facert-model"
NO_LIMIT = float(np.finfo(np.float64).max)
Model = TypeVar("Model", bound=TrainedModel)


def write_model(model: TrainedModel, path: Path, overwrite: bool) -> None:
    """Write everything to one safetensors file.

    Raises
    ------
    OutputExistsError
        When the file exists and `overwrite` is false.
    """
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
    metadata = {
        "format": FORMAT,
        "format_version": 1,
        "created_by": CREATED_BY,
        "versions": library_versions(),
        "labels": model.labels,
        "takes": list(model.takes),
        **model.facts,
    }
    if model.motion is not None:
        arrays |= {f"motion.{n}": array for n, array in model.motion.arrays.items()}
        metadata["motion_scale"] = model.source_units.scale
    write_tensors(path, arrays, metadata, overwrite)


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
    arrays, metadata = read_tensors(path, FORMAT)
    with reading(path):
        try:
            settings = Settings().with_changes(metadata["settings"])
            kind, names = metadata["source_kind"], tuple(map(str, metadata["source_names"]))
            limits, bounds = (
                _limits_of(arrays.get(f"target.{name}")) for name in ("limits", "bounds")
            )
            controls = Controls(tuple(metadata["target_names"]), limits)
            bounds = Controls(controls.names, bounds).limits
            figures = dict(metadata.get("figures", {}))
            # Earlier releases counted the labels in the figures alone.
            labels = _count(metadata.get("labels") or figures.get("labelled frames", 0))
            source_units, target_units = (
                Normalisation(arrays[f"{view}.mean"], float(arrays[f"{view}.scale"].item()))
                for view in ("source", "target")
            )
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise InputError(
                "the metadata", "a complete model", f"{error!r}", "Train the model again."
            ) from None
        try:
            method = untrained_method(settings)
        except InputError as error:
            error.fix = "Install the facert that wrote it."
            raise
        method.load(
            {n.removeprefix("method."): a for n, a in arrays.items() if n.startswith("method.")}
        )
        model = make(
            method=method,
            layout=SourceLayout(kind, names),
            units=str(metadata.get("units", "")),
            controls=controls,
            bounds=bounds,
            source_units=source_units,
            target_units=target_units,
            figures=figures,
            neutral=arrays.get("source.neutral", np.full(source_units.mean.shape, np.nan)),
            labels=labels,
            poses=arrays.get("target.poses"),
            motion=_motion(arrays),
            labelled=arrays.get("source.labelled"),
            name=path.name,
            takes=_texts(metadata.get("takes")),
        )
        _check_fit(model, arrays, metadata)
    return model


def _count(value: object) -> int:
    if not isinstance(value, (int, float)) or value != abs(value) or value % 1:
        raise ValueError(f"{value!r} labels")
    return int(value)


def _texts(value: object) -> tuple[str, ...]:
    """A list of text; earlier releases wrote none."""
    return tuple(map(str, value)) if isinstance(value, list) else ()


def _motion(arrays: Mapping[str, FloatArray]) -> Motion | None:
    """The motion of the source; None where the frames of the take did not follow each other."""
    own = {n.removeprefix("motion."): a for n, a in arrays.items() if n.startswith("motion.")}
    if not own:
        return None
    check_axes(own, Motion.all_axes())
    motion = Motion.of(own)
    positive = (motion.rates, motion.rest, motion.rest_rates, motion.clock, motion.factors.noise)
    if not all((array > 0.0).all() for array in positive):
        raise _misfit("motion", "numbers above 0", "others")
    return motion


def library_versions() -> dict[str, str]:
    """Versions of the libraries that computed a result, for its metadata."""
    return {name: version(name) for name in ("facert", "torch", "numpy", "scipy")}


def _check_fit(
    model: TrainedModel, arrays: Mapping[str, FloatArray], metadata: Mapping[str, Any]
) -> None:
    """Refuse a file whose parts disagree: mapping would fail, or worse, not fail."""
    kind, names = model.source_kind, model.source_names
    if kind not in get_args(SourceKind):
        raise _misfit("source_kind", "markers or weights", repr(kind))
    if len(set(names)) < len(names):
        raise _misfit("source_names", "names that are all different", "one of them twice")
    columns = len(names) * (3 if kind == "markers" else 1), len(model.controls.names)
    _check_rows(model.poses, columns[1], "target.poses")
    _check_rows(model.labelled, columns[0], "source.labelled")
    for view, count, learned in zip(
        ("source", "target"), columns, model.method.dimensions, strict=True
    ):
        mean, scale = arrays[f"{view}.mean"], arrays[f"{view}.scale"]
        if mean.shape != (count,):
            raise _misfit(f"{view}.mean", f"{count} numbers", f"shape {mean.shape}")
        if learned != count:
            raise _misfit(f"{view}.observations", f"{count} columns", f"{learned}")
        if not scale.item() > 0.0:
            raise _misfit(f"{view}.scale", "a number above 0", f"{scale.item()}")
    if model.neutral.shape != columns[:1]:
        raise _misfit("source.neutral", f"{columns[0]} numbers", f"{model.neutral.shape}")
    if model.motion is not None and len(model.motion.rest) != columns[0]:
        raise _misfit("motion.rest", f"{columns[0]} numbers", f"{len(model.motion.rest)}")
    unit = metadata.get("motion_scale", model.source_units.scale)  # earlier releases left it out
    if unit != model.source_units.scale:
        raise _misfit("motion", f"the unit of the source, {model.source_units.scale}", f"{unit}")


def _check_rows(rows: FloatArray | None, columns: int, field: str) -> None:
    """Check the columns of optional rows: a file of an earlier version has none."""
    if rows is not None and (rows.ndim != 2 or rows.shape[1] != columns):
        raise _misfit(field, f"{columns} columns", f"shape {rows.shape}")


def _misfit(field: str, expected: str, found: str) -> InputError:
    return InputError(field, expected, found, "Train the model again.")

"""Model files: everything that retargeting needs, in one safetensors file."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path
from typing import TypeVar, get_args

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
Model = TypeVar("Model", bound=TrainedModel)


def write_model(model: TrainedModel, path: Path, overwrite: bool) -> None:
    """Write everything to one safetensors file.

    Raises
    ------
    OutputExistsError
        When the file exists and `overwrite` is false.
    """
    arrays = {f"method.{name}": array for name, array in model.method.save().items()}
    for view, units in (("source", model.source_units), ("target", model.target_units)):
        arrays[f"{view}.mean"] = units.mean
        arrays[f"{view}.scale"] = np.array([units.scale])
    if model.controls.limits is not None:
        arrays["target.limits"] = model.controls.limits
    if model.bounds is not None:
        arrays["target.bounds"] = model.bounds
    if model.poses is not None:
        arrays["target.poses"] = model.poses
    if np.isfinite(model.neutral).all():  # else an earlier version did not know it
        arrays["source.neutral"] = model.neutral
    if model.labelled is not None:
        arrays["source.labelled"] = model.labelled
    if model.motion is not None:
        arrays |= {f"motion.{n}": array for n, array in model.motion.arrays.items()}
    metadata = {
        "format": FORMAT,
        "format_version": 1,
        "created_by": CREATED_BY,
        "versions": library_versions(),
        **model.facts,
    }
    write_tensors(path, arrays, metadata, overwrite)


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
            controls = Controls(tuple(metadata["target_names"]), arrays.get("target.limits"))
            bounds = Controls(controls.names, arrays.get("target.bounds")).limits
            figures = dict(metadata.get("figures", {}))
            source_units, target_units = (
                Normalisation(arrays[f"{view}.mean"], float(arrays[f"{view}.scale"].item()))
                for view in ("source", "target")
            )
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise InputError(
                "the metadata", "a complete model", f"{error!r}", "Train the model again."
            ) from None
        method = untrained_method(settings)
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
            poses=arrays.get("target.poses"),
            motion=_motion(arrays),
            labelled=arrays.get("source.labelled"),
        )
        _check_fit(model, arrays)
    return model


def _motion(arrays: Mapping[str, FloatArray]) -> Motion | None:
    """A take in which nothing could be told of motion leaves none."""
    own = {n.removeprefix("motion."): a for n, a in arrays.items() if n.startswith("motion.")}
    if not own:
        return None
    check_axes(own, Motion.all_axes())
    positive = [own[name] for name in ("rates", "rest", "rest_rates", "clock", "factors.noise")]
    if not all((array > 0.0).all() for array in positive):
        raise _misfit("motion", "numbers above 0", "others")
    return Motion.of(own)


def library_versions() -> dict[str, str]:
    """Versions of what computed a result, for its metadata."""
    return {name: version(name) for name in ("facert", "torch", "numpy", "scipy")}


def _check_fit(model: TrainedModel, arrays: Mapping[str, FloatArray]) -> None:
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


def _check_rows(rows: FloatArray | None, columns: int, field: str) -> None:
    """A file of an earlier version has none."""
    if rows is not None and (rows.ndim != 2 or rows.shape[1] != columns):
        raise _misfit(field, f"{columns} columns", f"shape {rows.shape}")


def _misfit(field: str, expected: str, found: str) -> InputError:
    return InputError(field, expected, found, "Train the model again.")

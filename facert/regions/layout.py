"""The layout of named regions in columns of normalised arrays."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from facert.data.arrays import BoolArray, FloatArray
from facert.data.normalisation import Normalisation
from facert.data.regions import Region, Regions
from facert.data.take import Source
from facert.errors import InputError
from facert.methods.noise import enough, with_noise
from facert.preprocess.preparation import TrainingData
from facert.regions.automatic import label_errors
from facert.regions.regional import RegionLayout
from facert.settings import Settings

FAULTLESS = 1e-9  # least error of a region, relative to the variance of the control


def lay_out(regions: Regions, data: TrainingData, settings: Settings) -> RegionLayout:
    """The layout of regions.

    Those that share a control have a weight in it by how well their markers predict it: the
    inverse of the leave-one-out mean squared error.

    Parameters
    ----------
    regions : Regions
        Spelled as in the take.
    data : TrainingData
    settings : Settings
        Noise that they leave open is expected from the frames, region by region.

    Raises
    ------
    InputError
        When nothing moves in a region.
    """
    source, poses = data.prepared.measured, data.poses
    columns = np.array([_columns(region, source) for region in regions.parts])
    members = np.array([np.isin(data.controls.names, part.controls) for part in regions.parts])
    units, noise, trust = [], [], []
    for region, seen, moved in zip(regions.parts, columns, members, strict=True):
        own = _units(source.matrix.compress(seen, axis=1), f"regions.{region.name}.markers")
        target = _units(poses.compress(moved, axis=1), f"regions.{region.name}.controls")
        unit = own.scale / data.prepared.units.scale
        expected = with_noise(
            _in_unit(settings, unit), own.apply(enough(data.complete.compress(seen, axis=1)))
        )
        units.append([unit, target.scale / data.target_units.scale])
        noise.append([expected.sigma_c, expected.source_noise_floor])
        trust.append(1.0 / _errors(data, seen))
    shares = members * np.array(trust)
    return RegionLayout(
        columns=columns.astype(np.float64),
        weights=shares / shares.sum(axis=0),
        units=np.array(units),
        noise=np.array(noise, dtype=np.float64),
    )


def _errors(data: TrainingData, seen: BoolArray) -> FloatArray:
    """The error of predicting each control from some columns, (P,); above 0."""
    frames, labelled = (X.compress(seen, axis=1) for X in (data.complete, data.chosen.X_labelled))
    found = label_errors(frames, labelled, data.poses[: len(labelled)])
    return np.maximum(found, FAULTLESS)


def _columns(region: Region, source: Source) -> BoolArray:
    """Which columns of the source's matrix a region sees, (d_x,)."""
    seen = np.isin(source.names, region.markers)
    return np.repeat(seen, source.matrix.shape[1] // len(source.names))


def _units(values: FloatArray, field: str) -> Normalisation:
    """Units of a region's values; raises InputError when nothing moves there."""
    try:
        return Normalisation.of(values, field)
    except InputError as error:
        fix = "Pose a frame in which it moves, or merge it with another region."
        raise InputError(field, error.expected, error.found, fix) from None


def _in_unit(settings: Settings, unit: float) -> Settings:
    """The settings with their noise in the units of a region instead of the face's."""
    sigma_c, floor = settings.sigma_c, settings.source_noise_floor
    return replace(
        settings,
        sigma_c=None if sigma_c is None else sigma_c / unit,
        source_noise_floor=None if floor is None else floor / unit**2,
    )

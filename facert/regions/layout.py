"""From named regions to columns of normalised arrays."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from facert.data.arrays import BoolArray, FloatArray
from facert.data.normalisation import Normalisation
from facert.data.regions import Region, Regions
from facert.data.take import Controls, Source
from facert.errors import InputError
from facert.methods.base import Method
from facert.methods.noise import with_noise
from facert.regions.label_errors import left_out_errors
from facert.regions.regional import Layout, untrained_method
from facert.settings import Settings

FAULTLESS = 1e-9  # least error of a region, relative to the variance of the control


@dataclass(frozen=True, eq=False)
class FaceData:
    """What of a take tells the units and the noise of its regions.

    Parameters
    ----------
    source, controls : Source, Controls
    poses : array, shape (n, P)
        That are known, in the controls' units; those of the labelled frames first.
    labelled : array, shape (l, d_x)
        In the units of the source.
    complete : array, shape (m, d_x)
        Frames that show everything, in the units of the source.
    """

    source: Source
    controls: Controls
    poses: FloatArray
    labelled: FloatArray
    complete: FloatArray


def method_for(settings: Settings, given: Settings, face: FaceData) -> Method:
    """The method of the settings, untrained; with regions, one that has it for each of them.

    Parameters
    ----------
    settings, given : Settings
        With the noise of the face filled in, and as they were before that.
    face : FaceData
        Of the take to train on.

    Raises
    ------
    InputError
        When there is none of that name, or nothing moves in a region.
    """
    regions = settings.regions
    layout = lay_out(regions, face, given) if isinstance(regions, Regions) else None
    return untrained_method(settings, layout)


def lay_out(regions: Regions, face: FaceData, settings: Settings) -> Layout:
    """The layout of regions.

    Those that share a control have a weight in it by how well their markers predict it: the
    inverse of the mean squared error at labels left out.

    Parameters
    ----------
    regions : Regions
        Spelled as in the take.
    face : FaceData
    settings : Settings
        Noise that they leave open is expected from the frames, region by region.

    Raises
    ------
    InputError
        When nothing moves in a region.
    """
    source_unit = Normalisation.of(face.source.matrix, f"/source/{face.source.kind}").scale
    target_unit = Normalisation.of(face.poses, "/target/params").scale
    columns = np.array([_columns(region, face.source) for region in regions.parts])
    members = np.array([np.isin(face.controls.names, part.controls) for part in regions.parts])
    units, noise, trust = [], [], []
    for region, seen, moved in zip(regions.parts, columns, members, strict=True):
        own = _units(face.source.matrix.compress(seen, axis=1), f"regions.{region.name}.markers")
        target = _units(face.poses.compress(moved, axis=1), f"regions.{region.name}.controls")
        unit = own.scale / source_unit
        expected = with_noise(
            _in_unit(settings, unit), own.apply(face.complete.compress(seen, axis=1))
        )
        units.append([unit, target.scale / target_unit])
        noise.append([expected.sigma_c, expected.source_noise_floor])
        trust.append(1.0 / _errors(face, seen))
    shares = members * np.array(trust)
    return Layout(
        columns=columns.astype(np.float64),
        weights=shares / shares.sum(axis=0),
        units=np.array(units),
        noise=np.array(noise, dtype=np.float64),
    )


def _errors(face: FaceData, seen: BoolArray) -> FloatArray:
    """How badly some columns predict each control, (P,); above 0."""
    frames, labelled = (X.compress(seen, axis=1) for X in (face.complete, face.labelled))
    found = left_out_errors(frames, labelled, face.poses[: len(labelled)])
    return np.maximum(found, FAULTLESS)


def _columns(region: Region, source: Source) -> BoolArray:
    """Which columns of the source's matrix a region sees, (d_x,)."""
    seen = np.isin(source.names, region.markers)
    return np.repeat(seen, source.matrix.shape[1] // len(source.names))


def _units(values: FloatArray, field: str) -> Normalisation:
    """Of a region; raises InputError when nothing moves there."""
    try:
        return Normalisation.of(values, field)
    except InputError as error:
        fix = "Pose a frame in which it moves, or merge it with another region."
        raise InputError(field, error.expected, error.found, fix) from None


def _in_unit(settings: Settings, unit: float) -> Settings:
    """Noise that the settings tell, in units of the face, in those of a region."""
    sigma_c, floor = settings.sigma_c, settings.source_noise_floor
    return replace(
        settings,
        sigma_c=None if sigma_c is None else sigma_c / unit,
        source_noise_floor=None if floor is None else floor / unit**2,
    )

"""Takes and rigs that NumPy and h5py write without facert, as its documents describe them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np

from experiments.foreign.face import (
    FACES,
    FPS,
    MARKERS,
    NAMES,
    POSITIONS,
    SHAPES,
    TIME,
    VERTICES,
    WEIGHTS,
    markers_difference,
    rig_difference,
    weights_difference,
)
from experiments.foreign.trial import Trial
from facert.io.formats import read_rig_file, read_take_file

NUMPY, HDF5 = "numpy", "h5py"
_SHOWN = dict(zip(NAMES, SHAPES, strict=True))
_SINGLE = 1e-4
"""Millimetres of a marker in float32."""


def trials() -> list[Trial]:
    """Trials of arrays: .npz first."""
    return [
        Trial(NUMPY, "take.npz", "markers, rate", _npz_markers),
        Trial(NUMPY, "weights.npz", "weights, float32 with `time`", _npz_weights, 1e-6),
        Trial(NUMPY, "two.npz", "poses of one of two targets", _npz_targets),
        Trial(NUMPY, "rig.npz", "vertices", _npz_rig, 1e-7),
        Trial(HDF5, "take.h5", "markers, names as UTF-8", lambda at: _h5(at, _utf8())),
        Trial(HDF5, "bytes.h5", "markers, names of fixed bytes", lambda at: _h5(at, _fixed())),
        Trial(HDF5, "single.h5", "markers in float32", _h5_single, _SINGLE),
        Trial(HDF5, "mask.h5", "markers behind a mask of bytes", _h5_mask),
        Trial(HDF5, "rig.h5", "vertices, float32", _h5_rig, 1e-6),
        Trial(HDF5, "weights.h5", "weights, chunks of lzf", _h5_weights),
    ]


def _npz_markers(folder: Path) -> float:
    path = folder / "take.npz"
    np.savez(path, markers=POSITIONS, marker_names=np.array(MARKERS), fps=24)
    return markers_difference(read_take_file(path), POSITIONS, FPS)


def _npz_weights(folder: Path) -> float:
    path = folder / "weights.npz"
    weights = WEIGHTS.astype(np.float32)
    np.savez_compressed(path, weights=weights, weight_names=list(NAMES), time=TIME)
    return weights_difference(read_take_file(path), TIME, WEIGHTS)


def _npz_targets(folder: Path) -> float:
    path, targets = folder / "two.npz", {"units": WEIGHTS[:, :2], "arkit": WEIGHTS}
    names = {"unit_names": NAMES[:2], "arkit_names": NAMES}
    np.savez(path, markers=POSITIONS, marker_names=MARKERS, fps=24.0, **targets, **names)
    params = read_take_file(path, target="arkit").params
    return float(np.abs(params - WEIGHTS).max())


def _npz_rig(folder: Path) -> float:
    path = folder / "rig.npz"
    np.savez(path, neutral=VERTICES, faces=FACES.astype(np.int32), deltas=SHAPES, names=NAMES)
    return rig_difference(read_rig_file(path), VERTICES, _SHOWN)


def _utf8() -> Any:
    return np.array(MARKERS, dtype=object)


def _fixed() -> Any:
    return np.array(MARKERS, dtype="S8")


def _h5(folder: Path, names: Any, positions: Any = POSITIONS, **others: Any) -> float:
    path = folder / "take.h5"
    with h5py.File(path, "w") as file:
        file.attrs.update(format="facert-take", format_version=1, fps=24, units="mm")
        file["time"] = TIME
        file["source/markers"] = positions
        file["source/names"] = names
        for name, values in others.items():
            file[f"source/{name}"] = values
    hidden = np.isin(others.get("valid", np.ones(POSITIONS.shape[:2])), [0])
    expected = np.where(hidden[:, :, None], np.nan, POSITIONS)
    return markers_difference(read_take_file(path), expected, FPS)


def _h5_single(folder: Path) -> float:
    return _h5(folder, _utf8(), POSITIONS.astype(np.float32))


def _h5_mask(folder: Path) -> float:
    valid = np.ones(POSITIONS.shape[:2], dtype=np.uint8)
    valid[10:14, 2] = 0
    return _h5(folder, _utf8(), valid=valid)


def _h5_rig(folder: Path) -> float:
    path = folder / "rig.h5"
    with h5py.File(path, "w") as file:
        file.attrs.update(format="facert-rig", format_version=1, units="m")
        file["neutral"] = VERTICES.astype(np.float32)
        file["shapes"] = SHAPES.astype(np.float32)
        file["faces"] = FACES.astype(np.uint32)
        file["names"] = np.array(NAMES, dtype=h5py.string_dtype())
    return rig_difference(read_rig_file(path), VERTICES, _SHOWN)


def _h5_weights(folder: Path) -> float:
    path = folder / "weights.h5"
    with h5py.File(path, "w") as file:
        file.attrs.update(format="facert-take", format_version=np.int32(1), fps=np.float32(24))
        file["time"] = TIME
        file.create_dataset("source/weights", data=WEIGHTS, chunks=(16, 4), compression="lzf")
        file["source/names"] = list(NAMES)
    return weights_difference(read_take_file(path), TIME, WEIGHTS)

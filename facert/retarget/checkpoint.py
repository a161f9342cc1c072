"""Checkpoints of a training run, from which it continues as if it had not stopped."""

from __future__ import annotations

import logging
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from facert.data.array_group import Shaped, part_of
from facert.data.arrays import FloatArray
from facert.errors import InputError
from facert.io.atomic import Appended, write_text
from facert.io.guarded import read_text
from facert.io.registry import require_replaceable
from facert.io.tables.csv_table import CURVE
from facert.io.tensors import read_tensors, write_tensors
from facert.models.optim.monitor import Monitor, Progress
from facert.models.optim.optimiser import State

log = logging.getLogger(__name__)

FORMAT = "facert-checkpoint"
_MEMORY = "memory."


@dataclass(frozen=True)
class CheckpointMetadata:
    """What a checkpoint says beside its arrays."""

    fingerprint: str  # Of the data and the settings


def checkpoint_path(model: Path) -> Path:
    """The path of the checkpoint of a model file in training, beside it."""
    return model.with_suffix(".checkpoint.safetensors")


class CheckpointFile(Monitor):
    """Keeps the latest progress in a file.

    Parameters
    ----------
    path : Path
        The file; replaced whole at every checkpoint, so that it is never half-written.
    resume : bool
        Continue from the file if it is there.

    Raises
    ------
    OutputKeptError
        When facert did not write the file that is there.
    """

    def __init__(self, path: Path, resume: bool) -> None:
        require_replaceable(path, overwrite=True)
        if path.exists() and not resume:
            log.warning("%s is of an earlier run and will be replaced; --resume continues it", path)
        self.path, self._resume = path, resume
        self.continues = resume and path.exists()
        self._fingerprint = ""

    def resume(self, fingerprint: str) -> Progress | None:
        """The file's progress, None when there is no file.

        Raises
        ------
        InputError
            When the file belongs to a run on other data or with other settings.
        """
        self._fingerprint = fingerprint
        if not self._resume:
            return None
        if not self.path.exists():
            log.warning("no checkpoint %s: training begins anew", self.path)
            return None
        arrays, metadata = read_tensors(self.path, FORMAT, CheckpointMetadata, _check_shapes)
        if metadata.fingerprint != fingerprint:
            raise InputError(
                "fingerprint",
                "a checkpoint of the same take and settings",
                "one of another run",
                "Give the options of that run, or train without --resume.",
                str(self.path),
            )
        return _progress(arrays)

    def checkpoint(self, progress: Progress) -> None:
        """Write the progress, replacing the last."""
        state = progress.state
        arrays = {
            "x": state.x,
            "curve": np.array(progress.curve),
            "scalars": np.array([state.value, state.gradient_norm, float(state.iterations)]),
            **{_MEMORY + name: array for name, array in state.memory.items()},
        }
        metadata = CheckpointMetadata(self._fingerprint)
        write_tensors(self.path, arrays, metadata, FORMAT, overwrite=True)

    def remove(self) -> None:
        """Delete the file: the model is complete."""
        self.path.unlink(missing_ok=True)


class CurveLog(Monitor):
    """Writes the curve to a CSV file, one line an iteration, as training goes.

    Parameters
    ----------
    path : Path
        The file.
    overwrite : bool
        Begin an existing file anew.
    goes_on : bool
        Add to an existing file: the run continues another.

    Raises
    ------
    OutputExistsError
        When the file exists and neither is set, or it is not a curve of facert's.
    """

    def __init__(self, path: Path, overwrite: bool, goes_on: bool = False) -> None:
        require_replaceable(path, overwrite or goes_on)
        self.path = path
        self._goes_on = goes_on and path.exists()
        self._began = time.perf_counter()

    def resume(self, fingerprint: str) -> Progress | None:  # noqa: ARG002  only begins the file
        """Begin the file: training is about to start. A line that a killed run cut off goes."""
        lines = read_text(self.path).splitlines(keepends=True) if self._goes_on else []
        whole = "".join(line for line in lines if line.endswith("\n"))
        write_text(whole or f"{CURVE}\n", self.path, overwrite=True)
        return None

    def iteration(self, state: State) -> None:
        """Append the line of an iteration."""
        seconds = time.perf_counter() - self._began
        # Closed after each line: the log can be followed, and survives a killed run.
        line = f"{state.iterations},{state.value!r},{state.gradient_norm!r},{seconds:.6f}\n"
        with Appended(self.path) as file:
            file.add(line.encode())


class Monitors(Monitor):
    """Several monitors as one; the first that knows where to resume decides.

    Parameters
    ----------
    *parts : Monitor
        Called in this order.
    """

    def __init__(self, *parts: Monitor) -> None:
        self.parts = parts

    def resume(self, fingerprint: str) -> Progress | None:
        """The first part's progress that is not None."""
        found = [part.resume(fingerprint) for part in self.parts]
        return next((progress for progress in found if progress), None)

    def iteration(self, state: State) -> None:
        """Notify every part."""
        for part in self.parts:
            part.iteration(state)

    def checkpoint(self, progress: Progress) -> None:
        """Notify every part."""
        for part in self.parts:
            part.checkpoint(progress)


def _check_shapes(declared: Mapping[str, Shaped], metadata: CheckpointMetadata) -> None:  # noqa: ARG001  they have no say in it
    """Refuse arrays that are no progress; `facert.models.gplvm.fitting` knows how long x is."""
    own = {name: array.shape for name, array in declared.items() if not name.startswith(_MEMORY)}
    vectors = {name: len(shape) for name, shape in own.items()}
    if vectors != dict.fromkeys(("x", "curve", "scalars"), 1) or own["scalars"] != (3,):
        raise InputError("the arrays", "x, curve and 3 scalars", ", ".join(own), "Train anew.")
    for name, memory in part_of(declared, _MEMORY).items():
        if memory.shape != own["x"] and not (name == "scalars" and memory.shape in ((2,), (3,))):
            found = f"shape {memory.shape}"
            raise InputError(_MEMORY + name, f"shape {own['x']}", found, "Train anew.")


def _progress(arrays: Mapping[str, FloatArray]) -> Progress:
    value, gradient_norm, iterations = arrays["scalars"].tolist()
    state = State(arrays["x"], value, gradient_norm, int(iterations), part_of(arrays, _MEMORY))
    return Progress(state, tuple(arrays["curve"].tolist()))

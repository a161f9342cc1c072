"""Checkpoints of a training run, from which it continues as if it had not stopped."""

from __future__ import annotations

import logging
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import takewhile
from pathlib import Path

import numpy as np

from facert.data.array_group import Shaped, part_of
from facert.data.arrays import FloatArray
from facert.errors import InputError
from facert.io.atomic import Appended, write_text
from facert.io.guarded import read_text
from facert.io.journal import source_digest
from facert.io.registry import require_replaceable
from facert.io.tables.csv_table import CURVE
from facert.io.tensors import read_tensors, write_tensors
from facert.models.optim.monitor import Monitor, Progress
from facert.models.optim.optimiser import State
from facert.retarget.model_file import library_versions

log = logging.getLogger(__name__)

FORMAT = "facert-checkpoint"
_MEMORY = "memory."
_MEMORIES: tuple[set[str], ...] = (
    {"gradient", "direction", "scalars"},  # of scaled conjugate gradients
    {"begin", "scalars", "values", "gradients"},  # of L-BFGS within a stage
)
_OF_STAGE = {"stage", "of_stage", "y"}  # beside it, of a conditioned stage


@dataclass(frozen=True)
class CheckpointMetadata:
    """What a checkpoint says beside its arrays."""

    fingerprint: str  # Of the data and the settings, and the phase of the training
    program: str = ""  # Of the code and the libraries


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
        """The file's progress; None when there is no file, or one of another program or phase.

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
        if metadata.program != _program():
            log.warning("%s is of another version of facert: training begins anew", self.path)
            return None
        if metadata.fingerprint.partition(":")[0] != fingerprint.partition(":")[0]:
            raise InputError(
                "fingerprint",
                "a checkpoint of the same take and settings",
                "one of another run",
                "Give the options of that run, or train without --resume.",
                str(self.path),
            )
        # Else this phase of the training is over, or is yet to come.
        return _progress(arrays) if metadata.fingerprint == fingerprint else None

    def checkpoint(self, progress: Progress) -> None:
        """Write the progress, replacing the last."""
        state = progress.state
        arrays = {
            "x": state.x,
            "curve": np.array(progress.curve),
            "scalars": np.array([state.value, state.gradient_norm, float(state.iterations)]),
            **{_MEMORY + name: array for name, array in state.memory.items()},
        }
        metadata = CheckpointMetadata(self._fingerprint, _program())
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
        self._goes_on, self._is_on = goes_on and path.exists(), True
        self._began = time.perf_counter()

    def resume(self, fingerprint: str) -> Progress | None:
        """Begin the file: training is about to start, or a phase of it, which has no line here."""
        self._is_on = ":" not in fingerprint
        if self._is_on and not self._goes_on:
            self._write([])
        return None

    def iteration(self, state: State) -> None:
        """Append the line of an iteration."""
        if not self._is_on:
            return
        if self._goes_on:
            self._write(self._lines_before(state.iterations))
            self._goes_on = False
        seconds = time.perf_counter() - self._began
        # Closed after each line: the log can be followed, and survives a killed run.
        line = f"{state.iterations},{state.value!r},{state.gradient_norm!r},{seconds:.6f}\n"
        with Appended(self.path) as file:
            file.add(line.encode())

    def _lines_before(self, iteration: int) -> list[str]:
        """The lines of the run that goes on: it may have come further than its checkpoint."""
        whole, _, _ = read_text(self.path).rpartition("\n")  # the last may be cut off
        lines = whole.splitlines()[1:]
        here = str(iteration)
        return list(takewhile(lambda line: line.partition(",")[0] != here, lines))

    def _write(self, lines: Sequence[str]) -> None:
        write_text("\n".join([CURVE, *lines, ""]), self.path, overwrite=True)


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
    found = {name: one.shape for name, one in part_of(declared, _MEMORY).items()}
    rows = found.get("values", ())
    known = {"begin": own["x"], "values": rows[:1], "gradients": rows[:1] + own["x"]}
    known |= {"gradient": own["x"], "direction": own["x"], "scalars": found.get("scalars", ())[:1]}
    known |= {"stage": own["x"], "of_stage": (5,), "y": own["x"]}
    staged = _OF_STAGE if "stage" in found else set()
    complete = set(found) - staged in (set(), *_MEMORIES) and staged <= set(found)
    if not complete or any(shape != known[name] for name, shape in found.items()):
        expected = f"the state of a search for {own['x'][0]} numbers"
        raise InputError("the arrays memory.*", expected, ", ".join(found), "Train anew.")


def _progress(arrays: Mapping[str, FloatArray]) -> Progress:
    value, gradient_norm, iterations = arrays["scalars"].tolist()
    state = State(arrays["x"], value, gradient_norm, int(iterations), part_of(arrays, _MEMORY))
    return Progress(state, tuple(arrays["curve"].tolist()))


@cache
def _program() -> str:
    """What computes: a run of other code, or other libraries, would not go on in the same way."""
    versions = repr(sorted(library_versions().items()))
    return f"{source_digest(Path(__file__).parents[1])} {versions}"

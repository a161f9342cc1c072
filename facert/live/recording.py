"""Recordings of what a session receives and sends: on disk while it runs, as takes at its end."""

from __future__ import annotations

import itertools
import logging
import tempfile
from abc import ABC, abstractmethod
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from facert.data.arrays import FloatArray
from facert.data.rate import nominal_rate
from facert.data.take import Controls, Source, Take
from facert.errors import FacertError, InputError
from facert.io.formats import write_take_file
from facert.io.registry import is_foreign, require_replaceable
from facert.live.frames import Frame, frame_pattern

if TYPE_CHECKING:
    from facert.retarget.stream import Streamed

log = logging.getLogger("facert")


class SpooledRows:
    """Rows of equal length in a nameless file, so that memory does not grow with time."""

    def __init__(self) -> None:
        self._file = tempfile.TemporaryFile()  # noqa: SIM115
        self._full = False
        self._width = 0
        self.count = 0

    def add(self, row: FloatArray) -> None:
        """Keep one more row; when the disk is full, no more, with a warning: the show goes on."""
        if self._full:
            return
        try:
            self._file.write(row.tobytes())
            self.count, self._width = self.count + 1, len(row)
        except OSError as error:
            self._full = True
            log.warning("recorded no further than %d frames: %s", self.count, error.strerror)

    def close(self) -> None:
        """Discard all rows."""
        self._file.close()

    def read(self) -> FloatArray:
        """Read all rows, (count, width)."""
        self._file.seek(0)
        whole = np.frombuffer(self._file.read(8 * self.count * self._width))
        return whole.reshape(self.count, self._width)


class _Record(ABC):
    """A take that is written when the performance is over, and must not fail then.

    So a take of the same kind is written at once, beside the file's place, and removed.

    Parameters
    ----------
    path : Path
    overwrite : bool
        Allow to replace a file that exists.
    like : Take
        A take with the names, units and controls of the record, whatever its frames.

    Raises
    ------
    OutputExistsError
        When the file exists and may not be overwritten.
    InputError
        When the format cannot hold such a take, or nothing can be written there.
    """

    def __init__(self, path: Path, overwrite: bool, like: Take) -> None:
        self._path, self._overwrite, self._like = path, overwrite, like
        self._rehearse()
        self._rows = SpooledRows()

    def close(self) -> None:
        """Discard what was not written."""
        self._rows.close()

    def write(self, start_timecode: str) -> Path | None:
        """Write the take, as HDF5 where the format cannot hold it.

        Returns
        -------
        Path or None
            Where it is; None when there was no frame.
        """
        if not self._rows.count:
            log.warning("%s: not written, as there was no frame", self._path)
            return None
        table = self._rows.read()
        time = table[:, 0] - table[0, 0]
        fields = self._fields(table[:, 1:])
        take = replace(
            self._like, time=time, fps=nominal_rate(time), start_timecode=start_timecode, **fields
        )
        try:
            return self._write(take, self._path)
        except InputError as error:
            instead = self._write(take, self._path.with_name(f"{self._path.name}.h5"))
            log.warning("written to %s instead: %s", instead, error)
            return instead

    @abstractmethod
    def _fields(self, table: FloatArray) -> dict[str, Any]:
        """The take's frames, from the rows without their times, (T, width - 1)."""

    def _source(self, values: FloatArray) -> Source:
        like = self._like.source
        return Source(values.reshape(-1, *like.values.shape[1:]), like.names)

    def _rehearse(self) -> None:
        require_replaceable(self._path, self._overwrite)
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryDirectory(dir=self._path.parent) as folder:
                write_take_file(self._like, Path(folder) / self._path.name)
        except OSError as error:
            raise InputError(
                "output",
                "a folder that can be written to",
                error.strerror or str(error),
                "Choose another place.",
                str(self._path),
            ) from error

    def _write(self, take: Take, path: Path) -> Path:
        """Write the take beside a file that appeared meanwhile: both are precious."""
        place = path if self._overwrite and not is_foreign(path) else _free(path)
        write_take_file(take, place, self._overwrite)
        if place != path:
            log.warning("%s appeared meanwhile: written to %s", path, place)
        return place


def _free(path: Path) -> Path:
    """The path, or the first of ``take-2.h5``, ``take-3.h5``, ... where it is taken."""
    name, dot, endings = path.name.partition(".")
    numbers, place = itertools.count(2), path
    while place.exists():
        place = path.with_name(f"{name}-{next(numbers)}{dot}{endings}")
    return place


class SourceRecord(_Record):
    """Record of all received frames."""

    def add(self, frame: Frame) -> None:
        """Keep a frame."""
        self._rows.add(np.append(frame.time, frame.values))

    def _fields(self, table: FloatArray) -> dict[str, Any]:
        return {"source": self._source(table)}


class PoseRecord(_Record):
    """Record of all sent poses, each with the cleaned frame that it comes from."""

    def send(self, frame: Frame, pose: Streamed) -> None:
        """Keep a pose, its standard deviation, and its source."""
        std = np.full(len(pose.params), np.nan) if pose.std is None else pose.std
        self._rows.add(np.concatenate([[frame.time], pose.params, std, pose.source.ravel()]))

    def _fields(self, table: FloatArray) -> dict[str, Any]:
        assert self._like.controls is not None  # `Recordings.poses` gives them
        count = len(self._like.controls.names)
        params, std, values = np.split(table, [count, 2 * count], axis=1)
        known = None if np.isnan(std).all() else std
        return {"source": self._source(values), "params": params, "std": known}


_AnyRecord = TypeVar("_AnyRecord", bound=_Record)


class Recordings:
    """The takes that are written when a session is over.

    Parameters
    ----------
    incoming : Take
        With the names, kind and units of what comes in; its frames do not matter.
    cleaned : tuple of str
        Names of what the model makes of it.
    controls : Controls
        Controls of the poses.
    overwrite : bool
        Allow to replace existing files.
    """

    def __init__(
        self, incoming: Take, cleaned: tuple[str, ...], controls: Controls, overwrite: bool
    ) -> None:
        self._incoming, self._overwrite = incoming, overwrite
        like = frame_pattern(cleaned, incoming.source.kind, incoming.units)
        self._posed = replace(like, controls=controls, params=np.zeros((1, len(controls.names))))
        self._records: dict[Path, _Record] = {}

    def source(self, path: Path) -> SourceRecord:
        """A new file of what comes in; raises what `_Record` does."""
        return self._add(SourceRecord, path, self._incoming)

    def poses(self, path: Path) -> PoseRecord:
        """A new file of the poses; raises what `_Record` does."""
        return self._add(PoseRecord, path, self._posed)

    def write(self, start_timecode: str) -> list[Path]:
        """Write them all, whatever happens to one of them; return what there is now.

        Raises
        ------
        InputError
            When one could not be written, after the others were.
        """
        written: list[Path | None] = []
        failed: list[FacertError] = []
        for record in self._records.values():
            try:
                written.append(record.write(start_timecode))
            except FacertError as error:
                failed.append(error)
        for other in failed[1:]:
            log.warning("%s", other)
        if failed:
            raise failed[0]
        return [path for path in written if path is not None]

    def close(self) -> None:
        """Discard what was not written."""
        for record in self._records.values():
            record.close()

    def _add(self, kind: type[_AnyRecord], path: Path, like: Take) -> _AnyRecord:
        if path.absolute() in self._records:
            raise InputError(
                "output", "a file for each recording", "one for two", "Rename one.", str(path)
            )
        record = kind(path, self._overwrite, like)
        self._records[path.absolute()] = record
        return record

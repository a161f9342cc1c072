"""What a session received and sent, kept on disk while it runs and written as takes at its end."""

from __future__ import annotations

import itertools
import logging
import math
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from facert.data.arrays import FloatArray
from facert.data.take import Controls, Source, Take
from facert.errors import FacertError, InputError, OutputExistsError
from facert.io.formats import write_take_file
from facert.io.rate import nominal_rate
from facert.live.frames import Frame, frame_pattern

if TYPE_CHECKING:
    from facert.retarget.stream import Streamed

log = logging.getLogger("facert")


@dataclass(frozen=True)
class TakeFile:
    """A take that will be written when the performance is over, and must not fail then."""

    path: Path
    overwrite: bool

    def rehearse(self, take: Take) -> None:
        """Write a take of the same kind beside the file's place, and remove it.

        Raises
        ------
        OutputExistsError
            When the file exists and may not be overwritten.
        InputError
            When the format cannot hold such a take, or nothing can be written there.
        """
        if self.path.exists() and not self.overwrite:
            raise OutputExistsError(self.path)
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryDirectory(dir=self.path.parent) as folder:
                write_take_file(take, Path(folder) / self.path.name)
        except OSError as error:
            raise InputError(
                "output",
                "a folder that can be written to",
                error.strerror or str(error),
                "Choose another place.",
                str(self.path),
            ) from error

    def leave_out(self) -> None:
        """Say why the file is not written."""
        log.warning("%s: not written, as there was no frame", self.path)

    def write(self, take: Take) -> Path:
        """Write the take, as HDF5 where the format cannot hold it; return where."""
        try:
            return self._write(take, self.path)
        except InputError as error:
            instead = self._write(take, self.path.with_name(f"{self.path.name}.h5"))
            log.warning("written to %s instead: %s", instead, error)
            return instead

    def _write(self, take: Take, path: Path) -> Path:
        """Write the take beside a file that appeared meanwhile: both are precious."""
        place = path if self.overwrite else _free(path)
        write_take_file(take, place, self.overwrite)
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


class SpooledRows:
    """Rows of equal length in a nameless file, so that memory does not grow with time."""

    def __init__(self) -> None:
        self._file = tempfile.TemporaryFile()  # noqa: SIM115
        self._full = False
        self.count = 0

    def add(self, row: FloatArray) -> None:
        """Keep one more row; when the disk is full, no more, with a warning: the show goes on."""
        if self._full:
            return
        try:
            self._file.write(row.tobytes())
            self.count += 1
        except OSError as error:
            self._full = True
            log.warning("recorded no further than %d frames: %s", self.count, error.strerror)

    def close(self) -> None:
        """Forget them all."""
        self._file.close()

    def read(self, width: int) -> FloatArray:
        """All rows, (count, width)."""
        self._file.seek(0)
        whole = np.frombuffer(self._file.read(8 * self.count * width))
        return whole.reshape(-1, width)


class SourceRecord:
    """Every frame that came in.

    Parameters
    ----------
    file : TakeFile
    like : Take
        A take with the session's names and units, whatever its frames.

    Raises
    ------
    OutputExistsError, InputError
        When the file could not be written at the end.
    """

    def __init__(self, file: TakeFile, like: Take) -> None:
        file.rehearse(like)
        self._file, self._like, self._rows = file, like, SpooledRows()

    def add(self, frame: Frame) -> None:
        """Keep a frame."""
        self._rows.add(np.append(frame.time, frame.values))

    def close(self) -> None:
        """Forget what was not written."""
        self._rows.close()

    def write(self, start_timecode: str) -> Path | None:
        """Write the take; None when there is nothing to write."""
        if not self._rows.count:
            self._file.leave_out()
            return None
        shape = self._like.source.values.shape[1:]
        table = self._rows.read(1 + math.prod(shape))
        source = Source(table[:, 1:].reshape(-1, *shape), self._like.source.names)
        take = replace(self._like, **_clock(table[:, 0], start_timecode), source=source)
        return self._file.write(take)


class PoseRecord:
    """Every pose that was sent, with the cleaned frame that it comes from.

    Parameters
    ----------
    file : TakeFile
    like : Take
        A take with the names and units of the cleaned frames, whatever they are.
    controls : Controls
        Of the poses.

    Raises
    ------
    OutputExistsError, InputError
        When the file could not be written at the end.
    """

    def __init__(self, file: TakeFile, like: Take, controls: Controls) -> None:
        file.rehearse(replace(like, controls=controls, params=np.zeros((1, len(controls.names)))))
        self._file, self._like, self._controls, self._rows = file, like, controls, SpooledRows()

    def send(self, frame: Frame, pose: Streamed) -> None:
        """Keep a pose, its standard deviation, and its source."""
        std = np.full(len(pose.params), np.nan) if pose.std is None else pose.std
        self._rows.add(np.concatenate([[frame.time], pose.params, std, pose.source.ravel()]))

    def close(self) -> None:
        """Forget what was not written."""
        self._rows.close()

    def write(self, start_timecode: str) -> Path | None:
        """Write the take; None when there is nothing to write."""
        if not self._rows.count:
            self._file.leave_out()
            return None
        count, shape = len(self._controls.names), self._like.source.values.shape[1:]
        table = self._rows.read(1 + 2 * count + math.prod(shape))
        time, params, std, values = np.split(table, [1, 1 + count, 1 + 2 * count], axis=1)
        take = replace(
            self._like,
            **_clock(time[:, 0], start_timecode),
            source=Source(values.reshape(-1, *shape), self._like.source.names),
            controls=self._controls,
            params=params,
            std=None if np.isnan(std).all() else std,
        )
        return self._file.write(take)


class Recordings:
    """All files that are written when a session is over.

    Parameters
    ----------
    incoming : Take
        With the names, kind and units of what comes in; its frames do not matter.
    cleaned : tuple of str
        Names of what the model makes of it.
    controls : Controls
        Of the poses.
    overwrite : bool
        Allow to replace existing files.
    """

    def __init__(
        self, incoming: Take, cleaned: tuple[str, ...], controls: Controls, overwrite: bool
    ) -> None:
        self._incoming, self._controls, self._overwrite = incoming, controls, overwrite
        self._cleaned = frame_pattern(cleaned, incoming.source.kind, incoming.units)
        self._records: dict[Path, SourceRecord | PoseRecord] = {}

    def source(self, path: Path) -> SourceRecord:
        """A file of what comes in."""
        record = SourceRecord(self._file(path), self._incoming)
        self._records[path.absolute()] = record
        return record

    def poses(self, path: Path) -> PoseRecord:
        """A file of the poses."""
        record = PoseRecord(self._file(path), self._cleaned, self._controls)
        self._records[path.absolute()] = record
        return record

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
        """Forget what was not written."""
        for record in self._records.values():
            record.close()

    def _file(self, path: Path) -> TakeFile:
        if path.absolute() in self._records:
            raise InputError(
                "output", "a file for each recording", "one for two", "Rename one.", str(path)
            )
        return TakeFile(path, self._overwrite)


def _clock(time: FloatArray, start_timecode: str) -> dict[str, Any]:
    """The fields of a take that begins at 0 and runs at its own rate."""
    begun = time - time[0]
    return {"time": begun, "fps": nominal_rate(begun), "start_timecode": start_timecode}

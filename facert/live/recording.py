"""Recordings of what a session receives and sends: on disk while it runs, as takes at its end."""

from __future__ import annotations

import itertools
import logging
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from facert.data.arrays import FloatArray
from facert.data.take import Controls, Take
from facert.errors import FacertError, InputError, OutputKeptError
from facert.io.claims import claimed
from facert.io.formats import write_take_file
from facert.io.live_recording import LiveRecording, read_recording, recording_of
from facert.io.registry import is_foreign, require_replaceable
from facert.live.frames import Frame, frame_pattern

if TYPE_CHECKING:
    from facert.retarget.stream import Streamed

log = logging.getLogger("facert")


class _Record:
    """A take that is written when the performance is over, and must not fail then.

    So a take of the same kind is written at once elsewhere, and the output is claimed. Until the
    end all frames are in a file of their own beside it, which stays when the session is killed: the
    next session with that output makes a take of it.

    Parameters
    ----------
    path : Path
    overwrite : bool
        Allow to replace a file that exists.
    like : Take
        A take with the names, units and controls of the record, whatever its frames.
    start_timecode : callable
        Asked with the first frame for its timecode.

    Raises
    ------
    OutputExistsError
        When the file exists and may not be overwritten.
    InputError
        When the format cannot hold such a take, or nothing can be written there.
    """

    def __init__(
        self, path: Path, overwrite: bool, like: Take, start_timecode: Callable[[], str]
    ) -> None:
        self._path, self._overwrite, self._like = path, overwrite, like
        self._full = False
        require_replaceable(path, overwrite)
        with TemporaryDirectory() as folder:
            write_take_file(like, Path(folder) / path.name)
        with ExitStack() as stack:
            stack.enter_context(claimed(path))
            _recover(path)
            self._rows = LiveRecording(recording_of(path), like, start_timecode)
            self._stack = stack.pop_all()

    @property
    def recording(self) -> Path:
        """The file of all frames until the end."""
        return self._rows.path

    def close(self) -> None:
        """Let go of the file of all frames; it stays where no take was made of it."""
        self._rows.close()
        self._stack.close()

    def write(self, start_timecode: str) -> Path | None:
        """Write the take, as HDF5 where the format cannot hold it, and let go of the output.

        Returns
        -------
        Path or None
            Where it is; None when there was no frame.
        """
        with self._stack:
            return self._written(start_timecode)

    def _written(self, start_timecode: str) -> Path | None:
        if not self._rows.count:
            log.warning("%s: not written, as there was no frame", self._path)
            self._rows.remove()
            return None
        take = replace(self._rows.take(), start_timecode=start_timecode)
        place = self._path if self._overwrite and not is_foreign(self._path) else _free(self._path)
        if place != self._path:
            log.warning("%s appeared meanwhile: written to %s", self._path, place)
        try:
            written = _write(take, place, self._overwrite)
        except InputError as error:
            if self.recording.exists():
                error.fix += f" All frames are in {self.recording}, which facert reads."
            raise
        self._rows.remove()
        return written

    def _add(self, row: FloatArray) -> None:
        """Keep a row; when the disk is full, no more, with a warning: the show goes on."""
        if self._full:
            return
        try:
            self._rows.add(row)
        except InputError as error:
            self._full = True
            log.warning("recorded no further than %d frames: %s", self._rows.count, error.found)


def _write(take: Take, path: Path, overwrite: bool) -> Path:
    """Write a take, as HDF5 where the format of the name's ending cannot hold it; return where."""
    try:
        write_take_file(take, path, overwrite)
    except InputError as error:
        instead = _free(path.with_name(f"{path.name}.h5"))
        try:
            write_take_file(take, instead)
        except InputError:  # the disk is full, say: that is not about this format
            raise error from None
        log.warning("written to %s instead: %s", instead, error)
        return instead
    return path


def _recover(path: Path) -> None:
    """Make a take of what a session left that was killed while it recorded to that path."""
    left = recording_of(path)
    if is_foreign(left):
        raise OutputKeptError(left)
    if not left.exists() or not left.stat().st_size:
        return
    name, dot, endings = path.name.partition(".")
    take = read_recording(left)
    written = _write(take, _free(path.with_name(f"{name}-recovered{dot}{endings}")), False)
    left.unlink()
    log.warning(
        "a session was killed: the %d frames that it recorded are in %s", len(take), written
    )


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
        self._add(np.append(frame.time, frame.values))


class PoseRecord(_Record):
    """Record of all sent poses, each with the cleaned frame that it comes from."""

    def send(self, frame: Frame, pose: Streamed) -> None:
        """Keep a pose, its standard deviation, and its source."""
        std = np.full(len(pose.params), np.nan) if pose.std is None else pose.std
        self._add(np.concatenate([[frame.time], pose.params, std, pose.source.ravel()]))


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
    start_timecode : callable, optional
        Asked with the first frame for its timecode.
    """

    def __init__(
        self,
        incoming: Take,
        cleaned: tuple[str, ...],
        controls: Controls,
        overwrite: bool,
        start_timecode: Callable[[], str] = str,
    ) -> None:
        self._incoming, self._overwrite = incoming, overwrite
        self._start_timecode = start_timecode
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

    @property
    def going_on(self) -> list[Path]:
        """The files of all frames until the end."""
        return [record.recording for record in self._records.values()]

    def close(self) -> None:
        """Close all files; frames that were not written stay where they are."""
        for record in self._records.values():
            record.close()

    def _add(self, kind: type[_AnyRecord], path: Path, like: Take) -> _AnyRecord:
        if path.absolute() in self._records:
            raise InputError(
                "output", "a file for each recording", "one for two", "Rename one.", str(path)
            )
        record = kind(path, self._overwrite, like, self._start_timecode)
        self._records[path.absolute()] = record
        return record

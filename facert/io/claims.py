"""Claims of output files: one run writes a file, and what dead runs left in its folder goes.

A claim is a lock of the system on a hidden file beside the output; whatever becomes of the process,
the system gives the lock up. So nobody guesses who is alive from numbers of processes, which other
machines and containers have as well.

=================================  ================================================
``.facert-KEY.lock``               the lock; KEY is a digest of the output's name
``.facert-KEY-PROCESS-TOKEN.h5``   what is written under it, until it is complete
=================================  ================================================
"""

from __future__ import annotations

import errno
import hashlib
import logging
import os
import re
import secrets
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass, field
from pathlib import Path
from threading import RLock

from facert.errors import InputError

log = logging.getLogger("facert")

PREFIX = ".facert-"
"""Of the names of all files that do not outlive a run."""
PATIENCE = 0.3
"""Seconds for which a claim is tried again: who tidies up holds it for less."""

_OURS = re.compile(re.escape(PREFIX) + r"([0-9a-f]{10})(\.lock|-\d+-[0-9a-f]{8}(\..*)?)", re.DOTALL)
_RUN: ContextVar[ExitStack | None] = ContextVar("run", default=None)
_GUARD = RLock()


@dataclass
class _Held:
    """A claim of this process, which may be asked for several times."""

    descriptor: int
    made: list[Path]  # folders that were made for it, deepest first
    count: int = field(default=0)


_held: dict[Path, _Held] = {}


@contextmanager
def claims_kept() -> Iterator[None]:
    """Keep each `claim` in the block until its end: a run says early what it writes."""
    with ExitStack() as stack:
        before = _RUN.set(stack)
        try:
            yield
        finally:
            _RUN.reset(before)


def claim(path: Path) -> None:
    """Claim an output for the rest of the run; without a run, `claimed` does when it is written.

    Raises what `claimed` does.
    """
    run = _RUN.get()
    if run is not None:
        run.enter_context(claimed(path))


@contextmanager
def claimed(path: Path) -> Iterator[Path]:
    """Hold the claim to an output file, and remove what dead runs left beside it.

    Yields
    ------
    Path
        Where to write: the file that `path` leads to, where it is a link.

    Raises
    ------
    InputError
        When another run writes the file, or nothing can be written there.
    """
    place = Path(os.path.realpath(path)) if path.is_symlink() else path
    lock = _lock_of(place)
    with _GUARD:
        with writing_errors(path):
            made = [] if path.is_symlink() else _make_folders(place.parent)
            if lock not in _held:
                _held[lock] = _Held(_acquire(lock, path), made)
                _tidy(lock)
        _held[lock].count += 1
    try:
        yield place
    finally:
        with _GUARD:
            _held[lock].count -= 1
            if not _held[lock].count:
                _release(lock, _held.pop(lock))


@contextmanager
def writing_errors(path: Path) -> Iterator[None]:
    """An `InputError` about the output for whatever the system says against it."""
    try:
        yield
    except OSError as error:
        expected, found = "a name in a folder that can be written to", error.strerror or str(error)
        fix = "Choose another place, or make room there."
        if error.errno == errno.EFBIG:
            fix = "Raise the limit of this shell (ulimit -f), or write less."
        raise InputError("output", expected, found, fix, where=str(path)) from error


def temporary_name(place: Path, ending: str) -> Path:
    """A new hidden name beside a file that is claimed."""
    name = f"{PREFIX}{_key(place)}-{os.getpid()}-{secrets.token_hex(4)}{ending}"
    return place.with_name(name)


def flush(path: Path) -> None:
    """Make the disk hold what was written; a folder too, so that a name survives a power cut."""
    if path.is_dir() and os.name == "nt":  # Windows cannot open a folder
        return
    descriptor = os.open(path, os.O_RDONLY if path.is_dir() else os.O_RDWR)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _key(place: Path) -> str:
    return hashlib.sha256(os.fsencode(place.name)).hexdigest()[:10]


def _lock_of(place: Path) -> Path:
    folder = Path(os.path.realpath(place.parent))
    return folder / f"{PREFIX}{_key(place)}.lock"


def _make_folders(folder: Path) -> list[Path]:
    """Make a folder and those that it lies in; those that are new, deepest first."""
    missing = [one for one in (folder, *folder.parents) if not one.exists()]
    folder.mkdir(parents=True, exist_ok=True)
    for one in missing:
        flush(one.parent)
    return missing


def _acquire(lock: Path, path: Path) -> int:
    """The descriptor of the lock, which this process holds now."""
    end = time.monotonic() + PATIENCE
    while not _is_locked(descriptor := _open(lock), lock):
        holder = _holder(descriptor)
        os.close(descriptor)
        if time.monotonic() > end:
            expected, found = "a file that no other run writes", f"one that {holder} is writing"
            fix = "Wait for it, or give another name."
            raise InputError("output", expected, found, fix, where=str(path))
        time.sleep(0.01)
    with suppress(OSError):  # for people to read; the disk may be full
        os.ftruncate(descriptor, 0)
        os.write(descriptor, str(os.getpid()).encode())
    return descriptor


def _open(lock: Path) -> int:
    """Open a lock for all users of the folder: who comes next may be another one."""
    flags = os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0)
    descriptor = os.open(lock, flags, 0o666)
    with suppress(OSError, AttributeError):
        os.fchmod(descriptor, 0o666)
    return descriptor


def _lock(descriptor: int) -> None:
    """Lock a file; raises BlockingIOError when another process has, OSError where none can."""
    if sys.platform == "win32":
        import msvcrt

        try:
            msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
        except PermissionError as error:
            raise BlockingIOError from error
    else:
        import fcntl

        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)


def _is_locked(descriptor: int, lock: Path) -> bool:
    """Lock a file and return whether that went well, as it does where files cannot be locked."""
    try:
        _lock(descriptor)
    except BlockingIOError:
        return False
    except OSError:
        return True
    return _is_at(descriptor, lock)


def _is_at(descriptor: int, lock: Path) -> bool:
    """Whether the file still has its name: who held it before may just have removed it."""
    try:
        return os.path.samestat(os.fstat(descriptor), lock.stat())
    except FileNotFoundError:
        return False


def _holder(descriptor: int) -> str:
    with suppress(OSError, ValueError):
        os.lseek(descriptor, 0, os.SEEK_SET)
        return f"process {int(os.read(descriptor, 20))}"
    return "another run"


def _release(lock: Path, held: _Held) -> None:
    """Give a claim up; its folders go where nothing was written into them."""
    if os.name == "nt":  # which removes no file that is open
        os.close(held.descriptor)
    with suppress(OSError):
        lock.unlink()
    if os.name != "nt":
        os.close(held.descriptor)
    for folder in held.made:
        with suppress(OSError):
            folder.rmdir()


def _tidy(acquired: Path) -> None:
    """Remove temporary files and locks of runs that are dead: nobody else holds their claims.

    `acquired` is the lock that this process has just got: whatever is beside it is of dead runs.
    """
    folder, found = acquired.parent, dict[str, list[Path]]()
    with suppress(OSError):
        for name in os.listdir(folder):  # noqa: PTH208  names alone, of a folder that may be large
            ours = _OURS.fullmatch(name)
            if ours:
                found.setdefault(ours[1], []).append(folder / name)
    for key, paths in found.items():
        lock = folder / f"{PREFIX}{key}.lock"
        leftovers = [path for path in paths if path != lock]
        with suppress(OSError):  # somebody is at it, or it is not ours to remove
            if lock == acquired:
                _unlink(leftovers)
            elif lock not in _held:
                _remove(lock, leftovers)


def _unlink(leftovers: list[Path]) -> None:
    for path in leftovers:
        path.unlink(missing_ok=True)
        log.debug("%s: removed, as its run is dead", path)


def _remove(lock: Path, leftovers: list[Path]) -> None:
    descriptor = _open(lock)
    try:
        _lock(descriptor)
        if _is_at(descriptor, lock):
            _unlink(leftovers)
            lock.unlink()
    finally:
        os.close(descriptor)

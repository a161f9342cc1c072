"""The guarded door for HDF5: the only module through which such files are read and written.

A foreign HDF5 file can point to other files of the machine (external and soft links, external
storage, virtual datasets), ask for filters that are plug-ins, declare arrays far larger than
itself, and be damaged such that the HDF5 library, in C, never returns or crashes. `GuardedFile`
reads with `facert.io.hdf5_reader`, which is not led astray; it follows no link to elsewhere, and
looks at layout, filters, type and size of every dataset before it reads it. The library writes.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from facert.data.arrays import BoolArray, FloatArray, IntArray
from facert.data.memory import FileMemory
from facert.data.rig import Mesh
from facert.data.version import CREATED_BY, MARK
from facert.errors import InputError, reading
from facert.io.atomic import writing
from facert.io.guarded import existing_file, parsing
from facert.io.hdf5_output import HDF5Output
from facert.io.hdf5_reader.dataset import Dataset
from facert.io.hdf5_reader.file import StoredFile, is_hdf5

if TYPE_CHECKING:
    import h5py

TAKE_FORMAT, RIG_FORMAT = "facert-take", "facert-rig"
MAX_VALUES = 2**27
"""Most values of one dataset: 1 GiB of float64."""
MAX_NAMES = 2**14
MAX_NAME = 2**12
MAX_TEXT = 2**20
"""Most characters of all names together, and of one attribute."""

_FIX = "Check the program that wrote the file."
_FLOAT = 8  # bytes of a number as it is handed out


class GuardedFile:
    """Reading access to one open HDF5 file; every method raises `InputError` for what is unsafe.

    Paths are those of the HDF5 layout, e.g. ``"/source/names"``.
    """

    def __init__(self, file: StoredFile, path: Path) -> None:
        self._file, self._path = file, path
        self._memory = FileMemory(path)
        self._lock = Lock()  # a page may show several frames at once

    def __contains__(self, path: str) -> bool:
        """Whether there is something at `path`, without following a link to elsewhere."""
        with self._question(path):
            return self._find(path) is not None

    def numbers(self, path: str) -> FloatArray:
        """Read a dataset of integers or floats as float64, any shape."""
        return self._read(path, "iuf", "numbers", np.dtype(np.float64))

    def integers(self, path: str) -> IntArray:
        """Read a dataset of integers as int64, any shape."""
        return self._read(path, "iu", "integers", np.dtype(np.int64))

    def flags(self, path: str) -> BoolArray:
        """Read a dataset of booleans, or of integers that stand for them."""
        return self._read(path, "biu", "booleans", np.dtype(np.bool_))

    def rows(self, path: str) -> StoredRows:
        """A dataset of integers or floats that is read a few rows at a time; it may be large."""
        with self._question(path):
            dataset = self._dataset(path)
            if _kind(dataset) not in "iuf" or not dataset.shape:
                raise _unexpected(path, "rows of numbers", str(dataset))
            _check_values(dataset, path, dataset.shape[1:])
            return StoredRows(self, dataset, path)

    def names(self, path: str) -> tuple[str, ...]:
        """Read a list of names: UTF-8 strings of fixed or variable length."""
        with self._question(path):
            dataset = self._dataset(path)
            if not dataset.type.text or len(dataset.shape or ()) != 1:
                raise _unexpected(path, "a list of strings", str(dataset))
            longest = dataset.type.size if dataset.type.text == "fixed" else 0
            if math.prod(dataset.shape or ()) > MAX_NAMES or longest > MAX_NAME:
                limits = f"at most {MAX_NAMES} names of {MAX_NAME} bytes"
                raise _unexpected(path, limits, str(dataset))
            self._take_memory(dataset, path, dataset.type.size)
            return tuple(_texts(dataset, path))

    def optional(self, path: str) -> FloatArray | None:
        """The numbers at `path`, if there is anything."""
        return self.numbers(path) if path in self else None

    def mesh(self) -> Mesh:
        """The mesh at rest that a rig and a mesh sequence have."""
        return Mesh(
            vertices=self.numbers("/neutral"),
            faces=self.integers("/faces"),
            units=self.text_attribute("units"),
            colours=self.optional("/colours"),
        )

    def text_attribute(self, name: str, default: str = "") -> str:
        """Read a text attribute of the root."""
        value = self._attribute(name)
        if value is None:
            return default
        if not isinstance(value, bytes):
            raise _unexpected(f"attribute {name}", "text", f"{value!r}")
        if len(value) > MAX_TEXT:
            raise _unexpected(f"attribute {name}", f"at most {MAX_TEXT} characters", "more")
        return value.decode("utf-8", errors="replace")

    def number_attribute(self, name: str, default: float | None = None) -> float:
        """Read a numeric attribute of the root; needed when there is no default."""
        value = self._attribute(name)
        if value is None and default is not None:
            return default
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            found = "nothing" if value is None else repr(value)[:MAX_NAME]
            raise _unexpected(f"attribute {name}", "a number", found)
        return float(value)

    def require_format(self, name: str, version: int) -> None:
        """Check the file's own statement of what it is."""
        found = self.text_attribute("format", "nothing")
        if found != name:
            fix = "Give a file of this kind, or make one with facert convert."
            raise InputError("attribute format", repr(name), repr(found), fix)
        found_version = self.number_attribute("format_version")
        if not 1 <= found_version <= version:
            field, fix = "attribute format_version", "Update facert to read a newer file."
            raise InputError(field, f"1 to {version}", f"{found_version:g}", fix)

    @contextmanager
    def _question(self, field: str) -> Iterator[None]:
        """Ask one thing of the file; whatever goes wrong is damage of this field."""
        with self._lock, parsing(field, "readable data", _FIX):
            self._file.renew()
            yield

    def _find(self, path: str) -> int | None:
        """The object at `path`, or None."""
        here = self._file.root
        for part in path.strip("/").split("/"):
            links, name = self._file.links(here), part.encode()
            if links is None:
                raise _unexpected(path, "groups on the way", "a dataset")
            if name not in links:
                return None
            target = links[name]
            if target is None:
                raise _outside(path, f"a soft or external link at {part!r}")
            here = target
        return here

    def _dataset(self, path: str) -> Dataset:
        """The dataset at `path`; its elements are in the file itself, and in plain filters."""
        address = self._find(path)
        dataset = None if address is None else self._file.dataset(address)
        if dataset is None:
            what = "nothing" if address is None else "a group or a type"
            raise InputError(path, "a dataset", what, f"Write {path}.")
        _check_layout(dataset, path)
        return dataset

    def _read(self, path: str, kinds: str, expected: str, dtype: np.dtype[Any]) -> NDArray[Any]:
        with self._question(path):
            dataset = self._dataset(path)
            shape = dataset.shape or ()
            _check_values(dataset, path, shape)
            if _kind(dataset) not in kinds:
                raise _unexpected(path, expected, str(dataset))
            self._take_memory(dataset, path, _FLOAT)
            return dataset.numbers(dtype, 0, shape[0]) if shape else dataset.scalar(dtype)

    def _take_memory(self, dataset: Dataset, path: str, element: int) -> None:
        """Count what it takes to read a whole dataset as elements of some bytes."""
        shape = dataset.shape or (1,)
        self._memory.require(math.prod(shape) * element, path)
        surplus = dataset.unpacked_size(0, shape[0]) - math.prod(shape) * dataset.type.size
        self._memory.require(max(0, surplus), path)

    def _attribute(self, name: str) -> float | int | bool | bytes | None:
        """An attribute of the root, or None."""
        field = f"attribute {name}"
        with self._lock, parsing(field, "one number or text", _FIX):
            self._file.renew()
            return self._file.attribute(name)

    def read_rows(self, dataset: Dataset, path: str, start: int, stop: int) -> FloatArray:
        """Read some rows of a dataset; see `StoredRows`."""
        with self._question(path):
            size = math.prod((dataset.shape or ())[1:]) * (stop - start) * _FLOAT
            size += dataset.unpacked_size(start, stop)
            FileMemory(self._path).require(size, path)
            return dataset.numbers(np.float64, start, stop)


class StoredRows:
    """A dataset in an open file, read a few rows at a time."""

    def __init__(self, file: GuardedFile, dataset: Dataset, path: str) -> None:
        self._file, self._dataset, self._path = file, dataset, path
        self.shape: tuple[int, ...] = dataset.shape or ()

    def read(self, rows: IntArray) -> FloatArray:
        """Read some rows, (n, ...), as float64.

        Raises `InputError` when the data are damaged.
        """
        first, count = (int(rows[0]), len(rows)) if len(rows) else (0, 0)
        if np.array_equal(rows, np.arange(first, first + count)):
            return self._file.read_rows(self._dataset, self._path, first, first + count)
        return np.concatenate([self.read(rows[i : i + 1]) for i in range(count)])


@contextmanager
def open_guarded(path: Path) -> Iterator[GuardedFile]:
    """Open a foreign HDF5 file for reading; errors raised inside name the file.

    Raises `InputError` when the file is missing, is no HDF5 file, or is cut short.
    """
    path = Path(path)
    with reading(path), existing_file(path).open("rb") as file:
        size = os.fstat(file.fileno()).st_size
        found = "a truncated or damaged one" if is_hdf5(file, size) else "something else"
        with parsing("file", "a whole HDF5 file", "Export or copy it again.", found):
            stored = StoredFile(file, size)
        yield GuardedFile(stored, path)


def stated_format(path: Path) -> str:
    """The format that an HDF5 file states; empty for a file of another kind, or none."""
    try:
        with existing_file(path).open("rb") as file:
            if not is_hdf5(file, os.fstat(file.fileno()).st_size):
                return ""
    except (OSError, InputError):
        return ""
    with open_guarded(path) as guarded:
        return guarded.text_attribute("format")


def bears_mark(path: Path) -> bool:
    """Whether facert wrote an HDF5 file, by the attribute created_by."""
    with open_guarded(path) as file:
        return file.text_attribute("created_by").startswith(MARK)


def kind_of(path: Path, _asked: str | None = None) -> Literal["take", "rig"]:
    """Kind of a file: a rig where it states that it is one, else a take."""
    return "rig" if stated_format(path) == RIG_FORMAT else "take"


class NewFile:
    """Writing access to a new HDF5 file; the same data give the same bytes."""

    def __init__(self, file: h5py.File, output: HDF5Output) -> None:
        self._file, self._output = file, output

    def array(self, path: str, values: NDArray[Any] | None) -> None:
        """Write an array, compressed unless there is nothing in it; None is left out."""
        if values is not None:
            packing = {"compression": "gzip", "shuffle": True} if values.size else {}
            self._file.create_dataset(path, data=values, **packing)
            self._output.require_written()

    def mesh(self, mesh: Mesh) -> None:
        """Write the mesh at rest of a rig or a mesh sequence."""
        self.attribute("units", mesh.units)
        self.array("/neutral", mesh.vertices)
        self.array("/faces", mesh.faces)
        self.array("/colours", mesh.colours)

    def rows(self, path: str, shape: tuple[int, ...]) -> NewRows:
        """A float32 dataset that is filled row by row.

        Of a face in motion, gzip at its quickest makes 6 % less than lzf in 1.2 times its time,
        and is read six times as fast, as zlib does it.
        """
        packing = {"chunks": (1, *shape[1:]), "compression": "gzip", "compression_opts": 1}
        packing["shuffle"] = True
        return NewRows(self._file.create_dataset(path, shape, np.float32, **packing), self._output)

    def names(self, path: str, names: Sequence[str]) -> None:
        """Write a list of names as UTF-8 strings."""
        import h5py

        self._file.create_dataset(path, data=list(names), dtype=h5py.string_dtype())

    def attribute(self, name: str, value: str | float) -> None:
        """Write an attribute of the root; empty text is left out."""
        if value != "":
            self._file.attrs[name] = value


class NewRows:
    """A new dataset that is filled from the first row to the last, a batch at a time."""

    def __init__(self, dataset: h5py.Dataset, output: HDF5Output) -> None:
        self._dataset, self._output = dataset, output
        self.shape: tuple[int, ...] = dataset.shape
        self.filled = 0

    def append(self, values: FloatArray) -> None:
        """Write the next rows, (n, ...)."""
        end = self.filled + len(values)
        if values.shape[1:] != self.shape[1:] or end > self.shape[0]:
            raise ValueError(f"rows {self.filled} to {end} of {values.shape} into {self.shape}")
        self._dataset[self.filled : end] = values.astype(np.float32)  # HDF5 would be slower at it
        self._output.require_written()
        self.filled = end


@contextmanager
def create(path: Path, format_name: str, version: int, overwrite: bool) -> Iterator[NewFile]:
    """Make a new HDF5 file that states its format; it appears when the block ends well.

    Raises `OutputExistsError` when `path` exists and `overwrite` is not set.
    """
    import h5py  # what only reads does without

    with writing(path, overwrite) as raw:
        output = HDF5Output(raw)
        try:
            with h5py.File(output, "w") as file:
                new = NewFile(file, output)
                new.attribute("format", format_name)
                new.attribute("format_version", version)
                new.attribute("created_by", CREATED_BY)
                yield new
        finally:
            output.require_written()


def _check_layout(dataset: Dataset, path: str) -> None:
    """Refuse data that lie in other files or need plug-ins."""
    if dataset.elsewhere:
        raise _outside(path, "a virtual dataset or external storage")
    if dataset.foreign_filter:
        expected = "only gzip, lzf, shuffle and fletcher32"
        fix = "Write it again with one of these; h5repack -f GZIP=4 does it."
        raise InputError(path, expected, f"filter {dataset.foreign_filter}", fix)
    if dataset.shape is None:
        raise _unexpected(path, "an array", "an empty dataspace")


def _check_values(dataset: Dataset, path: str, shape: tuple[int, ...]) -> None:
    """Refuse to read an array of `shape` that is beyond what any memory limit should be about."""
    if max(math.prod(shape), dataset.values_of_a_chunk) > MAX_VALUES:
        raise _unexpected(path, f"at most {MAX_VALUES} values", f"shape {dataset.shape}")


def _kind(dataset: Dataset) -> str:
    """The kind of numbers, as NumPy has it; a blank for anything else."""
    numbers = dataset.type.numbers
    return " " if numbers is None else "b" if dataset.type.flags else numbers.kind


def _texts(dataset: Dataset, path: str) -> Iterator[str]:
    """Names one by one, as many may share their storage."""
    left = MAX_TEXT
    for text in dataset.texts():
        left -= len(text)
        if left < 0:
            raise _unexpected(path, f"at most {MAX_TEXT} characters", "more")
        try:
            yield text.decode("utf-8")
        except UnicodeDecodeError as error:
            raise _unexpected(path, "UTF-8 text", "other bytes") from error


def _outside(path: str, found: str) -> InputError:
    return InputError(path, "data in the file itself", found, "Copy the data into the file.")


def _unexpected(path: str, expected: str, found: str) -> InputError:
    return InputError(path, expected, found, _FIX)

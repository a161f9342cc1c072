"""The guarded door for HDF5: the only module that opens such a file.

A foreign HDF5 file can point to other files of the machine (external and soft links, external
storage, virtual datasets), ask for filters that are plug-ins, and declare arrays far larger than
itself. `GuardedFile` looks at the class of every link before it follows it, and at the layout,
the filters, the type and the size of every dataset before it reads it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal

import h5py
import numpy as np
from numpy.typing import NDArray

from facert.data.arrays import BoolArray, FloatArray, IntArray
from facert.data.rig import Mesh
from facert.data.version import CREATED_BY, MARK
from facert.errors import InputError, reading
from facert.io.atomic import writing
from facert.io.guarded import existing_file
from facert.io.hdf5_output import HDF5Output

TAKE_FORMAT, RIG_FORMAT = "facert-take", "facert-rig"
MAX_VALUES = 2**27
"""Most values of one dataset: 1 GiB of float64."""
MAX_NAMES = 2**14
MAX_NAME = 2**12
MAX_TEXT = 2**20
"""Most characters of all names together, and of one attribute."""

_PLAIN_FILTERS = {
    h5py.h5z.FILTER_DEFLATE,
    h5py.h5z.FILTER_SHUFFLE,
    h5py.h5z.FILTER_FLETCHER32,
    h5py.h5z.FILTER_LZF,
}
_NAMES_AT_ONCE = 64  # names may share their storage: read a few, then look how much it was


class GuardedFile:
    """Reading access to one open HDF5 file; every method raises `InputError` for what is unsafe.

    Paths are those of the HDF5 layout, e.g. ``"/source/names"``.
    """

    def __init__(self, file: h5py.File) -> None:
        self._file = file

    def __contains__(self, path: str) -> bool:
        """Whether there is something at `path`, without following a link to elsewhere."""
        return self._find(path) is not None

    def numbers(self, path: str) -> FloatArray:
        """Read a dataset of integers or floats as float64, any shape."""
        return self._read(path, "iuf", "numbers").astype(np.float64)

    def integers(self, path: str) -> IntArray:
        """Read a dataset of integers as int64, any shape."""
        return self._read(path, "iu", "integers").astype(np.int64)

    def flags(self, path: str) -> BoolArray:
        """Read a dataset of booleans, or of integers that stand for them."""
        return self._read(path, "biu", "booleans").astype(np.bool_)

    def rows(self, path: str) -> StoredRows:
        """A dataset of integers or floats that is read a few rows at a time; it may be large."""
        dataset = self._dataset(path)
        _check_layout(dataset, path)
        if _dtype(dataset, path).kind not in "iuf" or not dataset.ndim:
            raise _unexpected(path, "rows of numbers", _describe(dataset))
        _check_size(dataset, path, dataset.shape[1:])
        return StoredRows(dataset, path)

    def names(self, path: str) -> tuple[str, ...]:
        """Read a list of names: UTF-8 strings of fixed or variable length."""
        dataset = self._dataset(path)
        _check_storage(dataset, path)
        text = h5py.check_string_dtype(_dtype(dataset, path))
        if text is None or dataset.ndim != 1:
            raise _unexpected(path, "a list of strings", _describe(dataset))
        if len(dataset) > MAX_NAMES or (text.length or 0) > MAX_NAME:
            limits = f"at most {MAX_NAMES} names of {MAX_NAME} bytes"
            raise _unexpected(path, limits, _describe(dataset))
        names: list[str] = []
        for start in range(0, len(dataset), _NAMES_AT_ONCE):
            rows = _guarded_read(dataset.asstr("utf-8"), path, slice(start, start + _NAMES_AT_ONCE))
            names += [str(name) for name in rows]
            if sum(map(len, names)) > MAX_TEXT:
                raise _unexpected(path, f"at most {MAX_TEXT} characters", "more")
        return tuple(names)

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
        if isinstance(value, bytes):
            value = value.decode("utf-8", errors="replace")
        if not isinstance(value, str):
            raise _unexpected(f"attribute {name}", "text", f"{value!r}")
        return value

    def number_attribute(self, name: str, default: float | None = None) -> float:
        """Read a numeric attribute of the root; needed when there is no default."""
        value = self._attribute(name)
        if value is None and default is not None:
            return default
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            found = "nothing" if value is None else repr(value)
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

    def _find(self, path: str) -> Any:
        """Open the object at `path`, or None; h5py's own look-ups follow links, so not those."""
        here: Any = self._file
        for part in path.strip("/").split("/"):
            if not isinstance(here, h5py.Group):
                raise _unexpected(path, "groups on the way", "a dataset")
            links, name = here.id.links, part.encode()
            if not links.exists(name):
                return None
            if links.get_info(name).type != h5py.h5l.TYPE_HARD:
                raise _outside(path, f"a soft or external link at {part!r}")
            here = _guarded_read(here, path, part)
        return here

    def _dataset(self, path: str) -> h5py.Dataset:
        found = self._find(path)
        if not isinstance(found, h5py.Dataset):
            what = "nothing" if found is None else "a group or a type"
            raise InputError(path, "a dataset", what, f"Write {path}.")
        return found

    def _read(self, path: str, kinds: str, expected: str) -> NDArray[Any]:
        dataset = self._dataset(path)
        _check_storage(dataset, path)
        dtype = _dtype(dataset, path)
        if dtype.kind not in kinds:
            raise _unexpected(path, expected, _describe(dataset))
        return np.asarray(_guarded_read(dataset, path, ()))

    def _attribute(self, name: str) -> Any:
        """A scalar attribute of the root as a plain Python value, or None."""
        attributes, where = self._file.attrs, f"attribute {name}"
        if name not in attributes:
            return None
        try:
            identifier = attributes.get_id(name)
            scalar = math.prod(identifier.shape) == 1
            plain = scalar and identifier.get_storage_size() <= MAX_TEXT
            value = attributes[name] if plain else None
        except (OSError, TypeError, ValueError, RuntimeError, KeyError) as error:
            raise _unexpected(where, "one number or text", "something unreadable") from error
        if not plain:
            raise _unexpected(where, "one number or text", "an array")
        return value.item() if isinstance(value, (np.ndarray, np.generic)) else value


class StoredRows:
    """A dataset in an open file, read a few rows at a time."""

    def __init__(self, dataset: h5py.Dataset, path: str) -> None:
        self._dataset, self._path = dataset, path
        self.shape: tuple[int, ...] = dataset.shape

    def read(self, rows: IntArray) -> FloatArray:
        """Read some rows, (n, ...), as float64.

        Raises `InputError` when the data are damaged.
        """
        first, count = (int(rows[0]), len(rows)) if len(rows) else (0, 0)
        if np.array_equal(rows, np.arange(first, first + count)):
            block = _guarded_read(self._dataset, self._path, slice(first, first + count))
            return np.asarray(block, dtype=np.float64)
        return np.concatenate([self.read(rows[i : i + 1]) for i in range(count)])


@contextmanager
def open_guarded(path: Path) -> Iterator[GuardedFile]:
    """Open a foreign HDF5 file for reading; errors raised inside name the file.

    Raises `InputError` when the file is missing, is no HDF5 file, or is cut short.
    """
    path = Path(path)
    with reading(path):
        existing_file(path)
        try:
            file = h5py.File(path, "r")
        except OSError as error:
            whole = "a whole HDF5 file"
            found = "a truncated or damaged one" if h5py.is_hdf5(path) else "something else"
            raise InputError("file", whole, found, "Export or copy it again.") from error
        with file:
            yield GuardedFile(file)


def stated_format(path: Path) -> str:
    """The format that an HDF5 file states; empty for a file of another kind, or none."""
    if not h5py.is_hdf5(path):
        return ""
    with open_guarded(path) as file:
        return file.text_attribute("format")


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

        Its compression is the quickest one: of a face in motion, gzip saves 5 % more bytes than
        lzf and takes three times as long.
        """
        packing = {"chunks": (1, *shape[1:]), "compression": "lzf", "shuffle": True}
        return NewRows(self._file.create_dataset(path, shape, np.float32, **packing), self._output)

    def names(self, path: str, names: Sequence[str]) -> None:
        """Write a list of names as UTF-8 strings."""
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


def _check_storage(dataset: h5py.Dataset, path: str) -> None:
    """Refuse a dataset that is not plain data, or is too large to read at once."""
    _check_layout(dataset, path)
    _check_size(dataset, path, dataset.shape)


def _check_layout(dataset: h5py.Dataset, path: str) -> None:
    """Refuse data that lie in other files or need plug-ins."""
    properties = dataset.id.get_create_plist()
    if dataset.is_virtual or properties.get_external_count():
        raise _outside(path, "a virtual dataset or external storage")
    filters = [properties.get_filter(index) for index in range(properties.get_nfilters())]
    foreign = [number for number, *_ in filters if number not in _PLAIN_FILTERS]
    if foreign:
        expected, fix = (
            "only gzip, lzf, shuffle and fletcher32",
            "Write it again with one of these.",
        )
        raise InputError(path, expected, f"filter {foreign[0]}", fix)
    if dataset.shape is None:
        raise _unexpected(path, "an array", "an empty dataspace")


def _check_size(dataset: h5py.Dataset, path: str, shape: tuple[int, ...]) -> None:
    """Refuse a declared size that would fill the memory when an array of `shape` is read."""
    if max(math.prod(shape), math.prod(dataset.chunks or ())) > MAX_VALUES:
        raise _unexpected(path, f"at most {MAX_VALUES} values", f"shape {dataset.shape}")


def _dtype(dataset: h5py.Dataset, path: str) -> np.dtype[Any]:
    """The dataset's NumPy type; HDF5 has types for which there is none."""
    try:
        dtype: np.dtype[Any] = dataset.dtype
    except (TypeError, ValueError) as error:
        raise _unexpected(path, "numbers or strings", "an unknown type") from error
    return dtype


def _guarded_read(container: Any, path: str, key: Any) -> Any:
    """``container[key]``, where damaged bytes are the file's fault and not a crash."""
    try:
        return container[key]
    except UnicodeDecodeError as error:
        raise _unexpected(path, "UTF-8 text", "other bytes") from error
    except (OSError, KeyError, ValueError, TypeError, RuntimeError) as error:
        raise _unexpected(path, "readable data", "damaged data") from error


def _describe(dataset: h5py.Dataset) -> str:
    return f"{dataset.dtype} {dataset.shape}"


def _outside(path: str, found: str) -> InputError:
    return InputError(path, "data in the file itself", found, "Copy the data into the file.")


def _unexpected(path: str, expected: str, found: str) -> InputError:
    return InputError(path, expected, found, "Check the program that wrote the file.")

import json
import pickle
import struct
import tracemalloc
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from safetensors.numpy import save

from facert.errors import InputError, OutputExistsError
from facert.io import tensors
from facert.io.tensors import MAX_TENSORS, Declared

METADATA = {"format": "facert-model", "format_version": 1, "note": "é"}
ARRAYS = {"a": np.arange(6.0).reshape(2, 3), "b": np.array([1.0])}


@dataclass(frozen=True)
class Note:
    """What the files here say."""

    note: str
    count: int = 0


def write_tensors(path: Path, arrays, note: Note = Note("é"), overwrite: bool = False) -> None:
    tensors.write_tensors(path, arrays, note, "facert-model", overwrite)


def read_tensors(path: Path, expected: str, check=lambda *_: None):
    return tensors.read_tensors(path, expected, Note, check)


@pytest.fixture
def path(tmp_path):
    return tmp_path / "model.safetensors"


def write_raw(path: Path, arrays, metadata=METADATA) -> None:
    """What another program would write."""
    path.write_bytes(save(arrays, {"facert": json.dumps(metadata)}))


def write_header(path: Path, header: bytes, length: int | None = None) -> None:
    path.write_bytes(struct.pack("<Q", len(header) if length is None else length) + header)


def refused(path: Path, message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        read_tensors(path, "facert-model")
    assert caught.value.where == str(path)
    assert "\n" not in str(caught.value)


def test_arrays_and_metadata_come_back(path):
    write_tensors(path, ARRAYS)
    arrays, metadata = read_tensors(path, "facert-model")
    assert metadata == Note("é")
    assert arrays.keys() == ARRAYS.keys()
    for name, array in ARRAYS.items():
        np.testing.assert_array_equal(arrays[name], array)


def test_any_order_in_memory_is_written_right(path):
    write_tensors(path, {"a": ARRAYS["a"].T})
    np.testing.assert_array_equal(read_tensors(path, "facert-model")[0]["a"], ARRAYS["a"].T)


def test_the_same_content_gives_the_same_bytes(path, tmp_path):
    write_tensors(path, ARRAYS)
    write_tensors(tmp_path / "other.safetensors", dict(reversed(ARRAYS.items())))
    assert path.read_bytes() == (tmp_path / "other.safetensors").read_bytes()


def test_an_existing_file_stays_unless_it_may_be_replaced(path):
    write_tensors(path, {"other": np.ones(3)})
    before = path.read_bytes()
    with pytest.raises(OutputExistsError):
        write_tensors(path, ARRAYS)
    assert path.read_bytes() == before
    write_tensors(path, ARRAYS, overwrite=True)
    assert read_tensors(path, "facert-model")


@pytest.mark.parametrize("share", [0.0, 0.01, 0.3, 0.99])
def test_a_truncated_file_is_refused(path, share):
    write_tensors(path, ARRAYS)
    content = path.read_bytes()
    path.write_bytes(content[: int(share * len(content))])
    refused(path, "the header: expected")


def test_a_pickle_is_never_opened(path, tmp_path):
    """It would make a file if it were."""

    class Bomb:
        def __reduce__(self):
            return Path.touch, (tmp_path / "exploded",)

    path.write_bytes(pickle.dumps(Bomb()))
    refused(path, "expected a safetensors file, found something else")
    assert not (tmp_path / "exploded").exists()


@pytest.mark.parametrize("length", [2**63, 2**40, 1000])
def test_a_header_that_claims_to_be_longer_than_the_file_is_refused(path, length):
    write_header(path, b"{}", length)
    refused(path, "the header")


def test_a_header_of_deep_brackets_is_refused(path):
    write_header(path, b'{"a":' + b"[" * 100_000)
    refused(path, "the header")


def test_metadata_of_deep_brackets_is_refused(path):
    path.write_bytes(save(ARRAYS, {"facert": "[" * 100_000}))
    refused(path, "the metadata")


def test_more_arrays_than_any_model_has_are_refused(path):
    write_raw(path, {f"a{i}": np.zeros(1) for i in range(MAX_TENSORS + 1)})
    refused(path, "at most 256 arrays")


@pytest.mark.parametrize(
    "array",
    [
        np.array([1.0, np.nan]),
        np.array([np.inf]),
        np.array([1.0], dtype=np.float32),
        np.array([1], dtype=np.int64),
    ],
)
def test_anything_but_finite_float64_is_refused_by_name(path, array):
    write_raw(path, {"kernel": array})
    refused(path, "kernel: expected finite float64")


@pytest.mark.parametrize("metadata", ["text", [1], 3, None, {}, {"format": "facert-model"}])
def test_metadata_of_another_kind_is_refused(path, metadata):
    write_raw(path, ARRAYS, metadata)
    refused(path, "the metadata: expected a facert-model file")


@pytest.mark.parametrize(
    ("metadata", "message"),
    [
        ({"note": [1]}, "the metadata.note: expected str, found a list"),
        ({"count": True}, "the metadata.count: expected int, found True"),
        ({"count": 1e400}, "the metadata.count: expected int, found inf"),
        ({"note": "\ud800"}, "the metadata.note: expected text"),
    ],
)
def test_metadata_of_another_type_is_refused_by_its_field(path, metadata, message):
    write_raw(path, ARRAYS, METADATA | metadata)
    refused(path, message)


def test_a_name_twice_in_the_metadata_is_refused(path):
    twice = json.dumps(METADATA)[:-1] + ', "note": "other"}'
    path.write_bytes(save(ARRAYS, {"facert": twice}))
    refused(path, "the metadata")


def test_metadata_of_a_newer_version_are_passed_over_and_named(path, caplog):
    write_raw(path, ARRAYS, METADATA | {"colour": [[]]})
    assert read_tensors(path, "facert-model")[1] == Note("é")
    assert "passed over, as a newer facert wrote it: colour" in caplog.text


def sparse(path: Path, entries: dict[str, tuple[int, ...]], size: int) -> None:
    """A file whose arrays are one hole."""
    end, header = 0, {"__metadata__": {"facert": json.dumps(METADATA)}}
    for name, shape in entries.items():
        offsets = [end, end := end + 8 * int(np.prod(shape, dtype=object))]
        header[name] = {"dtype": "F64", "shape": shape, "data_offsets": offsets}
    write_header(path, json.dumps(header).encode())
    with path.open("r+b") as file:
        file.truncate(path.stat().st_size + size)


def test_shapes_are_looked_at_before_an_array_is_read(path):
    sparse(path, {"a": (2**18, 2**18)}, 2**39)

    def check(declared, note):
        assert declared == {"a": Declared("F64", (2**18, 2**18), (0, 2**39))}
        assert note == Note("é")
        raise InputError("a", "fewer", "many", "Cut it.")

    with pytest.raises(InputError, match="a: expected fewer"):
        read_tensors(path, "facert-model", check)


def test_arrays_that_take_more_memory_than_they_may_are_refused_unread(path):
    sparse(path, {"a": (2**18, 2**18)}, 2**39)
    refused(path, "the arrays: expected at most .* of memory")


@pytest.mark.parametrize("shape", [(2**62, 2**62), (-1, 3), (2.0, 3), (True,), "ab", [[1]]])
def test_shapes_that_cannot_be_are_refused(path, shape):
    entry = {"dtype": "F64", "shape": shape, "data_offsets": [0, 8]}
    header = {"__metadata__": {"facert": json.dumps(METADATA)}, "a": entry}
    write_header(path, json.dumps(header).encode() + b" " * 8)
    refused(path, "expected")


def test_what_a_check_of_the_new_file_refuses_leaves_the_old_one(path):
    write_tensors(path, ARRAYS)
    before = path.read_bytes()

    def check(written: Path) -> None:
        assert written.read_bytes() != before
        raise InputError("a", "something else", "this", "Change it.")

    with pytest.raises(InputError, match="something else"):
        tensors.write_tensors(path, {"a": np.ones(2)}, Note("b"), "facert-model", True, check)
    assert [*path.parent.iterdir()] == [path]
    assert path.read_bytes() == before


def test_a_file_of_another_program_is_refused(path):
    path.write_bytes(save(ARRAYS))
    refused(path, "no facert metadata")


def test_a_file_of_another_kind_or_a_newer_version_is_refused(path):
    write_raw(path, ARRAYS, {**METADATA, "format": "facert-checkpoint"})
    refused(path, "format: expected facert-model, found 'facert-checkpoint'")
    write_raw(path, ARRAYS, {**METADATA, "format_version": 2})
    refused(path, "format_version: expected 1, found 2. Update facert")


def test_a_file_that_is_not_there_is_named(path):
    refused(path, "expected")


@pytest.mark.parametrize("places", [((0, 8), (0, 8)), ((8, 16), (8, 16)), ((0, 16), (16, 16))])
def test_arrays_that_overlap_or_leave_gaps_are_refused(path, places):
    array = {"dtype": "F64", "shape": [1]}
    header = {"__metadata__": {"facert": json.dumps(METADATA)}}
    header |= {name: array | {"data_offsets": at} for name, at in zip("ab", places, strict=True)}
    text = json.dumps(header).encode()
    write_header(path, text + bytes(16), len(text))
    refused(path, "expected data_offsets")


def test_arrays_are_in_memory_once(path):
    write_tensors(path, {"a": np.zeros(500_000), "b": np.zeros(500_000)})
    tracemalloc.start()
    read_tensors(path, "facert-model")
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 1.2 * path.stat().st_size

import json
import pickle
import struct
from pathlib import Path

import numpy as np
import pytest
from safetensors.numpy import save

from facert.errors import InputError, OutputExistsError
from facert.io.tensors import MAX_TENSORS, read_tensors, write_tensors

METADATA = {"format": "facert-model", "format_version": 1, "note": "é"}
ARRAYS = {"a": np.arange(6.0).reshape(2, 3), "b": np.array([1.0])}


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
    write_tensors(path, ARRAYS, METADATA)
    arrays, metadata = read_tensors(path, "facert-model")
    assert metadata == METADATA
    assert arrays.keys() == ARRAYS.keys()
    for name, array in ARRAYS.items():
        np.testing.assert_array_equal(arrays[name], array)


def test_any_order_in_memory_is_written_right(path):
    write_tensors(path, {"a": ARRAYS["a"].T}, METADATA)
    np.testing.assert_array_equal(read_tensors(path, "facert-model")[0]["a"], ARRAYS["a"].T)


def test_the_same_content_gives_the_same_bytes(path, tmp_path):
    write_tensors(path, ARRAYS, METADATA)
    write_tensors(tmp_path / "other.safetensors", ARRAYS, dict(reversed(METADATA.items())))
    assert path.read_bytes() == (tmp_path / "other.safetensors").read_bytes()


def test_an_existing_file_stays_unless_it_may_be_replaced(path):
    write_tensors(path, {"other": np.ones(3)}, METADATA)
    before = path.read_bytes()
    with pytest.raises(OutputExistsError):
        write_tensors(path, ARRAYS, METADATA)
    assert path.read_bytes() == before
    write_tensors(path, ARRAYS, METADATA, overwrite=True)
    assert read_tensors(path, "facert-model")


@pytest.mark.parametrize("share", [0.0, 0.01, 0.3, 0.99])
def test_a_truncated_file_is_refused(path, share):
    write_tensors(path, ARRAYS, METADATA)
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

"""Whatever structures the HDF5 library writes, facert's reader gives the library's own numbers."""

import io

import h5py
import numpy as np
import pytest

from facert.errors import InputError
from facert.io.hdf5 import open_guarded
from facert.io.hdf5_reader.stored_bytes import DamagedError, StoredBytes, checksum

VERSIONS = ["earliest", "v110", "latest"]
GZIP = {"compression": "gzip", "shuffle": True}
# From the dataset's name to its shape, and to how it is stored.
STORED = {
    "plain": ((7, 3), {}),
    "nothing": ((0, 3), {}),
    "one chunk": ((7, 3), {"chunks": (7, 3), **GZIP}),
    "one plain chunk": ((7, 3), {"chunks": (7, 3)}),
    "fixed": ((70, 3), {"chunks": (4, 2), "compression": "lzf"}),
    "fixed, to grow": ((70, 3), {"chunks": (4, 2), "maxshape": (99, 8), **GZIP}),
    "fixed, of pages": ((1030,), {"chunks": (1,)}),
    "extensible": ((70, 3), {"chunks": (4, 2), "maxshape": (None, 5), "fletcher32": True}),
    "extensible, of super blocks": ((300,), {"chunks": (1,), "maxshape": (None,), **GZIP}),
    "extensible at last": ((2, 3, 40), {"chunks": (1, 2, 3), "maxshape": (2, 9, None)}),
    "tree": ((40, 30), {"chunks": (3, 4), "maxshape": (None, None), **GZIP}),
    "plain tree": ((40, 30), {"chunks": (3, 4), "maxshape": (None, None)}),
    "three filters": ((9, 50), {"chunks": (4, 17), "fletcher32": True, **GZIP}),
}


@pytest.fixture
def path(tmp_path):
    return tmp_path / "file.h5"


def assert_read_as_by_h5py(path):
    """All datasets of numbers, as a whole and in rows."""
    with h5py.File(path) as file, open_guarded(path) as guarded:
        found: list[str] = []
        file.visit(found.append)
        datasets = [name for name in found if isinstance(file[name], h5py.Dataset)]
        for name in datasets:
            expected = np.asarray(file[name][()], np.float64)
            np.testing.assert_array_equal(guarded.numbers(name), expected, err_msg=name)
            if expected.ndim:
                rows = guarded.rows(name)
                for some in (np.arange(len(expected) // 2), np.arange(len(expected))[::-13]):
                    np.testing.assert_array_equal(rows.read(some), expected[some], err_msg=name)
    return len(datasets)


@pytest.mark.parametrize("version", VERSIONS)
def test_every_layout_and_index_of_chunks(path, version):
    rng = np.random.default_rng(0)
    with h5py.File(path, "w", libver=(version, "latest"), userblock_size=1024) as file:
        for name, (shape, how) in STORED.items():
            file.create_dataset(name, data=rng.normal(size=shape), **how)
            some = file.create_dataset(f"some of {name}", shape, "f8", fillvalue=7, **how)
            if shape[0]:
                some[shape[0] // 2] = rng.normal(size=shape[1:])
            file.create_dataset(f"unwritten {name}", shape, ">i2", fillvalue=-2, **how)
        grown = file.create_dataset("grown", data=np.ones((3, 3)), maxshape=(None, 3))
        grown.resize((50, 3))
        file["scalar"] = 2.5
    assert assert_read_as_by_h5py(path) == 3 * len(STORED) + 2


@pytest.mark.parametrize("filters", [{}, GZIP])
def test_an_extensible_array_whose_blocks_are_so_large_that_they_have_pages(path, filters):
    written = [0, 17, 5000, 131_000, 140_000, 200_001, 262_143, 262_144, 399_999]
    how = {"chunks": (1,), "maxshape": (None,), **filters}
    with h5py.File(path, "w", libver="v110") as file:
        data = file.create_dataset("data", (400_000,), "f8", **how)
        for number in written:
            data[number] = number + 1
    with open_guarded(path) as guarded:
        read = guarded.numbers("/data")
    assert np.flatnonzero(read).tolist() == written
    assert read[written].tolist() == [number + 1 for number in written]


def stored_as(file, name, values, layout):
    """A dataset as only the library's lower level writes it."""
    how = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    layout(how)
    space = h5py.h5s.create_simple(values.shape)
    dataset = h5py.h5d.create(file.id, name, h5py.h5t.NATIVE_DOUBLE, space, how)
    dataset.write(h5py.h5s.ALL, h5py.h5s.ALL, values)


@pytest.mark.parametrize("version", VERSIONS)
def test_numbers_within_the_header_and_chunks_without_an_index(path, version):
    def implicit(how):
        how.set_chunk((4, 3))
        how.set_alloc_time(h5py.h5d.ALLOC_TIME_EARLY)

    values = np.random.default_rng(0).normal(size=(10, 7))
    with h5py.File(path, "w", libver=(version, "latest")) as file:
        stored_as(file, b"compact", values, lambda how: how.set_layout(h5py.h5d.COMPACT))
        stored_as(file, b"implicit", values, implicit)
        file["a type"] = np.dtype("f4")
        file.create_dataset("of a named type", data=values, dtype=file["a type"])
    assert assert_read_as_by_h5py(path) == 3


@pytest.mark.parametrize("ordered", [False, True])
@pytest.mark.parametrize("version", VERSIONS)
def test_many_links_and_attributes(path, version, ordered):
    long = "ü" * 5000
    with h5py.File(path, "w", libver=(version, "latest"), track_order=ordered) as file:
        group = file.create_group("deep/deeper", track_order=ordered)
        for index in range(300):
            group[f"link {index}"] = float(index)
        for index in range(40):
            file.attrs[f"number {index}"] = index
        file.attrs.update(long=long, raw=np.bytes_("raw"), longer=np.bytes_(b"y" * 40000))
    with open_guarded(path) as guarded:
        assert [guarded.numbers(f"/deep/deeper/link {i}") for i in range(300)] == list(range(300))
        assert "/deep/deeper/link 300" not in guarded
        assert [guarded.number_attribute(f"number {i}") for i in range(40)] == list(range(40))
        assert guarded.text_attribute("long") == long
        assert guarded.text_attribute("raw") == "raw"
        assert guarded.text_attribute("longer") == "y" * 40000


def text_of_length(size, padding):
    kind = h5py.h5t.C_S1.copy()
    kind.set_size(size)
    kind.set_strpad(padding)
    return kind


@pytest.mark.parametrize("padding", ["SPACEPAD", "NULLPAD", "NULLTERM"])
def test_texts_of_fixed_length_however_they_are_filled_up(path, padding):
    names = np.array([b"jaw", b"", b"brow up"])
    with h5py.File(path, "w") as file:
        kind = text_of_length(8, getattr(h5py.h5t, f"STR_{padding}"))
        space = h5py.h5s.create_simple(names.shape)
        h5py.h5d.create(file.id, b"names", kind, space).write(h5py.h5s.ALL, h5py.h5s.ALL, names)
    with open_guarded(path) as guarded:
        assert guarded.names("/names") == ("jaw", "", "brow up")


def test_flags_and_empty_text_as_pytables_has_them(path):
    flags = np.array([1, 0, 1], np.uint8)
    with h5py.File(path, "w") as file:
        space, kind = h5py.h5s.create_simple(flags.shape), h5py.h5t.STD_B8LE
        data = h5py.h5d.create(file.id, b"flags", kind, space)
        data.write(h5py.h5s.ALL, h5py.h5s.ALL, flags, kind)
        file.attrs["units"] = h5py.Empty("S1")
    with open_guarded(path) as guarded:
        assert guarded.flags("/flags").tolist() == [True, False, True]
        assert guarded.text_attribute("units", "cm") == ""


def test_the_checksum_is_that_of_its_author():
    assert checksum(b"Four score and seven years ago") == 0x17770551


def test_checksums_of_a_file_of_holes_take_no_minutes():
    hole = b"FADB" + bytes(2**22)
    file = StoredBytes(io.BytesIO(hole), len(hole))
    with pytest.raises(DamagedError, match="a wrong checksum"):
        file.checked(0, 100, b"FADB")
    assert file.checked(0, len(hole), b"FADB").left == 2**22 - 4
    with pytest.raises(DamagedError, match="bytes of FADB"):
        file.checked(0, 2**24 + 1, b"FADB")


@pytest.mark.parametrize("filters", [{"compression": "gzip"}, {"compression": "lzf"}, {}])
def test_a_changed_number_is_noticed_where_the_file_has_checksums(path, filters):
    with h5py.File(path, "w") as file:
        numbers = np.arange(20.0)
        file.create_dataset("/data", data=numbers, chunks=(20,), fletcher32=True, **filters)
        chunk = file["/data"].id.get_chunk_info(0)
    content = bytearray(path.read_bytes())
    content[chunk.byte_offset + chunk.size // 2] ^= 1
    path.write_bytes(content)
    with open_guarded(path) as guarded, pytest.raises(InputError, match="damaged"):
        guarded.numbers("/data")

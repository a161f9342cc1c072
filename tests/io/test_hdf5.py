"""Every guard is tested against a file that this test writes with plain h5py."""

import re
from pathlib import Path

import h5py
import numpy as np
import pytest

import facert
from facert.errors import InputError
from facert.io.hdf5 import MAX_VALUES, open_guarded


@pytest.fixture
def path(tmp_path):
    return tmp_path / "file.h5"


def secret_file(folder):
    """A file elsewhere that no foreign file may reach."""
    other = folder / "secret.h5"
    with h5py.File(other, "w") as file:
        file["/group/data"] = np.arange(3.0)
    return other


def soft_link(file, folder):
    file["/real"] = np.arange(3.0)
    file["/data"] = h5py.SoftLink("/real")


def external_link(file, folder):
    file["/data"] = h5py.ExternalLink(str(secret_file(folder)), "/group/data")


def virtual_dataset(file, folder):
    layout = h5py.VirtualLayout(shape=(3,), dtype="f8")
    layout[:] = h5py.VirtualSource(str(secret_file(folder)), "/group/data", shape=(3,))
    file.create_virtual_dataset("/data", layout)


def external_storage(file, folder):
    (folder / "raw").write_bytes(bytes(24))
    file.create_dataset("/data", (3,), "f8", external=[(str(folder / "raw"), 0, 24)])


def foreign_filter(file, folder):
    file.create_dataset("/data", data=np.arange(3), chunks=(3,), scaleoffset=True)


def object_type(file, folder):
    file.create_dataset("/data", (3,), h5py.vlen_dtype(np.float64))


def reference_type(file, folder):
    file.create_dataset("/data", (3,), h5py.ref_dtype)


def compound_type(file, folder):
    file.create_dataset("/data", (3,), np.dtype([("a", "f8")]))


def text_type(file, folder):
    file["/data"] = ["one", "two"]


def complex_type(file, folder):
    file["/data"] = np.ones(3, complex)


def shape_bomb(file, folder):
    file.create_dataset("/data", (MAX_VALUES + 1,), "f4", chunks=(1024,), compression="gzip")


def chunk_bomb(file, folder):
    file.create_dataset("/data", (1,), "u1", chunks=(MAX_VALUES + 1,), maxshape=(None,))


def empty_dataspace(file, folder):
    file["/data"] = h5py.Empty("f8")


def group(file, folder):
    file.create_group("/data")


def nothing(file, folder):
    pass


MALICIOUS = [
    (soft_link, "soft or external link"),
    (external_link, "soft or external link"),
    (virtual_dataset, "virtual dataset or external storage"),
    (external_storage, "virtual dataset or external storage"),
    (foreign_filter, "filter"),
    (object_type, "expected numbers"),
    (reference_type, "expected numbers"),
    (compound_type, "expected numbers"),
    (text_type, "expected numbers"),
    (complex_type, "expected numbers"),
    (shape_bomb, "at most"),
    (chunk_bomb, "at most"),
    (empty_dataspace, "an array"),
    (group, "a dataset"),
    (nothing, "found nothing"),
]


@pytest.mark.parametrize(("write", "message"), MALICIOUS)
def test_what_is_not_plain_numbers_in_the_file_itself_is_refused(tmp_path, path, write, message):
    with h5py.File(path, "w") as file:
        write(file, tmp_path)
    with pytest.raises(InputError, match=message) as caught, open_guarded(path) as guarded:
        guarded.numbers("/data")
    assert str(caught.value).startswith(f"{path}: /data: ")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("link", [h5py.SoftLink("/real"), "external"])
def test_links_on_the_way_to_a_dataset_are_refused_too(tmp_path, path, link):
    with h5py.File(path, "w") as file:
        file["/real/data"] = np.arange(3.0)
        target = h5py.ExternalLink(str(secret_file(tmp_path)), "/group")
        file["/group"] = target if link == "external" else link
    with open_guarded(path) as guarded, pytest.raises(InputError, match="link at 'group'"):
        guarded.numbers("/group/data")
    with open_guarded(path) as guarded, pytest.raises(InputError, match="link at 'group'"):
        _ = "/group/data" in guarded


@pytest.mark.parametrize("filters", [{"compression": "gzip"}, {"compression": "lzf"}, {}])
@pytest.mark.parametrize("dtype", ["f2", "f4", "f8", ">f8", "i1", "u2", "i8"])
def test_plain_numbers_come_as_float64(path, dtype, filters):
    values = np.arange(12).reshape(3, 4)
    packing = {"shuffle": True, "fletcher32": True, **filters} if filters else {}
    with h5py.File(path, "w") as file:
        file.create_dataset("/group/data", data=values.astype(dtype), **packing)
    with open_guarded(path) as guarded:
        read = guarded.numbers("/group/data")
    assert read.dtype == np.float64
    np.testing.assert_array_equal(read, values)


@pytest.mark.parametrize("dtype", [bool, np.uint8])
def test_flags_are_booleans_or_integers(path, dtype):
    with h5py.File(path, "w") as file:
        file["/valid"] = np.array([1, 0, 1], dtype)
    with open_guarded(path) as guarded:
        assert guarded.flags("/valid").tolist() == [True, False, True]


@pytest.mark.parametrize("dtype", [h5py.string_dtype(), h5py.string_dtype(length=20), "S20"])
def test_names_are_strings_of_fixed_or_variable_length(path, dtype):
    names = [f"name{index}" for index in range(200)]
    with h5py.File(path, "w") as file:
        file.create_dataset("/names", data=names, dtype=dtype)
    with open_guarded(path) as guarded:
        assert guarded.names("/names") == tuple(names)


def test_names_that_are_no_strings_or_no_utf8_are_refused(path):
    with h5py.File(path, "w") as file:
        file["/numbers"] = np.arange(3)
        file.create_dataset("/latin", data=[b"\xe9t\xe9"], dtype=h5py.string_dtype())
        file.create_dataset("/long", (2,), "S1000000")
        file.create_dataset("/many", (100_000,), h5py.string_dtype())
    with open_guarded(path) as guarded:
        for name, message in [
            ("/numbers", "a list of strings"),
            ("/latin", "UTF-8"),
            ("/long", "at most"),
            ("/many", "at most"),
        ]:
            with pytest.raises(InputError, match=message):
                guarded.names(name)


def test_attributes_are_one_number_or_text(path):
    with h5py.File(path, "w") as file:
        file.attrs.update(fps=np.float32(30), text="cm", raw=np.bytes_(b"mm"), array=[1, 2])
    with open_guarded(path) as guarded:
        assert guarded.number_attribute("fps") == 30.0
        assert guarded.text_attribute("text") == "cm"
        assert guarded.text_attribute("raw") == "mm"
        assert guarded.text_attribute("absent", "default") == "default"
        assert guarded.number_attribute("absent", 2.0) == 2.0
        for read, name in [
            (guarded.number_attribute, "absent"),
            (guarded.number_attribute, "text"),
            (guarded.number_attribute, "array"),
            (guarded.text_attribute, "fps"),
        ]:
            with pytest.raises(InputError, match=f"attribute {name}"):
                read(name)


def test_a_file_that_is_missing_cut_short_or_something_else_is_named_as_such(tmp_path):
    with pytest.raises(InputError, match="found nothing"), open_guarded(tmp_path / "no.h5"):
        pass
    with pytest.raises(InputError, match="a folder"), open_guarded(tmp_path):
        pass
    text = tmp_path / "text.h5"
    text.write_text("no HDF5")
    with pytest.raises(InputError, match="something else"), open_guarded(text):
        pass
    whole = secret_file(tmp_path)
    whole.write_bytes(whole.read_bytes()[:-600])
    with pytest.raises(InputError, match="truncated"), open_guarded(whole):
        pass


def test_damaged_data_are_the_files_fault(path):
    with h5py.File(path, "w") as file:
        data = np.random.default_rng(0).normal(size=1000)
        file.create_dataset("/data", data=data, chunks=(1000,), compression="gzip")
        offset = file["/data"].id.get_chunk_info(0).byte_offset
    content = bytearray(path.read_bytes())
    content[offset : offset + 200] = bytes(200)
    path.write_bytes(content)
    with open_guarded(path) as guarded, pytest.raises(InputError, match="damaged"):
        guarded.numbers("/data")


def test_nothing_else_in_the_package_opens_hdf5():
    package = Path(facert.__file__).parent
    users = {
        path.relative_to(package).as_posix()
        for path in package.rglob("*.py")
        if re.search(r"^\s*(import|from)\s+h5py", path.read_text(), re.MULTILINE)
    }
    # What scripts share runs in Blender's and Maya's own Python, where facert is not installed.
    assert users == {"io/hdf5.py", "io/importers/shared.py"}

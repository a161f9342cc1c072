"""HDF5 files that are damaged, or made to take time and memory: an error says so, at once.

The HDF5 library never returns from some of these, or crashes.
"""

import os
import subprocess
import sys
import time
from dataclasses import replace

import h5py
import numpy as np
import pytest

from facert.data.memory import VARIABLE
from facert.data.rig import Rig
from facert.data.take import Controls, Source, Take
from facert.errors import InputError
from facert.io.hdf5 import MAX_TEXT, StoredRows, open_guarded
from facert.io.hdf5_reader.stored_bytes import checksum
from facert.io.rig import read_rig, write_rig
from facert.io.take import read_take, write_take

SECONDS = 2.0  # of CPU, and ten times what any of these takes


@pytest.fixture(autouse=True)
def in_time(monkeypatch):
    monkeypatch.delenv(VARIABLE, raising=False)
    begin = time.process_time()
    yield
    assert time.process_time() - begin < SECONDS


@pytest.fixture
def path(tmp_path):
    return tmp_path / "file.h5"


def a_take(path):
    params = np.random.default_rng(0).random((4, 2))
    controls = Controls(("a", "b"))
    source = Source(params + 1, ("one", "two"))
    take = Take(np.arange(4) / 60, source, controls, params, units="cm", up_axis="Y")
    write_take(replace(take, start_timecode="13:13:04:31"), path)


def a_rig(path):
    rng = np.random.default_rng(0)
    faces = np.array([[0, 1, 2]])
    write_rig(Rig(rng.normal(size=(3, 3)), rng.normal(size=(2, 3, 3)), ("a", "b"), faces), path)


def newest(path):
    """A rig in HDF5's newest structures."""
    rng = np.random.default_rng(0)
    with h5py.File(path, "w", libver="latest", track_order=True) as file:
        file.attrs.update(format="facert-rig", format_version=1, units="cm")
        file.create_dataset("/shapes", data=rng.normal(size=(2, 3, 3)), maxshape=(None, 3, 3))
        file.create_dataset("/neutral", data=rng.normal(size=(3, 3)), chunks=(1, 3))
        file["/faces"], file["/names"] = np.array([[0, 1, 2]]), np.array([b"a", b"b"])


@pytest.mark.parametrize(
    ("write", "read"), [(a_take, read_take), (a_rig, read_rig), (newest, read_rig)]
)
def test_a_byte_changed_anywhere_is_read_or_refused(path, write, read):
    write(path)
    content, refused = path.read_bytes(), 0
    used = [at for at, byte in enumerate(content) if byte]  # most of a small file is empty
    for at in used[:: len(used) // 60]:
        path.write_bytes(changed(content, at, 0xFF))
        try:
            read(path)
        except InputError:
            refused += 1
    assert refused > 20


def changed(content, at, flip):
    return content[:at] + bytes([content[at] ^ flip]) + content[at + 1 :]


def sizes_in_heap(content):
    """Where the sizes of the texts in the heap stand."""
    at = content.index(b"GCOL") + 16
    while content[at] and content[at : at + 2] != b"\0\0":
        yield at + 8
        at += 16 + -(-int.from_bytes(content[at + 8 : at + 16], "little") // 8) * 8
    yield at + 8  # of the free space


def test_bytes_with_which_the_library_hangs_or_crashes(path, tmp_path):
    a_take(path)
    content = path.read_bytes()
    texts = [content.index(name) for name in (b"units\0", b"up_axis\0", b"start_timecode\0")]
    types = [content.index(b"\x19\x01", at) + 1 for at in texts]
    files = []
    for at in [*sizes_in_heap(content), *types]:
        files.append(tmp_path / f"{at}.h5")
        files[-1].write_bytes(changed(content, at, 0xFF))
    # In a process of its own, so that one that hangs can be ended.
    read = "try: print(bool(read_take(Path(name))))\n except InputError as e: print('refused')"
    run = (
        "import sys; from pathlib import Path; from facert.errors import InputError\n"
        f"from facert.io.take import read_take\nfor name in sys.argv[1:]:\n {read}"
    )
    command = [sys.executable, "-c", run, *map(str, files)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
    assert len(files) > 8
    said = done.stdout.split()
    assert len(said) == len(files)
    assert said.count("refused") >= len(files) - 2  # the free space of the heap has no meaning


def zeros(file, shape, chunks, **how):
    """An array of zeros, of which a MiB is packed into a KiB or so."""
    data = file.create_dataset("/data", shape, "f8", chunks=chunks, compression="gzip", **how)
    step = max(1, shape[0] // 8)
    for start in range(0, shape[0], step):
        data[start : start + step] = np.zeros((min(step, shape[0] - start), *shape[1:]))


def chunks_of_zeros(file):
    zeros(file, (2**20,), (2**16,))


def one_chunk_of_zeros(file):
    """Of one number, in a chunk of 8 MiB."""
    file.create_dataset("/data", (1,), "f8", chunks=(2**20,), maxshape=(None,), compression="gzip")
    file["/data"][0] = 1.0


def padded_chunks(file):
    """1 MiB within 8 MiB of chunks."""
    how = {"chunks": (2, 2**13), "maxshape": (None, None), "compression": "gzip"}
    data = file.create_dataset("/data", (128, 2**10), "f8", **how)
    data[...] = np.zeros((128, 2**10))


def never_written(file):
    file.create_dataset("/data", (2**27,), "f8", chunks=(1024,))


def never_allocated(file):
    file.create_dataset("/data", (2**13, 2**13), "f8")


def many_arrays(file):
    """Each within the limit, all together beyond."""
    for name in "abcdefg":
        file.create_dataset(f"/{name}", (2**20,), "f8")
    file.create_dataset("/data", (2**20,), "f8")
    file.create_dataset("/more", (2**20,), "f8")


def names_of_one_text(file):
    """Names that share their storage: see `share`."""
    text = "x" * (MAX_TEXT // 4)
    file.create_dataset("/names", data=[text, *["y"] * 9999], dtype=h5py.string_dtype())


@pytest.mark.parametrize(
    "make", [chunks_of_zeros, one_chunk_of_zeros, padded_chunks, never_written, never_allocated]
)
def test_what_a_small_file_declares_is_counted_before_it_is_unpacked(path, make, monkeypatch):
    if make not in (never_written, never_allocated):  # else bombs of a size that is quickly made
        monkeypatch.setenv(VARIABLE, "4M")
    with h5py.File(path, "w") as file:
        make(file)
    assert path.stat().st_size < 2**19
    told = r"/data: expected at most .*--max-memory"
    with open_guarded(path) as guarded, pytest.raises(InputError, match=told):
        guarded.numbers("/data")


def test_arrays_are_counted_together_and_the_user_may_allow_more(path, monkeypatch):
    with h5py.File(path, "w") as file:
        many_arrays(file)
    with open_guarded(path) as guarded:
        for name in ("/a", "/b", "/c", "/d", "/e", "/f", "/g", "/data"):
            guarded.numbers(name)
        with pytest.raises(InputError, match="/more: expected at most 64 MiB"):
            guarded.numbers("/more")
    monkeypatch.setenv(VARIABLE, "100M")
    with open_guarded(path) as guarded:
        for name in ("/a", "/b", "/c", "/d", "/e", "/f", "/g", "/data", "/more"):
            guarded.numbers(name)


def test_names_that_share_one_text_are_counted_each(path):
    with h5py.File(path, "w") as file:
        names_of_one_text(file)
        data = file["/names"].id.get_offset()
    content = bytearray(path.read_bytes())
    content[data : data + 16 * 10_000] = content[data : data + 16] * 10_000
    path.write_bytes(content)
    with open_guarded(path) as guarded, pytest.raises(InputError, match="characters, found more"):
        guarded.names("/names")


def test_rows_are_counted_when_they_are_read(path, monkeypatch):
    monkeypatch.setenv(VARIABLE, "4M")
    with h5py.File(path, "w") as file:
        file.create_dataset("/data", (100, 2**14), "f4", chunks=(1, 2**14), compression="gzip")
        file["/data"][:20] = 0
    with open_guarded(path) as guarded:
        rows = guarded.rows("/data")
        assert isinstance(rows, StoredRows)
        assert rows.read(np.array([3])).shape == (1, 2**14)
        with pytest.raises(InputError, match="--max-memory"):
            rows.read(np.arange(64))


def a_tree(file):
    file.create_dataset("/data", data=np.arange(1000.0), chunks=(1,))


def nodes(content, kind, level):
    """Where the nodes of trees of version 1 stand."""
    at = content.find(mark := b"TREE" + bytes([kind, level]))
    while at >= 0:
        yield at
        at = content.find(mark, at + 1)


@pytest.mark.parametrize("level", [1, 3])
def test_an_index_of_chunks_that_leads_to_itself(path, level):
    with h5py.File(path, "w") as file:
        a_tree(file)
    content = bytearray(path.read_bytes())
    root = next(nodes(content, 1, 1))
    content[root + 5] = level  # 1: as it was; the children are said to be of another level
    for child in range(int.from_bytes(content[root + 6 : root + 8], "little")):
        at = root + 24 + 24 + child * 32
        content[at : at + 8] = root.to_bytes(8, "little")
    path.write_bytes(content)
    with open_guarded(path) as guarded, pytest.raises(InputError, match="damaged"):
        guarded.numbers("/data")


def test_nodes_that_all_lead_to_one_are_found_in_a_file_of_holes_too(path):
    with h5py.File(path, "w") as file:
        file.create_dataset("/data", data=np.arange(10_000.0), chunks=(1,))
    content = bytearray(path.read_bytes())
    top = max(nodes(content, 1, 2), default=None) or next(nodes(content, 1, 1))
    chain = [top, *list(nodes(content, 1, 0))[:6]]
    for level, (at, below) in enumerate(zip(chain, [*chain[1:], 0], strict=True)):
        content[at + 5] = len(chain) - 1 - level
        content[at + 6 : at + 8] = (64 if below else 0).to_bytes(2, "little")
        for child in range(64):
            begin = at + 48 + child * 32
            content[begin : begin + 8] = below.to_bytes(8, "little")
    path.write_bytes(content)
    os.truncate(path, 500_000_000)
    with open_guarded(path) as guarded, pytest.raises(InputError, match="without an end"):
        guarded.numbers("/data")


def test_a_structure_with_a_checksum_is_no_hole(path):
    with h5py.File(path, "w", libver="v110") as file:
        file.create_dataset("/data", (1000,), "f8", chunks=(1,))[3] = 1
    content = bytearray(path.read_bytes())
    at = content.index(b"FAHD")
    content[at + 7] = 63  # no pages
    content[at + 8 : at + 16] = (40_000_000).to_bytes(8, "little")
    content[at + 24 : at + 28] = checksum(bytes(content[at : at + 24])).to_bytes(4, "little")
    path.write_bytes(content)
    os.truncate(path, 500_000_000)
    with open_guarded(path) as guarded, pytest.raises(InputError, match="bytes of FADB"):
        guarded.numbers("/data")


def test_chunks_that_share_one_place_in_the_index(path):
    with h5py.File(path, "w") as file:
        a_tree(file)
    content = bytearray(path.read_bytes())
    first, *others = nodes(content, 1, 0)
    size = 24 + 64 * 32
    for at in others:
        content[at : at + size] = content[first : first + size]
    path.write_bytes(content)
    with open_guarded(path) as guarded, pytest.raises(InputError, match="there twice"):
        guarded.numbers("/data")


def test_a_header_that_goes_on_with_itself(path):
    with h5py.File(path, "w") as file:
        for index in range(20):  # so many attributes do not fit into its first block
            file.attrs[f"a{index}"] = index
    content = bytearray(path.read_bytes())
    at = content.index(b"\x10\x00\x10\x00\x00\x00\x00\x00") + 8  # a continuation of 16 bytes
    content[at : at + 8] = (at - 8).to_bytes(8, "little")
    content[at + 8 : at + 16] = (24).to_bytes(8, "little")
    path.write_bytes(content)
    with open_guarded(path) as guarded, pytest.raises(InputError, match="attribute a3"):
        guarded.number_attribute("a3")


def test_every_beginning_of_a_file_is_refused(path):
    a_rig(path)
    content = path.read_bytes()
    for length in range(1, len(content), 199):
        path.write_bytes(content[:length])
        with pytest.raises(InputError, match=r"file\.h5"):
            read_rig(path)

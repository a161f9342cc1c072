import io
import zipfile

import numpy as np
import pytest

from facert.errors import InputError
from facert.io import npz
from facert.io.npz import open_archive, read_npz_rig, read_npz_take


@pytest.fixture
def path(tmp_path):
    return tmp_path / "file.npz"


TRACK = {"markers": np.zeros((3, 2, 3), "f4"), "marker_names": ["a", "b"], "fps": 30.0}
UNITS = {"units": np.ones((3, 1)), "unit_names": ["u"]}
SOLVED = {"solved": np.ones((3, 2)), "solved_names": ["s", "t"]}
TIMED = {"markers": TRACK["markers"], "marker_names": TRACK["marker_names"]}
RIG = {"neutral": np.eye(3), "faces": np.array([[0, 1, 2]], "i4")}


def test_a_track_has_markers_and_one_target_that_needs_no_choice(path):
    np.savez(path, **TRACK, **UNITS, neutral_markers=np.zeros((2, 3)))
    take = read_npz_take(path)
    assert take.source.names == ("a", "b")
    assert take.controls.names == ("u",)
    np.testing.assert_allclose(take.time, [0, 1 / 30, 2 / 30])


def test_one_of_several_targets_is_chosen(path):
    np.savez(path, **TRACK, **UNITS, **SOLVED)
    assert read_npz_take(path, target="solved").controls.names == ("s", "t")
    assert read_npz_take(path, target="units").controls.names == ("u",)
    for asked in (None, "arkit"):
        with pytest.raises(InputError, match="one of: units, solved") as caught:
            read_npz_take(path, target=asked)
        assert str(path) in str(caught.value)


def test_raw_markers_and_weights_are_tracks_without_a_target(path):
    np.savez(path, positions=np.zeros((2, 1, 3)), names=["m"], fps=60.0)
    assert read_npz_take(path).source.kind == "markers"
    np.savez(path, weights=np.zeros((2, 1)), weight_names=["w"], time=[0.0, 0.25])
    take = read_npz_take(path)
    assert (take.source.kind, take.fps, take.controls) == ("weights", 4.0, None)


def test_a_rate_that_the_file_does_not_say_must_be_given(path):
    np.savez(path, positions=np.zeros((2, 1, 3)), names=["m"])
    assert read_npz_take(path, fps=50.0).time[1] == 0.02
    with pytest.raises(InputError, match="--in-fps"):
        read_npz_take(path)


def test_one_of_several_sets_of_shapes_is_chosen(path):
    one, two = np.ones((1, 3, 3)), np.ones((2, 3, 3))
    np.savez(path, **RIG, deltas=one, names=["d"])
    assert read_npz_rig(path).names == ("d",)
    np.savez(path, **RIG, a_deltas=one, a_names=["x"], b_deltas=two, b_names=["y", "z"])
    assert read_npz_rig(path, shapes="b").names == ("y", "z")
    assert read_npz_rig(path, shapes="bs").names == ("y", "z")  # as a track calls its target
    with pytest.raises(InputError, match="one of: a, b"):
        read_npz_rig(path)
    assert npz.kind_of(path) == "rig"


@pytest.mark.parametrize(
    ("entries", "message"),
    [
        ({}, "keys: expected markers or positions or weights"),
        ({"markers": np.zeros((3, 2))}, r"markers: expected \(T, M, 3\)"),
        ({"markers": np.zeros((3, 2, 3))}, "marker_names: expected an array"),
        (TRACK | {"markers": np.full((3, 2, 3), np.nan)}, "at least one observed"),
        (TRACK | {"markers": np.zeros((3, 2, 3), complex)}, "markers: expected numbers"),
        (TRACK | {"marker_names": [1, 2]}, "marker_names: expected strings"),
        (TRACK | {"fps": [30.0, 30.0]}, "fps: expected one number"),
        (TRACK | {"units": np.ones((2, 1)), "unit_names": ["u"]}, "/target/params"),
        (TRACK | {"marker_names": ["a", "b\ud800"]}, "control characters"),
        (TRACK | {"marker_names": np.array([97, 2**31 - 1], "u4").view("U1")}, "damaged"),
        (TIMED | {"time": np.zeros(3)}, "/time: expected finite, strictly rising"),
        (TIMED | {"time": 0.0}, "/time: expected 3 seconds"),
        (TIMED | {"time": [0.0, np.inf, np.inf]}, "/time"),
    ],
)
def test_what_is_wrong_is_named(path, entries, message):
    np.savez(path, **entries)
    with pytest.raises(InputError, match=message) as caught:
        read_npz_take(path)
    assert str(caught.value).startswith(f"{path}: ")


def member(array=None, declare=None, version=None):
    """The bytes of an .npy member, which may declare more than it holds."""
    stream = io.BytesIO()
    if declare is None:
        np.lib.format.write_array(stream, array, version)
    else:
        header = {"descr": "<f8", "fortran_order": False, "shape": declare}
        np.lib.format.write_array_header_1_0(stream, header)
    return stream.getvalue()


def member_with_header(header):
    """The bytes of an .npy member with any text as its header."""
    return b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header.encode()


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (member(declare=(10**12,)), "declares"),
        (member(np.zeros(3))[:-8], "declares"),
        (member(declare=(0, 99999999999999, 99999999999999999999)), "damaged"),
        (member_with_header("(" * 5000), "damaged"),
        (member_with_header("'''"), "damaged"),
        (b"no array", "damaged"),
        (member(np.zeros(3), version=(3, 0)), "damaged"),
    ],
)
def test_arrays_that_declare_more_than_they_hold_are_refused(path, content, message):
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("data.npy", content)
    with open_archive(path) as archive, pytest.raises(InputError, match=message):
        archive.numbers("data")


def test_a_zip_bomb_is_not_unpacked(path):
    np.savez_compressed(path, data=np.zeros(5_000_000))
    with open_archive(path) as archive, pytest.raises(InputError, match="at most 64 MiB of memory"):
        archive.numbers("data")


def test_arrays_that_are_small_alone_are_counted_together(path):
    np.savez_compressed(path, **{f"a{i}": np.zeros(1_000_000) for i in range(5)})
    with open_archive(path) as archive:
        for key in archive.keys[:4]:
            archive.numbers(key)
        with pytest.raises(InputError, match="a4: expected at most 64 MiB"):
            archive.numbers("a4")


class Trap:
    """Unpickling this would write a file."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return (open, (str(self.path), "w"))


def test_a_pickle_is_never_opened(tmp_path, path):
    np.savez(path, data=np.array([Trap(tmp_path / "sprung")], dtype=object))
    with open_archive(path) as archive, pytest.raises(InputError, match="data: expected"):
        archive.numbers("data")
    assert not (tmp_path / "sprung").exists()


def test_damaged_and_missing_files_are_distinguished(path):
    with pytest.raises(InputError, match="found nothing"):
        read_npz_take(path)
    path.write_text("no archive")
    with pytest.raises(InputError, match=r"an \.npz archive"):
        read_npz_take(path)
    np.savez_compressed(path, data=np.random.default_rng(0).normal(size=1000))
    content = bytearray(path.read_bytes())
    content[300:400] = bytes(100)
    path.write_bytes(content)
    with open_archive(path) as archive, pytest.raises(InputError, match="damaged"):
        archive.numbers("data")


@pytest.mark.real
def test_the_real_tracks_and_rigs_are_read(real_data):
    take = read_npz_take(real_data / "tracks" / "utterance_a.npz", target="arkit")
    assert take.params.shape == (1891, 43)
    assert len(read_npz_take(real_data / "markers" / "cheeks.npz")) == 1499
    rig = read_npz_rig(real_data / "rigs" / "makehuman_head.npz", shapes="unit")
    assert rig.shapes.shape == (34, 4244, 3)

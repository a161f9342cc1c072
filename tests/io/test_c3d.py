"""C3D files of another library become takes."""

from __future__ import annotations

import struct
from contextlib import suppress
from pathlib import Path

import ezc3d
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from facert.errors import InputError
from facert.io.c3d import read_c3d

FRAMES = 6
POSITIONS = np.random.default_rng(0).normal(size=(FRAMES, 3, 3)).astype(np.float32) * 100


def write(path: Path, positions: np.ndarray, labels: list[str], **parameters: list[str]) -> Path:
    """A C3D file written by ezc3d; NaN is how it marks what was not observed."""
    file = ezc3d.c3d()
    point = file["parameters"]["POINT"]
    point["RATE"]["value"] = [120.0]
    point["UNITS"]["value"] = ["mm"]
    point["LABELS"]["value"] = labels
    for name, value in parameters.items():
        file.add_parameter("POINT", name, value)
    points = np.ones((4, positions.shape[1], len(positions)))
    points[:3] = positions.transpose(2, 1, 0)
    file["data"]["points"] = points
    file.write(str(path))
    return path


@pytest.fixture(name="path")
def _path(tmp_path: Path) -> Path:
    return write(tmp_path / "face.c3d", POSITIONS, ["brow", "chin", "lip"], Y_SCREEN=["+Z"])


def test_positions_labels_rate_unit_and_axis_are_read(path: Path) -> None:
    take = read_c3d(path)
    np.testing.assert_array_equal(take.source.values, POSITIONS)
    np.testing.assert_allclose(take.time, np.arange(FRAMES) / 120)
    assert take.source.names == ("brow", "chin", "lip")
    assert (take.fps, take.units, take.up_axis) == (120.0, "mm", "z")


def test_what_was_not_observed_is_nan(tmp_path: Path) -> None:
    gaps = POSITIONS.copy()
    gaps[2, 1] = np.nan
    take = read_c3d(write(tmp_path / "gaps.c3d", gaps, ["brow", "chin", "lip"]))
    np.testing.assert_array_equal(take.source.values, gaps)


def test_a_negative_residual_hides_a_point(path: Path) -> None:
    residual = np.float32(-1).tobytes()
    content = bytearray(path.read_bytes())
    place = content.index(POSITIONS[0, 1].tobytes())
    content[place + 12 : place + 16] = residual
    path.write_bytes(content)
    valid = read_c3d(path).source.valid
    assert not valid[0, 1]
    assert valid.sum() == valid.size - 1


def test_more_than_255_labels_go_on_in_other_parameters(tmp_path: Path) -> None:
    labels = [f"m{index}" for index in range(600)]
    positions = np.random.default_rng(1).normal(size=(2, 600, 3)).astype(np.float32)
    take = read_c3d(write(tmp_path / "many.c3d", positions, labels))
    assert take.source.names == tuple(labels)
    np.testing.assert_array_equal(take.source.values, positions)


def test_a_subject_that_all_labels_share_is_left_out(tmp_path: Path) -> None:
    named = write(tmp_path / "a.c3d", POSITIONS, ["Ann:brow", "Ann:chin", "Ann:lip"])
    assert read_c3d(named).source.names == ("brow", "chin", "lip")
    mixed = write(tmp_path / "b.c3d", POSITIONS, ["Ann:brow", "Bob:chin", "lip"])
    assert read_c3d(mixed).source.names == ("Ann:brow", "Bob:chin", "lip")


def test_points_that_were_not_identified_are_left_out(tmp_path: Path) -> None:
    take = read_c3d(write(tmp_path / "a.c3d", POSITIONS, ["brow", "*7", "lip"]))
    assert take.source.names == ("brow", "lip")
    np.testing.assert_array_equal(take.source.values, POSITIONS[:, [0, 2]])


def test_a_file_that_is_cut_short_is_refused(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-512])
    with pytest.raises(InputError, match="frames: expected 6 as declared"):
        read_c3d(path)


@pytest.mark.parametrize("content", [b"", b"\x02", b"\x02\x50", b"PK\x03\x04" * 200])
def test_something_else_is_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "face.c3d"
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"face\.c3d"):
        read_c3d(path)


def test_no_labelled_marker_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="Label the capture"):
        read_c3d(write(tmp_path / "a.c3d", POSITIONS, ["*1", "*2", "*3"]))


def test_frames_without_points_are_refused_however_many_are_declared(path: Path) -> None:
    content = bytearray(path.read_bytes())
    used = content.index(b"USED") + 8  # its name, the way to the next, the type, no dimensions
    assert content[used : used + 2] == b"\x03\0"
    content[used : used + 2] = content[2:4] = b"\0\0"
    path.write_bytes(content)
    with pytest.raises(InputError, match="POINT:USED: expected points"):
        read_c3d(path)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 1500), st.integers(0, 255)), min_size=1, max_size=5))
def test_damaged_bytes_give_a_take_or_one_error(tmp_path_factory, changes) -> None:
    path = tmp_path_factory.mktemp("c3d") / "face.c3d"
    content = bytearray(write(path, POSITIONS, ["brow", "chin", "lip"]).read_bytes())
    for place, value in changes:
        content[place % len(content)] = value
    path.write_bytes(content)
    with suppress(InputError):
        assert read_c3d(path).source.values.ndim == 3


def test_frames_are_counted_before_they_take_memory(tmp_path: Path) -> None:
    """A header of a few bytes may declare more than any machine could hold."""
    path, most = tmp_path / "large.c3d", 65535
    head = struct.pack("<BBHHHHHfHHf", 2, 80, most, 0, 1, most, 0, -1.0, 3, 0, 25.0)
    path.write_bytes(head.ljust(512, b"\0") + bytes([0, 0, 1, 84]).ljust(512, b"\0"))
    with pytest.raises(InputError, match="frames: expected at most 64 MiB"):
        read_c3d(path)

"""Tables of many rows, archives of many members: what is not of a take is refused at once."""

from __future__ import annotations

import gc
import io
import zipfile
from pathlib import Path

import numpy as np
import pytest

from facert.errors import InputError
from facert.io import poses, registry
from facert.io.formats import read_any, read_take_file
from facert.io.lines import Line, to_numbers, with_points
from facert.io.tables import json_frames
from facert.io.toml import read_toml


def of_lines(line: str, count: int) -> str:
    return f"{line}\n" * count


@pytest.mark.parametrize("text", [of_lines("{}", 1001), f"[{','.join(['{}'] * 1001)}]"])
def test_frames_of_json_are_counted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str
) -> None:
    monkeypatch.setattr(json_frames, "MOST_FRAMES", 1000)
    (tmp_path / "a.json").write_text(text)
    with pytest.raises(InputError, match="frames: expected at most 1000 frames, found 1001"):
        read_any(tmp_path / "a.json")


def test_an_object_of_more_names_than_a_face_has_is_no_frame(tmp_path: Path) -> None:
    names = ",".join(f'"k{i}":1' for i in range(50_000))
    (tmp_path / "a.json").write_text(f'[{{"time":0,"others":{{{names}}}}}]')
    with pytest.raises(InputError, match="at most 49216 columns, found 5000"):
        read_any(tmp_path / "a.json")


@pytest.mark.parametrize("large", [False, True])
def test_an_archive_of_too_many_members_is_not_listed(tmp_path: Path, large: bool) -> None:
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w") as file:
        for i in range(40):
            file.writestr(f"{i}".rjust(30_000, "k") + ".npy", b"")
    made = content.getvalue()
    if large:  # the end of a table of more than 65,535 members
        place = made.rfind(b"PK\5\6")
        size = int.from_bytes(made[place + 12 : place + 16], "little").to_bytes(8, "little")
        end = b"PK\6\6" + bytes(36) + size + bytes(8) + b"PK\6\7" + bytes(16)
        made = made[:place] + end + made[place : place + 12] + bytes(4) + made[place + 16 :]
    (tmp_path / "a.npz").write_bytes(made)
    with pytest.raises(InputError, match="at most 1048576 bytes that name arrays, found 12"):
        read_any(tmp_path / "a.npz")


def test_the_collector_rests_while_a_file_is_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    met = []

    def parsed(text: str) -> None:
        met.append(gc.isenabled())
        raise ValueError

    monkeypatch.setattr("facert.io.tables.tracker_json.parsed", parsed)
    (tmp_path / "a.json").write_text("[]")
    with pytest.raises(InputError):
        read_take_file(tmp_path / "a.json")
    assert met == [False]
    assert gc.isenabled()


def overflow(*_: object) -> None:
    raise OverflowError("too large")


def test_poses_and_toml_come_in_by_the_door(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.csv"
    path.write_text("frame,jawOpen\n0,1\n")
    monkeypatch.setattr(poses, "_numbered_table", overflow)
    monkeypatch.setattr("facert.io.toml.tomllib.loads", overflow)
    for read in (poses.read_poses, poses.numbers_frames, read_toml):
        with pytest.raises(InputError, match=r"a\.csv: .*too large"):
            read(path)
    assert registry.FORMATS


def test_numbers_of_cells_with_blanks_and_commas() -> None:
    rows = [Line(2, ["1,5", " -,5e3", ""]), Line(3, ["2", "", "1,2,3"])]
    pointed = with_points(rows)
    assert [row.cells for row in pointed] == [["1.5", " -.5e3", ""], ["2", "", "1,2,3"]]
    found = to_numbers(pointed, ("a", "b", "c"), [0, 1])
    np.testing.assert_array_equal(found, [[1.5, -500.0], [2.0, np.nan]])
    with pytest.raises(InputError, match="line 3, column c: expected a number"):
        to_numbers(pointed, ("a", "b", "c"), [0, 1, 2])

"""TRC files, as motion capture programs write them, become takes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from facert.data.take import Take
from facert.errors import InputError
from facert.io.trc import read_trc

HEADER = (
    "PathFileType\t4\t(X/Y/Z)\tface.trc\n"
    "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\t"
    "OrigNumFrames\n"
    "120\t120\t3\t2\tmm\t120\t1\t3\n"
    "Frame#\tTime\tbrow\t\t\tchin\t\t\n"
    "\t\tX1\tY1\tZ1\tX2\tY2\tZ2\n"
)
ROWS = (
    "\n1\t0.0\t1\t2\t3\t4\t5\t6\n"
    "2\t0.008333\t1.5\t2\t3\t4\t5\t6.25\n"
    "3\t0.016667\t2\t2\t3\t4\t5\t7\n"
)


@pytest.fixture(name="path")
def _path(tmp_path: Path) -> Path:
    path = tmp_path / "face.trc"
    path.write_text(HEADER + ROWS)
    return path


def test_positions_times_names_rate_and_unit_are_read(path: Path) -> None:
    take = read_trc(path)
    assert take.source.names == ("brow", "chin")
    np.testing.assert_array_equal(take.source.values[1], [[1.5, 2, 3], [4, 5, 6.25]])
    np.testing.assert_array_equal(take.time, [0, 0.008333, 0.016667])
    assert (take.fps, take.units) == (120.0, "mm")


def test_the_column_time_counts_where_the_header_states_another_rate(path: Path, caplog) -> None:
    path.write_text((HEADER + ROWS).replace("120\t120\t3", "60\t120\t3"))
    assert read_trc(path).fps == pytest.approx(120)
    assert "DataRate is 60 frames/s, the column Time 120" in caplog.text


@pytest.mark.parametrize("stated", ["120", "119.88", "", "?"])
def test_a_rate_that_agrees_or_is_absent_needs_no_word(path: Path, stated: str, caplog) -> None:
    path.write_text((HEADER + ROWS).replace("120\t120\t3", f"{stated}\t120\t3"))
    assert read_trc(path).fps == pytest.approx(120, rel=0.01)
    assert not caplog.records


def test_times_in_whole_milliseconds_agree_with_a_rate_that_has_none(path: Path, caplog) -> None:
    rows = [f"{i + 1}\t{i / 120:.3f}\t1\t2\t3\t4\t5\t6\n" for i in range(60)]
    path.write_text(HEADER + "".join(rows))
    assert read_trc(path).fps == 120
    assert not caplog.records


@pytest.mark.parametrize(
    ("line", "lost"),
    [
        ("1\t0.0\t\t\t\t4\t5\t6", "brow"),
        ("1\t0.0\t0\t0\t0\t4\t5\t6", "brow"),
        ("1\t0.0\tNaN\tNaN\tNaN\t4\t5\t6", "brow"),
        ("1\t0.0\t-1.#IND\t1.#QNAN\tn/a\t4\t5\t6", "brow"),
        ("1\t0.0\t-\t-\t-\t4\t5\t6", "brow"),
        ("1\t0.0\t1\t2\t3\t\t\t", "chin"),
        ("1\t0.0\t1\t2\t3", "chin"),
        ("1\t0.0\t1\t2\t3\t4\t5\t", "chin"),
    ],
)
def test_blank_zero_and_missing_cells_were_not_observed(path: Path, line: str, lost: str) -> None:
    path.write_text(f"{HEADER}{line}\n2\t0.1\t1\t2\t3\t4\t5\t6\t\t\r\n")
    take = read_trc(path)
    assert not take.source.valid[0, take.source.names.index(lost)]
    assert take.source.valid[0].sum() == 1
    assert take.source.valid[1].all()


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("PathFileType", "Path", "line 1: expected PathFileType"),
        ("Frame#\tTime", "Frame\tSeconds", "line 4"),
        ("chin", "brow", "'brow' twice"),
        ("\t1.5\t", "\tone\t", "line 8, column brow.x: expected a number"),
        ("\t6.25\n", "\t6.25\t7\n", "line 8: expected 8 cells"),
        ("0.016667", "0.0", "/time"),
        ("0.016667", "", "/time"),
        (ROWS, "\n", "expected frames after the header"),
    ],
)
def test_what_is_wrong_is_named(path: Path, old: str, new: str, message: str) -> None:
    path.write_text((HEADER + ROWS).replace(old, new, 1))
    with pytest.raises(InputError, match=message) as caught:
        read_trc(path)
    assert str(caught.value).startswith(f"{path}: ")


@pytest.mark.parametrize("text", ["", "PathFileType\t4\n", "\n" * 9])
def test_a_file_without_a_header_is_refused(path: Path, text: str) -> None:
    path.write_text(text)
    with pytest.raises(InputError, match="TRC"):
        read_trc(path)


def require_same(path: Path, text: str | bytes) -> Take:
    """The take of a file that spells the same header or the same frames otherwise."""
    path.write_text(HEADER + ROWS)
    wanted = read_trc(path)
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    take = read_trc(path)
    assert take.source.names == wanted.source.names
    np.testing.assert_array_equal(take.source.values, wanted.source.values)
    np.testing.assert_array_equal(take.time, wanted.time)
    assert (take.fps, take.units) == (wanted.fps, wanted.units)
    return take


FIRST, NAMES, VALUES, MARKERS, AXES = HEADER.splitlines()
OTHER_FIRST = ["PathFileType  4\t(X/Y/Z) C:\\capture\\", "PathFileType 4 (X/Y/Z)", " pathfiletype"]
OTHER_NAMES = [NAMES.replace("\t", " "), NAMES.replace("\t", "\t\t"), f"{NAMES}\t", f"\t{NAMES}"]
OTHER_VALUES = [
    "  120.0\t\t  120.0\t\t    3\t\t     2\t\t mm\t  120.0\t  1\t  3",
    "120 120 3 2 mm 120 1 3",
    "120\t120\t3\t2\tmm",
    "120\t\t3\t2\tmm\t\t\t",
]
OTHER_MARKERS = [
    "Frame #\tTime\tbrow\t\t\tchin",
    "Frame#\t Time\t brow\tchin",
    "frame\ttime\tbrow\t\tchin\t\t\t\t",
    "FRAME#\tTIME\tbrow\tbrow\tbrow\tchin\tchin\tchin",
    "Frame#\tTime (s)\tbrow_x\tbrow_y\tbrow_z\tchin_x\tchin_y\tchin_z",
    "Frame# Time brow chin",
    "Frame#\tTime\tbrow chin\t\t\t",
]


@pytest.mark.parametrize(
    "lines",
    [
        *((first, NAMES, VALUES, MARKERS, AXES) for first in OTHER_FIRST),
        *((FIRST, names, VALUES, MARKERS, AXES) for names in OTHER_NAMES),
        *((FIRST, NAMES, values, MARKERS, AXES) for values in OTHER_VALUES),
        *((FIRST, NAMES, VALUES, markers, AXES) for markers in OTHER_MARKERS),
        (FIRST, NAMES, VALUES, MARKERS),
        (FIRST, NAMES, VALUES, MARKERS, "\t\tX\tY\tZ\tX\tY\tZ\t"),
        (FIRST, "", NAMES, VALUES, "", MARKERS, AXES, "", ""),
    ],
)
def test_headers_are_read_in_every_spelling(path: Path, lines: tuple[str, ...], caplog) -> None:
    require_same(path, "\n".join(lines) + "\n" + ROWS)
    assert not caplog.records


@pytest.mark.parametrize(
    "rows",
    [
        ROWS.replace("\t", "\t\t"),
        ROWS.replace("\n", "\n\t"),
        ROWS.replace("\t", "  "),
        ROWS.replace("\n", "\t\t\n"),
        ROWS.replace("\n", "\r\n"),
        ROWS.replace(".", ","),
        ROWS.lstrip("\n"),
    ],
)
def test_frames_are_read_in_every_spelling(path: Path, rows: str) -> None:
    require_same(path, HEADER + rows)


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "latin-1"])
def test_names_are_read_in_every_encoding(path: Path, encoding: str, caplog) -> None:
    caplog.set_level("INFO", "facert")
    path.write_bytes((HEADER + ROWS).replace("chin", "Mül:Kinn").encode(encoding))
    take = read_trc(path)
    assert take.source.names == ("brow", "Mül:Kinn")
    assert take.source.values[1, 1, 2] == 6.25
    assert ("Latin-1" in caplog.text) == (encoding == "latin-1")


def test_counts_that_are_stale_are_logged_and_the_file_counts(path: Path, caplog) -> None:
    caplog.set_level("INFO", "facert")
    require_same(path, (HEADER + ROWS).replace("\t3\t2\tmm", "\t900\t5\tmm"))
    assert "NumMarkers is 5 in the header; the file has 2, which counts" in caplog.text
    assert "NumFrames is 900 in the header; the file has 3, which counts" in caplog.text


def test_a_file_without_facts_has_the_rate_of_its_times(path: Path) -> None:
    path.write_text(f"{FIRST}\n{MARKERS}\n{AXES}\n{ROWS}")
    take = read_trc(path)
    assert take.fps == pytest.approx(120, rel=1e-3)
    assert take.units == ""


def test_three_markers_named_like_axes_are_three(path: Path) -> None:
    markers = "Frame#\tTime\tnose_x\t\t\tnose_y\t\t\tnose_z"
    rows = "".join(f"{i}\t{i / 60:.4f}" + "\t1.5" * 9 + "\n" for i in (1, 2, 3))
    path.write_text("\n".join((FIRST, NAMES, VALUES, markers)) + "\n" + rows)
    assert read_trc(path).source.names == ("nose_x", "nose_y", "nose_z")


def test_a_marker_that_is_never_observed_keeps_its_columns(path: Path) -> None:
    rows = "".join(f"{i}\t{i / 120:.4f}\t\t\t\t4\t5\t{i}\n" for i in (1, 2, 3))
    path.write_text(HEADER + rows)
    take = read_trc(path)
    assert not take.source.valid[:, 0].any()
    np.testing.assert_array_equal(take.source.values[:, 1, 2], [1, 2, 3])


@pytest.mark.parametrize("stated", ["29.97", "30", "29.970030"])
def test_a_rate_of_television_is_kept(tmp_path: Path, stated: str) -> None:
    path = tmp_path / "a.trc"
    rows = "".join(f"{i + 1}\t{i * 1.001 / 30:.6f}\t1\t1\t1\n" for i in range(300))
    path.write_text(f"PathFileType\t4\nDataRate\n{stated}\nFrame#\tTime\ta\n\n{rows}")
    assert read_trc(path).fps == 30000 / 1001

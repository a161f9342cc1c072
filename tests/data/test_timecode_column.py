"""What FF of a column of timecodes count shows in all of its rows, also in short clips."""

from __future__ import annotations

import datetime
import logging

import numpy as np
import pytest

from facert.data.rate import nominal_rate
from facert.data.timecode import parts_of
from facert.data.timecode_column import COUNTS, TimecodeClock, read_timecodes

NTSC = 30000 / 1001


def written(count: int, rate: float, rows: int, start: float = 0.0, end: str = "") -> list[str]:
    """Timecodes of rows at a rate, FF counting so many a second."""
    frames = [int((start + row / rate) * count + 1e-6) for row in range(rows)]
    return [f"{hms(frame // count)}:{frame % count:02d}{end}" for frame in frames]


def hms(seconds: int) -> str:
    return f"{seconds // 3600:02d}:{seconds // 60 % 60:02d}:{seconds % 60:02d}"


def drop_frame(count: int, rows: int, start: tuple[int, int, int], mark: str = ";") -> list[str]:
    """Drop-frame timecodes, from minute, second and frame on: the numbers that there are."""
    minute, second, frame = start
    codes: list[str] = []
    while len(codes) < rows:
        if minute % 10 == 0 or second or frame >= count // 15:
            codes.append(f"{hms(60 * minute + second)}{mark}{frame:02d}")
        frame += 1
        second, frame = second + frame // count, frame % count
        minute, second = minute + second // 60, second % 60
    return codes


def clock_of(codes: list[str], fps: float | None = None) -> TimecodeClock:
    clock = read_timecodes([part for part in map(parts_of, codes) if part], fps)
    assert clock is not None
    return clock


@pytest.mark.parametrize("seconds", [1.2, 1.6, 3.0, 12.0])
@pytest.mark.parametrize("share", [1, 2])
@pytest.mark.parametrize("count", COUNTS)
def test_any_clip_that_comes_to_another_second_shows_its_count(count, share, seconds) -> None:
    for start in (0.0, 0.4, 3599.5):
        rate = count / share
        clock = clock_of(written(count, rate, int(seconds * rate), start))
        assert clock.count == count
        np.testing.assert_allclose(clock.seconds, np.arange(len(clock.seconds)) / rate)


@pytest.mark.parametrize("count", [24, 25, 30, 50, 60])
def test_five_rows_over_the_end_of_a_second_are_enough(count) -> None:
    assert clock_of(written(count, count, 5, 1 - 3 / count)).count == count


def test_a_clip_with_gaps_and_one_in_uneven_steps() -> None:
    codes = written(30, 30, 90, 0.4)
    assert clock_of(codes[:20] + codes[45:]).count == 30
    steps = np.cumsum(1 / (29 + 2 * np.sin(np.arange(300) / 9)))
    codes = [f"{hms(int(t))}:{int(t % 1 * 60):02d}" for t in steps]
    clock = clock_of(codes)
    assert clock.count == 60
    np.testing.assert_allclose(clock.seconds, steps - steps[0], atol=1 / 60)


def test_what_remains_possible_is_told_and_the_rate_decides(caplog) -> None:
    codes = written(24, 24, 18)
    assert clock_of(codes).count == 30
    assert "may count 20, 24, 25, 30, 48, 50, 60, 100 or 120 a second: taken as 30" in caplog.text
    caplog.clear()
    caplog.set_level(logging.WARNING)
    for fps, count in ((24.0, 24), (24000 / 1001, 24), (25.0, 25), (60.0, 60), (NTSC, 30)):
        assert clock_of(codes, fps).count == count
    assert clock_of(written(60, 30, 15), 30.0).count == 60
    assert not caplog.records


@pytest.mark.parametrize(("rows", "count"), [(96, 120), (100, 100), (112, 120)])
def test_most_of_a_second_of_many_frames_is_of_120_and_a_whole_one_of_100(rows, count) -> None:
    assert clock_of(written(count, count, rows)).count == count


def test_the_apps_sixtieths_with_thousandths_need_no_second(caplog) -> None:
    caplog.set_level(logging.INFO)
    clock = clock_of(["10:00:00:01.250", "10:00:00:03.250", "10:00:00:05.249"])
    assert (clock.count, clock.start(30.0)) == (60, "10:00:00:01.250")
    assert not caplog.records
    frames = 2.0 * np.arange(1, 90) - 1e-9
    rounded = [f"{hms(int(frame // 60))}:{frame % 60:06.3f}" for frame in frames]
    assert "00:00:00:60.000" in rounded
    np.testing.assert_allclose(clock_of(rounded).seconds, np.arange(89) / 30, atol=1e-9)


def test_parts_of_a_frame_count_frames_of_other_programs() -> None:
    clock = clock_of(written(24, 24, 60, 0.3, end=".50"))
    assert clock.count == 24
    np.testing.assert_allclose(clock.seconds, np.arange(60) / 24)
    assert clock.start(24.0) == "00:00:00:18.750"


@pytest.mark.parametrize(
    ("count", "minute", "mark"),
    [(30, 0, ";"), (30, 9, ";"), (60, 5, ";"), (120, 0, ";"), (30, 4, "."), (60, 9, ".")],
)
def test_drop_frame_has_no_gap_at_the_minute(count, minute, mark) -> None:
    codes = drop_frame(count, 6 * count, (minute, 57, 0), mark)
    clock = clock_of(codes)
    assert (clock.count, clock.drop) == (count, True)
    np.testing.assert_allclose(clock.seconds, np.arange(6 * count) * 1.001 / count)
    rate = nominal_rate(clock.seconds)
    assert rate == 1000 * count / 1001
    assert clock.start(rate) == codes[0].replace(".", ";")
    apart = [code.replace(":", ";") for code in codes]
    np.testing.assert_array_equal(clock_of(apart).seconds, clock.seconds)


def test_a_semicolon_alone_is_no_drop_frame(caplog) -> None:
    codes = [code[:8] + ";" + code[9:] for code in written(30, 30, 300, 55)]
    clock = clock_of(codes)  # 00:01:00;00 is there
    np.testing.assert_allclose(clock.seconds, np.arange(300) / 30)
    assert (clock.drop, clock.start(30.0)) == (False, "00:00:55:00")
    assert "not taken for drop-frame" in caplog.text
    codes = [code[:8] + ";" + code[9:] for code in written(25, 25, 300, 55)]
    assert not clock_of(codes).drop


def test_drop_frame_goes_on_past_midnight() -> None:
    codes = drop_frame(30, 40, (24 * 60 - 1, 59, 10))
    codes = [code.replace("24:00:00", "00:00:00") for code in codes]
    np.testing.assert_allclose(clock_of(codes).seconds, np.arange(40) / NTSC)


@pytest.mark.parametrize("mark", [":", ".", ","])
def test_milliseconds_are_read_whatever_stands_before_them(mark) -> None:
    codes = [
        f"{hms(t // 1000)}{mark}{t % 1000:03d}" for t in np.rint(np.arange(60) / 0.03).astype(int)
    ]
    clock = clock_of(codes)
    np.testing.assert_allclose(clock.seconds, np.round(np.arange(60) / 30, 3))
    assert clock.start(30.0) == "00:00:00:00.000"


def test_python_and_hundredths_are_read() -> None:
    codes = [str(datetime.timedelta(seconds=row / 30)) for row in range(90)]
    np.testing.assert_allclose(clock_of(codes).seconds, np.arange(90) / 30, atol=1e-6)
    codes = [f"{hms(t // 100)}.{t % 100:02d}" for t in (np.arange(90) * 100 + 1) // 30]
    clock = clock_of(codes)
    assert (clock.count, clock.drop, nominal_rate(clock.seconds)) == (100, False, 30.0)


def numbered(rows: int, count: int = 30, first: int = 1) -> list[str]:
    """Timecodes with the number of the frame after FF, as Face_Landmark_Link writes them."""
    return [
        f"{hms(row // count)}:{row % count:02d}.{row % 1000:03d}"
        for row in range(first, rows + first)
    ]


@pytest.mark.parametrize("rows", [60, 300, 1200])
@pytest.mark.parametrize("count", [24, 25, 30])
def test_a_number_of_the_frame_is_no_part_of_it(rows, count, caplog) -> None:
    caplog.set_level(logging.INFO)
    clock = clock_of(numbered(rows, count))
    np.testing.assert_allclose(clock.seconds, np.arange(rows) / count)
    assert clock.start(float(count)) == "00:00:00:01"
    assert "the number of the frame: left out" in caplog.text


def test_a_number_of_the_frame_with_rows_missing_or_cut_or_without_zeros() -> None:
    kept = [row for row in range(600) if row % 7]
    expected = (np.array(kept) - kept[0]) / 30
    with_frames = [numbered(600)[row] for row in kept]
    np.testing.assert_allclose(clock_of(with_frames).seconds, expected)
    with_rows = [f"{code[:12]}{i:03d}" for i, code in enumerate(with_frames)]
    np.testing.assert_allclose(clock_of(with_rows).seconds, expected)
    np.testing.assert_allclose(clock_of(numbered(1200)[345:700]).seconds, np.arange(355) / 30)
    plain = [f"{hms(row // 24)}:{row % 24:02d}.{row}" for row in range(200)]
    np.testing.assert_allclose(clock_of(plain).seconds, np.arange(200) / 24)


@pytest.mark.parametrize("rate", [NTSC, 2 * NTSC, 24000 / 1001])
@pytest.mark.parametrize("rows", [20, 300, 2000])
def test_a_clock_of_television_in_sixtieths_keeps_its_parts(rate, rows) -> None:
    """Its thousandths rise by the same every row, up to where they come to a whole one."""
    ticks = np.rint(np.arange(rows) / rate * 60_000).astype(int)
    codes = [f"{hms(t // 60_000)}:{t // 1000 % 60:02d}.{t % 1000:03d}" for t in ticks]
    clock = clock_of(codes)
    np.testing.assert_allclose(clock.seconds, np.arange(rows) / rate, atol=2e-5)


def test_codes_without_ff_are_none() -> None:
    assert (
        read_timecodes([part for part in map(parts_of, ["10:00:00", "10:00:01"]) if part]) is None
    )


def test_parts_that_may_be_numbers_of_rows_are_logged(caplog) -> None:
    caplog.set_level("INFO")
    rows = [f"{hms(row // 60)}:{row % 60:02d}.{row:03d}" for row in range(300)]
    np.testing.assert_allclose(clock_of(rows).seconds, np.arange(300) / 60 * 1.001)
    assert "59.94 frames/s; --in-fps 60 if the parts count frames" in caplog.text

"""Timecodes of frames."""

import pytest

from facert.data.timecode import format_timecode, parse_timecode, timecode


@pytest.mark.parametrize(
    ("start", "seconds", "fps", "expected"),
    [
        ("00:00:00:00", 0.0, 24, "00:00:00:00"),
        ("01:00:00:20", 0.5, 24, "01:00:01:08"),
        ("23:59:59:29", 1 / 30, 30, "00:00:00:00"),
        ("10:00:00:00", 1001.0, 30000 / 1001, "10:16:40:00"),
        ("10:30:05:59.500", 1 / 60, 30, "10:30:06:00.500"),
        ("", 3.0, 30, ""),
        ("noon", 3.0, 30, ""),
        ("00:00:00;00", 3.0, 30000 / 1001, "00:00:03;00"),
        ("00:00:59;29", 1.001 / 30, 30000 / 1001, "00:01:00;02"),
        ("00:09:59;29", 1.001 / 30, 30000 / 1001, "00:10:00;00"),
        ("00:00:59;59", 1.001 / 60, 60000 / 1001, "00:01:00;04"),
        ("23:59:59;29", 1.001 / 30, 30000 / 1001, "00:00:00;00"),
        ("00:00:59.29", 1.001 / 30, 30000 / 1001, "00:01:00;02"),
        ("00;00;00;00", 3600.0, 30000 / 1001, "01:00:00;00"),
        ("00:00:00:00", 3603.6, 30000 / 1001, "01:00:00:00"),
        ("00:00:00;10", 1.0, 25, "00:00:01:10"),
    ],
)
def test_frames_are_counted_on_from_the_first(start, seconds, fps, expected):
    assert timecode(start, seconds, fps) == expected


def test_live_link_timecodes_are_those_that_it_would_write():
    start = "12:22:01:06.579"
    ticks = parse_timecode(start) + round(37.1234 * 60_000)
    assert timecode(start, 37.1234, 60.0) == format_timecode(ticks)

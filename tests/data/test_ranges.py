"""Frames as text; the numbers of a grid are tested with the command that takes them."""

import pytest

from facert.data.ranges import parse_frames
from facert.errors import InputError


def test_a_range_of_frames_is_all_of_them():
    assert parse_frames("10..13, 2,20..30:5", "--neutral") == (2, 10, 11, 12, 13, 20, 25, 30)


@pytest.mark.parametrize("text", ["a..b", "5..1", "", "1..3:0", "1..2..3"])
def test_the_message_quotes_what_was_typed_with_an_example_that_fits(text):
    with pytest.raises(InputError) as caught:
        parse_frames(text, "--neutral")
    assert caught.value.found == repr(text)
    example = caught.value.fix.removeprefix("For instance ").split(",")[0]
    assert parse_frames(example, "--neutral") == tuple(range(21))

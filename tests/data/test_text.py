"""Numbers in messages agree with their nouns."""

import pytest

from facert.data.text import did_you_mean, plural


@pytest.mark.parametrize(
    ("count", "text"), [(0, "0 vertices"), (1, "1 vertex"), (2, "2 vertices"), (10, "10 vertices")]
)
def test_one_is_singular_and_all_others_are_plural(count: int, text: str) -> None:
    assert plural(count, "vertex", "vertices") == text
    assert plural(count, "frame") == f"{count} frame{'' if count == 1 else 's'}"


def test_a_slip_of_the_pen_is_answered_with_the_word() -> None:
    assert did_you_mean("ssgrp", ("ssgpr", "ridge")) == "Did you mean 'ssgpr'?"
    assert did_you_mean("forest", ("ssgpr", "ridge")) == "Choose one of these."

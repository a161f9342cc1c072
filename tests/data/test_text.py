"""Numbers in messages agree with their nouns."""

import pytest

from facert.data.text import plural


@pytest.mark.parametrize(
    ("count", "text"), [(0, "0 vertices"), (1, "1 vertex"), (2, "2 vertices"), (10, "10 vertices")]
)
def test_one_is_singular_and_all_others_are_plural(count: int, text: str) -> None:
    assert plural(count, "vertex", "vertices") == text
    assert plural(count, "frame") == f"{count} frame{'' if count == 1 else 's'}"

"""Foreign names as texts of a figure."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def take_texts_as_they_are(figure: Figure) -> None:
    """Have no text of a figure taken for mathematics: a control or a file may be called $x$."""
    from matplotlib.text import Text

    for text in figure.findobj(Text):
        assert isinstance(text, Text)  # by the search
        text.set_parse_math(False)

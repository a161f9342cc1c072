"""Foreign names as texts of a figure."""

from __future__ import annotations

from typing import TYPE_CHECKING

from facert.data.text import printable_lines

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def with_plain_texts(figure: Figure) -> Figure:
    """The figure, of which no text is mathematics: a control or a file may be called $x$.

    What no picture can show is escaped: an SVG with a control character is none.
    """
    from matplotlib.text import Text

    for text in figure.findobj(Text):
        assert isinstance(text, Text)  # by the search
        text.set_parse_math(False)
        text.set_text(printable_lines(text.get_text()))
    return figure

"""Figures as text that stands in a page: curves as SVG, faces as PNG."""

from __future__ import annotations

import base64
from io import BytesIO
from typing import TYPE_CHECKING, Any, Literal

from facert.report.sections import Picture

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def embedded(figure: Figure, caption: str, form: Literal["svg", "png"]) -> Picture:
    """A figure as a picture; the same figure gives the same text."""
    import matplotlib
    from matplotlib.text import Text

    for text in figure.findobj(Text):
        assert isinstance(text, Text)  # what was looked for
        text.set_parse_math(False)  # a control may be called $x
    options: dict[str, Any] = {"metadata": {"Date": None}} if form == "svg" else {}
    buffer = BytesIO()
    with matplotlib.rc_context({"svg.hashsalt": "facert"}):
        figure.savefig(buffer, format=form, **options)
    kind = "svg+xml" if form == "svg" else form
    return Picture(
        caption, f"data:image/{kind};base64,{base64.b64encode(buffer.getvalue()).decode()}"
    )

"""Figures as text that stands in a page: curves as SVG, faces as PNG."""

from __future__ import annotations

import base64
from io import BytesIO
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from facert.pages.report.sections import Picture
from facert.render.texts import with_plain_texts

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.figure import Figure

MOST_POINTS = 1000  # of a curve that is drawn as one


def embedded(figure: Figure, caption: str, form: Literal["svg", "png"]) -> Picture:
    """A figure as a picture; the same figure gives the same text.

    Of an SVG, curves and bands of thousands of points are drawn as pixels: they would make the
    page slow and large.
    """
    import matplotlib

    with_plain_texts(figure)
    for artist in figure.findobj():
        _simplify(artist)
    options: dict[str, Any] = {"metadata": {"Date": None}} if form == "svg" else {}
    buffer = BytesIO()
    with matplotlib.rc_context({"svg.hashsalt": "facert"}):
        figure.savefig(buffer, format=form, **options)
    kind = "svg+xml" if form == "svg" else form
    return Picture(
        caption, f"data:image/{kind};base64,{base64.b64encode(buffer.getvalue()).decode()}"
    )


def _simplify(artist: Artist) -> None:
    """Draw what is long as pixels."""
    from matplotlib.collections import PolyCollection
    from matplotlib.lines import Line2D

    if isinstance(artist, Line2D):
        artist.set_rasterized(np.size(artist.get_xdata()) > MOST_POINTS)
    elif isinstance(artist, PolyCollection):
        points = sum(np.shape(path.vertices)[0] for path in artist.get_paths())
        artist.set_rasterized(points > MOST_POINTS)

"""What `make site` changes of pages: titles of files, options in one piece, formulas as MathML."""

import re
from html import unescape
from typing import Any

from latex2mathml.converter import convert
from mkdocs.exceptions import PluginError

_NAMED = re.compile(r"^(```\w+) (\S+)$", re.MULTILINE)
_FORMULA = re.compile(r'<(span|div) class="arithmatex">\\([(\[])(.*?)\\[)\]]</\1>', re.DOTALL)
_CODE = re.compile(r"<code>[^<]*</code>")
_OPTION = re.compile(r"(?<=[ >])--?\w[\w-]*")


def on_page_markdown(markdown: str, **_: Any) -> str:
    """The text of a page, the name of a file beside a fence its title."""
    return _NAMED.sub(r'\1 title="\2"', markdown)


def on_page_content(html: str, **_: Any) -> str:
    """A page whose formulas are drawn by the browser itself, and whose options no line breaks."""
    return _CODE.sub(_with_whole_options, _FORMULA.sub(_mathml, html))


def _with_whole_options(found: re.Match[str]) -> str:
    return _OPTION.sub(r'<span class="option">\g<0></span>', found[0])


def _mathml(found: re.Match[str]) -> str:
    formula = unescape(found[3]).strip()
    drawn = convert(formula, display="block" if found[1] == "div" else "inline")
    if "\\" in drawn:  # a command that the converter does not know stays as it is
        raise PluginError(f"a command in this formula cannot be drawn: {formula}")
    return drawn

"""Writes `api.md` beside this file, from the docstrings: `make docs`."""

from __future__ import annotations

import importlib
import inspect
import re
from collections.abc import Iterator
from dataclasses import MISSING, fields, is_dataclass
from pathlib import Path
from typing import Any

import facert

PAGE = Path(__file__).parent / "api.md"

HEAD = """# API

`import facert` is enough for every name here without a module. The other classes that public
functions take or return follow under [Others](#others). Every error that facert raises on purpose
is a `FacertError`, whose one line gives what was expected, what was found, and what to do.

This page is written by `make docs`, from the docstrings.
"""
# What the public functions take and return, by their modules.
OTHERS = {
    "facert.posing.suggested_frames": ("Suggestion",),
    "facert.posing.completed_pose": ("CompletedPose",),
    "facert.preprocess.clean_source": ("SourceOptions",),
    "facert.retarget.options": ("RetargetOptions", "Adjustments"),
    "facert.retarget.model": ("TrainedModel",),
    "facert.retarget.stream": ("RetargetStream", "Streamed"),
}
_HEADING = re.compile(r"^([A-Z]\w+)\n-{3,}\n", re.MULTILINE)


def page() -> str:
    """The whole page, as Markdown."""
    public = {f"facert.{name}": getattr(facert, name) for name in facert.__all__}
    others = {
        f"{module}.{name}": getattr(importlib.import_module(module), name)
        for module, names in OTHERS.items()
        for name in names
    }
    parts = [HEAD, _contents(public), *_all(public), "## Others\n", *_all(others)]
    return "\n".join(parts).rstrip() + "\n"


def _contents(things: dict[str, Any]) -> str:
    rows = [f"| [`{name}`](#{_anchor(name)}) | {_summary(it)} |" for name, it in things.items()]
    return "\n".join(["| name | what it is |", "|---|---|", *rows, ""])


def _anchor(name: str) -> str:
    """Where GitHub jumps to for a heading."""
    return re.sub(r"[^\w-]", "", name.lower())


def _summary(thing: Any) -> str:
    """The first sentence of a docstring."""
    paragraph = " ".join((inspect.getdoc(thing) or "").split("\n\n")[0].split())
    return paragraph.split(". ")[0].rstrip(".") + "."


def _all(things: dict[str, Any]) -> Iterator[str]:
    """Every class with its members, and every function."""
    for name, thing in things.items():
        level = "##" if name.count(".") == 1 else "###"
        yield _entry(level, name, thing)
        if inspect.isclass(thing):
            for member in _members(thing):
                yield _entry(f"{level}#", f"{thing.__name__}.{member}", vars(thing)[member])


def _members(thing: type) -> list[str]:
    """Methods and properties that a class itself documents, in their order."""
    kinds = (property, classmethod)
    return [
        name
        for name, member in vars(thing).items()
        if not name.startswith("_") and (inspect.isfunction(member) or isinstance(member, kinds))
    ]


def _entry(level: str, name: str, thing: Any) -> str:
    """A heading, the call, and the docstring."""
    heading = f"{level} `{name}`\n"
    call = _signature(name.rsplit(".", 1)[-1], thing)
    code = f"```py\n{call}\n```\n" if call else ""
    return "\n".join(part for part in (heading, code, *_body(inspect.getdoc(thing) or "")) if part)


def _signature(name: str, thing: Any) -> str:
    """The call without types, which stand with the parameters; nothing for a property."""
    if isinstance(thing, property) or (inspect.isclass(thing) and issubclass(thing, Exception)):
        return ""
    if is_dataclass(thing):
        parts = [_field(one) for one in fields(thing) if one.init]
    else:
        called = thing.__func__ if isinstance(thing, classmethod) else thing
        parts = _parameters(inspect.signature(called))
    whole = f"{name}({', '.join(parts)})"
    return whole if len(whole) <= 88 else f"{name}(\n    " + ",\n    ".join(parts) + ",\n)"


def _field(one: Any) -> str:
    if one.default_factory is not MISSING:
        return f"{one.name}=..."
    return one.name if one.default is MISSING else f"{one.name}={_value(one.default)}"


def _parameters(signature: inspect.Signature) -> list[str]:
    parts, starred = [], False
    for one in signature.parameters.values():
        if one.name in ("self", "cls"):
            continue
        if one.kind is one.KEYWORD_ONLY and not starred:
            parts.append("*")
            starred = True
        parts.append(one.name if one.default is one.empty else f"{one.name}={_value(one.default)}")
    return parts


def _value(default: Any) -> str:
    """As the formatter of the code writes it."""
    return f'"{default}"' if isinstance(default, str) else repr(default)


def _body(docstring: str) -> Iterator[str]:
    """The text of a numpydoc docstring, then its sections as lists."""
    text, *rest = _HEADING.split(docstring)
    yield text.strip() + "\n"
    for title, body in zip(rest[::2], rest[1::2], strict=True):
        yield f"**{title}**\n"
        yield "\n".join(_items(body)) + "\n"


def _items(body: str) -> Iterator[str]:
    """``name : type`` and the indented lines below it become one item of a list."""
    for item in re.split(r"\n(?=\S)", body.strip()):
        head, *lines = item.split("\n")
        name, _, kind = head.partition(" : ")
        names = ", ".join(f"`{one}`" for one in name.split(", ")) if kind else name
        text = " ".join(line.strip() for line in lines if line.strip())
        yield "* " + names + (f" ({kind})" if kind else "") + (f": {text}" if text else "")


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
    print(PAGE.name)

"""What the visitor of a page may send: values of what stands there, keys, and his camera."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

import msgspec
from msgspec import Meta, Struct

if TYPE_CHECKING:
    from viser import ViserServer

Value: TypeAlias = bool | int | float | str
Accepts: TypeAlias = Callable[[str, Value], bool]
"""Whether the part of a page with this identifier takes a value."""

_FAR = 1e9
_Number = Annotated[float, Meta(ge=-_FAR, le=_FAR)]
_Pixels = Annotated[int, Meta(ge=1, le=100_000)]
_Point = tuple[_Number, _Number, _Number]
_Identifier = Annotated[str, Meta(max_length=200)]


class _Updates(Struct, forbid_unknown_fields=True):
    value: Value


class _Update(Struct, forbid_unknown_fields=True, tag_field="type", tag="GuiUpdateMessage"):
    """A part of the page has another value; viser itself would set whatever is named."""

    uuid: _Identifier
    updates: _Updates


class _Key(Struct, forbid_unknown_fields=True, tag_field="type", tag="CommandTriggerMessage"):
    uuid: _Identifier


class _Camera(Struct, forbid_unknown_fields=True, tag_field="type", tag="ViewerCameraMessage"):
    wxyz: tuple[_Number, _Number, _Number, _Number]
    position: _Point
    fov: _Number
    near: _Number
    far: _Number
    image_height: _Pixels
    image_width: _Pixels
    look_at: _Point
    up_direction: _Point

    @property
    def is_finite(self) -> bool:
        """Whether no number is NaN, which no range excludes."""
        numbers = (*self.wxyz, *self.position, *self.look_at, *self.up_direction)
        return all(map(math.isfinite, (*numbers, self.fov, self.near, self.far)))


_DECODER = msgspec.msgpack.Decoder(_Update | _Key | _Camera)


def is_wanted(message: bytes, accepts: Accepts) -> bool:
    """Whether a message is one that a page sends, with a value that the page takes.

    viser knows others, by which a visitor could have the server reached from the internet, send it
    files, or change what other visitors see.
    """
    try:
        found = _DECODER.decode(message)
    except (msgspec.MsgspecError, ValueError, RecursionError):
        return False
    if isinstance(found, _Camera):
        return found.is_finite
    return isinstance(found, _Key) or accepts(found.uuid, found.updates.value)


def accepting(server: ViserServer) -> Accepts:
    """Whether a part of viser's page is shown, and takes a value.

    Raises AttributeError for a viser that keeps its parts elsewhere.
    """
    parts: Mapping[str, Any] = (
        server.gui._gui_input_handle_from_uuid
    )  # viser has no other list of them

    def accepts(uuid: str, value: Value) -> bool:
        part = parts.get(uuid)
        if part is None or not part.visible or part.disabled:
            return False
        if hasattr(part, "options"):
            return value in part.options
        if hasattr(part, "step"):
            return _is_within(value, part.min, part.max, part.step)
        return isinstance(value, bool)

    return accepts


def _is_within(value: Value, low: float, high: float, step: float) -> bool:
    """Whether a value lies on a slider, whose last step may end behind it."""
    if isinstance(value, (bool, str)):
        return False
    return low - step <= value <= high + step

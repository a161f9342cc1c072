"""Where a handler of signals can raise an exception.

Python runs handlers between any two of its instructions, also of a function that C code called.
Nothing heavy is imported: handlers stand before the rest of facert is loaded.
"""

from __future__ import annotations

TYPE_CHECKING = False  # as in typing, which takes its time
if TYPE_CHECKING:
    from types import FrameType


def can_raise(frame: FrameType | None) -> bool:
    """Whether an exception gets through from here.

    It does not out of imports and destructors, nor out of modules that say that C calls them.
    """
    while frame is not None:
        code = frame.f_code
        if frame.f_globals.get("CALLED_BY_C"):
            return False
        if code.co_filename.startswith("<frozen importlib") or code.co_name == "__del__":
            return False
        frame = frame.f_back
    return True

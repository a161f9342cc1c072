"""The memory that this process may still take: of the machine, its container and its own limits.

Linux tells all of it. macOS tells what the machine has: half of it counts as free. Where a system
tells nothing, as Windows does, the other limits of `facert.data.memory` hold alone.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

_KIB = 1024
_UNLIMITED = 2**60
"""What a control group of the first version states, about, when it has no limit."""


def free_memory(root: Path = Path("/")) -> int | None:
    """Bytes that can still be allocated; None where nobody knows.

    `root` is the folder in which ``proc`` and ``sys`` lie.
    """
    known = [*_of_machine(root), *_of_control_groups(root), *_of_process(root)]
    return max(min(known), 0) if known else None


def _of_machine(root: Path) -> Iterator[int]:
    available = _field(root / "proc/meminfo", "MemAvailable:")
    if available is not None:
        yield available * _KIB
    elif hasattr(os, "sysconf") and "SC_PHYS_PAGES" in os.sysconf_names:
        yield os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") // 2


def _of_control_groups(root: Path) -> Iterator[int]:
    """What is left in the groups of this process, as containers and clusters set them."""
    groups = root / "sys/fs/cgroup"
    for line in _lines(root / "proc/self/cgroup"):
        _, kinds, name = [*line.split(":", 2), "", ""][:3]
        if kinds == "memory":
            files = ("memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file")
            top = groups / "memory"
        elif not kinds:
            files, top = ("memory.max", "memory.current", "inactive_file"), groups
        else:
            continue
        own = top / name.lstrip("/")
        for group in (own, *own.parents):  # in a container only the topmost is there
            if group.is_relative_to(top):
                yield from _left(group, *files)


def _left(group: Path, limit: str, usage: str, cached: str) -> Iterator[int]:
    """What a group may take beside what it has, without the files that the system only caches."""
    most, used = _number(group / limit), _number(group / usage)
    if most is not None and used is not None and most < _UNLIMITED:
        yield most - used + (_field(group / "memory.stat", cached) or 0)


def _of_process(root: Path) -> Iterator[int]:
    """What is left of the address space that the shell allows, as by ulimit -v."""
    try:
        import resource
    except ImportError:  # Windows
        return
    most, _ = resource.getrlimit(resource.RLIMIT_AS)
    used = _field(root / "proc/self/status", "VmSize:")
    if most != resource.RLIM_INFINITY and used is not None:
        yield most - used * _KIB


def _lines(path: Path) -> list[str]:
    with suppress(OSError, UnicodeError):
        return path.read_text(encoding="utf-8").splitlines()
    return []


def _field(path: Path, name: str) -> int | None:
    """The number after a name at the beginning of a line."""
    found = (line.split() for line in _lines(path))
    numbers = (words[1] for words in found if len(words) > 1 and words[0] == name)
    return next((int(number) for number in numbers if number.isdecimal()), None)


def _number(path: Path) -> int | None:
    lines = _lines(path)
    return int(lines[0]) if lines and lines[0].strip().isdecimal() else None

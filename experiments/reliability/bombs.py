"""Files made to take time or memory, or to hold absurd numbers: what facert's commands do to them.

Each runs in a process of its own, with a limit of memory and of time; printed are CPU seconds and
memory beyond those of a process that does nothing, and the last line that facert said. The status
is 1 where one of them ended in a traceback, was killed, or took more than it may.

    python -m experiments.reliability.bombs [PART OF A NAME ...] [--seconds 2] [--mebibytes 500]
"""

from __future__ import annotations

import argparse
import os
import resource
import signal
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from experiments.reliability import (  # noqa: F401  they register
    bomb_archives,
    bomb_captures,
    bomb_crowds,
    bomb_models,
)
from experiments.reliability.bomb_registry import BOMBS

LIMIT = 6 << 30  # bytes of address space
SLOW = 20  # so many times the CPU seconds that it may take, a process is killed by the clock


@dataclass(frozen=True)
class Outcome:
    """What became of one command."""

    status: int
    seconds: float
    mebibytes: float
    said: str

    def is_bad(self, seconds: float, mebibytes: float) -> bool:
        """Whether it failed otherwise than by an error of facert's, or took too much."""
        ended = self.status not in (0, 1, 2, 3) or "Traceback" in self.said
        told = self.status == 0 or "error" in self.said or "failed" in self.said
        return ended or not told or self.seconds > seconds or self.mebibytes > mebibytes


def main() -> None:
    """Make the files that were asked for, and run their commands."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n\n")[0])
    parser.add_argument("names", nargs="*", help="parts of the names of bombs; all by default")
    parser.add_argument("--seconds", type=float, default=2.0)
    parser.add_argument("--mebibytes", type=float, default=500.0)
    parser.add_argument("--patience", type=int, default=15, help="CPU seconds until it is killed")
    asked = parser.parse_args()
    _import_all()
    idle = _in_child(lambda: None, asked.patience)
    bad = total = 0
    print("bomb | command | status | CPU s | MiB | last line")
    print("---|---|---|---|---|---")
    for name, bomb in BOMBS.items():
        if asked.names and not any(part in name for part in asked.names):
            continue
        with tempfile.TemporaryDirectory(prefix="bombs-") as folder:
            path = bomb.make(Path(folder))
            for command in bomb.commands:
                words = [_filled(word, path, folder) for word in command.split()]
                one = _in_child(lambda words=words: _facert(words), asked.patience, idle)
                wrong = one.is_bad(asked.seconds, asked.mebibytes)
                bad, total = bad + wrong, total + 1
                row = f"{name} | {command} | {one.status} | {one.seconds:.1f} | {one.mebibytes:.0f}"
                print(f"{'**' if wrong else ''}{row} | {one.said[:150]}", flush=True)
                for left in Path(folder).glob("out.*"):
                    left.unlink()
    print(f"\n{total} runs, {bad} bad")
    sys.exit(bad > 0)


def _import_all() -> None:
    """Import what commands import when they begin, so that children do not."""
    import torch  # noqa: F401

    import facert.cli.app
    import facert.evaluation.run
    import facert.io.formats
    import facert.posing.suggested_frames
    import facert.render.sheet
    import facert.retarget.training  # noqa: F401


def _filled(word: str, path: Path, folder: str) -> str:
    return word.replace("FILE", str(path)).replace("DIR", folder)


def _facert(words: Sequence[str]) -> None:
    from facert.cli.app import main as facert

    sys.argv = ["facert", *words]
    facert()


def _in_child(work: Callable[[], None], patience: int, idle: Outcome | None = None) -> Outcome:
    """Run something in a process of its own; `idle` is what one takes that does nothing."""
    with tempfile.TemporaryFile("w+") as said:
        child = os.fork()
        if not child:
            _run(work, patience, said.fileno())
        begin = time.monotonic()
        while True:
            done, status, used = os.wait4(child, os.WNOHANG)
            if done:
                break
            if time.monotonic() - begin > SLOW * patience:
                os.kill(child, signal.SIGKILL)
            time.sleep(0.01)
        said.seek(0)
        lines = [line for line in said.read().splitlines() if line.strip()]
    last = next((line for line in lines if line.startswith("Traceback")), "")
    last = f"{last} {lines[-1]}".strip() if lines else ""
    code = os.waitstatus_to_exitcode(status)
    seconds, mebibytes = used.ru_utime + used.ru_stime, used.ru_maxrss / 1024
    if idle is None:
        return Outcome(code, seconds, mebibytes, last)
    return Outcome(code, seconds - idle.seconds, mebibytes - idle.mebibytes, last)


def _run(work: Callable[[], None], patience: int, said: int) -> None:
    """Do the work in a child, whose output goes to a file, and end it."""
    os.dup2(said, 1)
    os.dup2(said, 2)
    resource.setrlimit(resource.RLIMIT_AS, (LIMIT, LIMIT))
    resource.setrlimit(resource.RLIMIT_CPU, (patience, patience + 1))
    status = 0
    try:
        work()
    except SystemExit as end:
        status = end.code if isinstance(end.code, int) else 1
    except BaseException:
        import traceback

        traceback.print_exc()
        status = 99
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(status)


if __name__ == "__main__":
    main()

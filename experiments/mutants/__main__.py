"""Does a test notice? Makes each listed change of the mathematics alone and runs a few tests.

    python -m experiments.mutants [WORD ...]

With words, only the changes whose description, file or tests hold all of them. The package is
copied to a temporary folder first, the checkout is never touched. A change is *killed* when a test
fails, and *survives* when none does. The exit status is 1 when a change survives without a reason
in its list, is killed in spite of one, or no longer fits the code. Recordings are not used.
"""

from __future__ import annotations

import gc
import importlib
import multiprocessing
import os
import re
import shutil
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Sequence
from contextlib import redirect_stdout
from pathlib import Path

import pytest

from experiments.mutants.listed import ROOT, Change, changes

HEAVY = (
    "torch",
    "scipy.optimize",
    "scipy.sparse.linalg",
    "sklearn.svm",
    "sklearn.manifold",
    "sklearn.gaussian_process",
    "robust_laplacian",
    "h5py",
    "hypothesis.strategies",
)
"""Imported once, for every run to find them there; the package itself is imported by each."""
OPTIONS = ("-x", "-p", "no:cacheprovider", "-p", "no:xdist")
QUIET = ("-W", "ignore::pytest.PytestAssertRewriteWarning")  # of what was imported before
LONGEST = 300.0  # seconds; a change may make a loop endless
OUTPUT = "output.txt"
STATUS = {2: "interrupted", 3: "internal error", 4: "usage error", 5: "no tests"}
RIGHT = ("killed", "equivalent")


def main() -> None:
    words = sys.argv[1:]
    chosen = [change for change in changes() if matches(change, words)]
    began = time.perf_counter()
    for name in HEAVY:
        importlib.import_module(name)
    gc.freeze()  # or each run would look through all of it for what can be freed
    with tempfile.TemporaryDirectory() as folder:
        copy = Copy(Path(folder))
        tests = sorted({test for change in chosen for test in change.tests})
        print("first, all their tests without any change", flush=True)
        outcome = copy.run(tests, limit=None)
        if outcome != "survived":
            sys.exit(f"they do not pass: {outcome}")
        outcomes = [judged(copy, change) for change in chosen]
    print(summary(chosen, outcomes, time.perf_counter() - began))
    sys.exit(not all(outcome in RIGHT for outcome in outcomes))


def matches(change: Change, words: Sequence[str]) -> bool:
    """Whether a change is one of those asked for."""
    text = " ".join([change.what, change.file, *change.tests])
    return all(word in text for word in words)


def judged(copy: Copy, change: Change) -> str:
    """Make a change, run its tests, say what came of it."""
    began = time.perf_counter()
    try:
        with copy.changed(change):
            found = copy.run(change.tests)
    except (ValueError, SyntaxError) as error:
        found = f"does not apply: {error}"
    killed = found.startswith("killed")
    outcome = found.split(maxsplit=1)[0] if killed or found == "survived" else "broken"
    if change.reason is not None:
        outcome = {"survived": "equivalent", "killed": "has a reason"}.get(outcome, outcome)
    seconds = time.perf_counter() - began
    print(f"{outcome:12} {seconds:5.1f} s  {change.file}: {change.what} [{found}]", flush=True)
    return outcome


class Copy:
    """Package and tests in a temporary folder, where changes are made."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        for name in ("facert", "tests", "experiments"):
            shutil.copytree(
                ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__")
            )
        shutil.copy(ROOT / "pyproject.toml", folder)

    def changed(self, change: Change) -> _Changed:
        """The package with a change, for a `with` statement.

        Raises
        ------
        ValueError, SyntaxError
            When it does not fit the file.
        """
        return _Changed(self.folder / "facert" / change.file, change)

    def run(self, tests: Sequence[str], limit: float | None = LONGEST) -> str:
        """Run tests until one fails, in a process of their own; say what came of it."""
        process = multiprocessing.get_context("fork").Process(target=self._test, args=(tests,))
        process.start()
        process.join(limit)
        if process.is_alive():
            process.kill()
            process.join()
            return f"killed by the time limit of {limit:.0f} s"
        if process.exitcode == 0:
            return "survived"
        output = (self.folder / OUTPUT).read_text(encoding="utf-8")
        failed = re.search(r"^(?:FAILED|ERROR) (\S+)", output, re.MULTILINE)
        if process.exitcode == 1 and failed:
            return f"killed by {failed.group(1)}"
        status = STATUS.get(process.exitcode or 0, "crashed")
        return f"{status}\n{output[-2000:]}"

    def _test(self, tests: Sequence[str]) -> None:
        os.chdir(self.folder)
        sys.path.insert(0, str(self.folder))
        # In a place without recordings, and with the same examples every time.
        os.environ |= {"PYTHONPATH": str(self.folder), "FACERT_DATA": "/nowhere", "CI": "1"}
        with Path(OUTPUT).open("w", encoding="utf-8") as out, redirect_stdout(out):
            status = pytest.main([*OPTIONS, *QUIET, *[f"tests/{test}" for test in tests]])
        os._exit(int(status))


class _Changed:
    """A file with a change, until the end of a `with` statement."""

    count = 0

    def __init__(self, path: Path, change: Change) -> None:
        self.path, self.text = path, path.read_text(encoding="utf-8")
        self.new = change.applied(self.text)
        compile(self.new, change.file, "exec")

    def __enter__(self) -> None:
        self._write(self.new)

    def __exit__(self, *_: object) -> None:
        self._write(self.text)

    def _write(self, text: str) -> None:
        """Write the file at a time of its own: byte code is known by the whole second."""
        self.path.write_text(text, encoding="utf-8")
        _Changed.count += 1
        later = self.path.stat().st_mtime + 2 * _Changed.count
        os.utime(self.path, (later, later))


def summary(chosen: Sequence[Change], outcomes: Sequence[str], seconds: float) -> str:
    """The outcomes by room."""
    lines = []
    for room in sorted({change.room for change in chosen}):
        own = Counter(o for c, o in zip(chosen, outcomes, strict=True) if c.room == room)
        parts = ", ".join(f"{count} {outcome}" for outcome, count in sorted(own.items()))
        lines.append(f"{room}: {parts}")
    wrong = [c.what for c, o in zip(chosen, outcomes, strict=True) if o not in RIGHT]
    lines += [f"not right: {what}" for what in wrong]
    return "\n".join([*lines, f"{len(chosen)} changes in {seconds:.0f} s"])


if __name__ == "__main__":
    main()

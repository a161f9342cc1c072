"""Fuzz each target for its share of the time; see `experiments.fuzz`."""

from __future__ import annotations

import argparse
import hashlib
import importlib
import json
import os
import pkgutil
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

from experiments.fuzz.mutation import HOSTILE
from experiments.fuzz.targets import FINDINGS, Target, targets

_TIMEOUT = 60  # seconds after which libFuzzer ends what hangs
_MEMORY = 4096  # MiB
_LONGEST_WORD = 200
_SAVED = 100  # executions
STATE = "state.json"


def main() -> None:
    """Run every target in a process of its own, one after the other, and print a table."""
    parser = argparse.ArgumentParser(prog="python -m experiments.fuzz", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="TARGET")
    parser.add_argument("--minutes", type=float, default=5.0, help="for all targets together")
    parser.add_argument("--one", type=Path, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.one is not None:
        _fuzz(*given.names, round(60 * given.minutes), given.one)
        return
    chosen = targets(*given.names)
    seconds = max(1, round(60 * given.minutes / len(chosen)))
    failed = sum([_report(one.name, seconds) for one in chosen])
    sys.exit(1 if failed else 0)


def _report(name: str, seconds: int) -> int:
    """Fuzz one target in a child process; print its line, and return how many findings it had."""
    with TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "experiments.fuzz", name, "--one", folder]
        ran = subprocess.run(
            [*command, "--minutes", str(seconds / 60)], capture_output=True, text=True, check=False
        )
        state = Path(folder) / STATE
        found = json.loads(state.read_text()) if state.exists() else {}
        problems: dict[str, str] = found.get("problems", {})
        for kind in ("timeout", "crash", "oom"):  # of libFuzzer, which ends with it
            for path in Path(folder).glob(f"{kind}-*"):
                problems[kind] = str(_keep(name, path.read_bytes(), kind))
    count = found.get("executions", 0)
    print(
        f"{name:14} {count:9,} executions {count / seconds:7.0f}/s "
        f"{found.get('slowest', 0.0):6.2f} s {len(problems)} findings",
        flush=True,
    )
    for place, where in problems.items():
        print(f"    {place}: {where}")
    if not (found.get("ended") or problems):
        print(ran.stderr[-3000:])
        return 1
    return len(problems)


def _fuzz(name: str, seconds: int, folder: Path) -> None:
    """Fuzz one target in this process until its time is over; its state is kept in a folder."""
    import atheris

    with atheris.instrument_imports(include=["facert"]):
        for room in ("data", "io", "live", "retarget"):
            _import_all(f"facert.{room}")
    from experiments.fuzz.execute import execute

    (target,) = targets(name)
    found: dict[str, str] = {}
    executions, slowest, begun = 0, 0.0, time.monotonic()

    def save(ended: bool) -> None:
        state = {"executions": executions, "slowest": slowest, "problems": found, "ended": ended}
        (folder / STATE).write_text(json.dumps(state))

    def one(data: bytes) -> None:
        nonlocal executions, slowest
        before = time.process_time()
        problem = execute(target, data)
        executions, slowest = executions + 1, max(slowest, time.process_time() - before)
        if problem is not None and problem.place not in found:
            found[problem.place] = str(_keep(name, data, problem.text))
        over = time.monotonic() - begun > seconds
        if over or problem is not None or executions % _SAVED == 0:
            save(over)
        if over:
            os._exit(0)  # libFuzzer takes SystemExit for a crash

    atheris.Setup([sys.argv[0], *_options(target, folder)], one)
    atheris.Fuzz()


def _options(target: Target, folder: Path) -> list[str]:
    """The options of libFuzzer; its corpus, its dictionary and what it finds are in a folder."""
    corpus, words = folder / "corpus", folder / "words"
    corpus.mkdir()
    for index, seed in enumerate(target.seeds):
        (corpus / f"{index}").write_bytes(seed)
    escaped = ("".join(f"\\x{byte:02x}" for byte in word) for word in HOSTILE)
    words.write_text("".join(f'"{word}"\n' for word in escaped if len(word) < _LONGEST_WORD))
    largest = 2 * max(map(len, target.seeds)) + 256
    limits = (f"-timeout={_TIMEOUT}", f"-rss_limit_mb={_MEMORY}", f"-max_len={largest}")
    return [*limits, f"-dict={words}", f"-artifact_prefix={folder}/", str(corpus)]


def _import_all(room: str) -> None:
    """Import every module below a package: what is imported later would not be instrumented."""
    package = importlib.import_module(room)
    for one in pkgutil.walk_packages(package.__path__, f"{room}."):
        if ".importers." not in one.name:  # they run in other programs' Python
            importlib.import_module(one.name)


def _keep(name: str, data: bytes, text: str) -> Path:
    """Write a finding where the tests look for it."""
    FINDINGS.mkdir(parents=True, exist_ok=True)
    path = FINDINGS / f"{name}-{hashlib.sha256(data).hexdigest()[:8]}"
    path.write_bytes(data)
    print(f"{path}\n{text}", file=sys.stderr)
    return path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path


main()

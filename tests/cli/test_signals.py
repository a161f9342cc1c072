"""A signal that asks to end is one line and 128 + its number, wherever the command is."""

from __future__ import annotations

import signal
import subprocess
import sys

import pytest

from facert.cli.shared.failures import MEMORY, REPORT, described, exit_status
from facert.errors import InputError, NumericalError

PROGRAM = """
import ctypes, os, signal, sys, time, weakref
from facert.cli.shared import signals as module
module.STUCK = 0.3
signals = module.signals
signals.install()

def ask():
    os.kill(os.getpid(), {number})
    time.sleep(0.01)

{before}
try:
    with signals.raising():
        try:
            {place}
            time.sleep(5)
        finally:
            print("cleaned up", flush=True)
except KeyboardInterrupt as stop:
    said = ": ".join(["stopped", *getattr(stop, "__notes__", [])])
    os.write(2, f"{{said}}\\n".encode())
    sys.exit(signals.status)
"""
LIMIT = "the limit of CPU time (ulimit -t) is reached"
DESTRUCTOR = """
class Thing:
    def __del__(self):
        ask()
"""
MODULE = """
import importlib.abc, importlib.util
class Finder(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    def find_spec(self, name, path, target=None):
        return importlib.util.spec_from_loader(name, self) if name == "heavy" else None
    def exec_module(self, module):
        ask()
        module.is_whole = True
sys.meta_path.insert(0, Finder())
"""
CALLBACK = """
kind = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p)
compare = kind(lambda a, b: ask() or 0)
class Thing: pass
"""

HDF5 = """
import io, tempfile
from pathlib import Path
from facert.io.atomic import NewBytes
from facert.io.hdf5 import create
NewBytes.write = lambda self, content: (ask(), io.FileIO.write(self, content))[1]
def write():
    with tempfile.TemporaryDirectory() as folder, create(Path(folder, "a.h5"), "a", 1, False):
        pass
"""


def run(place, before="", number="signal.SIGTERM", **options):
    code = PROGRAM.format(number=number, place=place, before=before)
    command = [sys.executable, "-c", code]
    return subprocess.run(command, capture_output=True, text=True, timeout=60, **options)


@pytest.mark.parametrize(
    ("place", "before"),
    [
        ("ask()", ""),
        ("thing = Thing(); del thing", DESTRUCTOR),
        ("import heavy; import os", MODULE),
        ("ctypes.CDLL(None).qsort((ctypes.c_int * 2)(), 2, 4, compare)", CALLBACK),
        ("thing = Thing(); seen = weakref.ref(thing, lambda _: ask()); del thing", CALLBACK),
        ("[0].sort(key=lambda _: ask())", ""),
        ("write()", HDF5),
    ],
    ids=["code", "destructor", "import", "callback of C", "weak reference", "inside C", "HDF5"],
)
@pytest.mark.parametrize("number", ["SIGINT", "SIGTERM"])
def test_a_signal_is_raised_where_python_code_can_take_it(place, before, number):
    ended = run(place, before, f"signal.{number}")
    assert (ended.stdout, ended.stderr) == ("cleaned up\n", "stopped\n")
    assert ended.returncode == 128 + getattr(signal, number)


def test_an_end_comes_while_c_code_computes():
    later = "import hashlib, threading; threading.Timer(0.1, ask).start()"
    ended = run(f'{later}; hashlib.pbkdf2_hmac("sha256", b"", b"", 10**8)')
    assert (ended.returncode, ended.stdout, ended.stderr) == (143, "", "stopped\n")


def test_before_a_command_begins_a_signal_ends_at_once():
    ended = run("pass", before="ask()")
    assert (ended.returncode, ended.stdout, ended.stderr) == (143, "", "stopped\n")


def test_a_second_signal_waits_for_nothing():
    ended = run("ask()\n        except KeyboardInterrupt:\n            ask()")
    assert (ended.returncode, ended.stderr) == (143, "stopped\n")


def test_a_signal_after_the_end_changes_nothing():
    ended = run("signals.ignore(); ask(); sys.exit(0)")
    assert (ended.returncode, ended.stderr) == (0, "")


def test_a_program_that_was_started_to_ignore_a_hangup_does():
    ended = run(
        "ask(); sys.exit(0)",
        number="signal.SIGHUP",
        preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN),
    )
    assert (ended.returncode, ended.stderr) == (0, "")


def test_a_fork_leaves_the_signals_to_its_parent():
    forked = "child = os.fork() or os._exit(ask() or 0); print(os.waitpid(child, 0)[1])"
    ended = run(f"{forked}; sys.exit(0)")
    assert (ended.returncode, ended.stdout.split()[0]) == (0, str(int(signal.SIGTERM)))


@pytest.mark.parametrize(
    ("error", "status", "text"),
    [
        (InputError("x", "a", "b", "Mend it.", "f"), 3, "f: x: expected a, found b. Mend it."),
        (NumericalError("no answer"), 1, "no answer"),
        (MemoryError(), 1, MEMORY),
        (RuntimeError("DefaultCPUAllocator: can't allocate memory: 9 bytes"), 1, MEMORY),
        (RecursionError("maximum recursion depth exceeded"), 1, "a file is nested too deeply"),
        (OSError(28, "No space left on device", "a.h5"), 1, "a.h5: No space left on device"),
        (ImportError("no x", name="x"), 1, "a library cannot be loaded: no x. Install x again."),
        (ValueError("\x1b[31m\n"), 1, f"unexpected ValueError: \\x1b[31m (nowhere); {REPORT}"),
    ],
)
def test_whatever_is_raised_is_one_line(error, status, text):
    assert (exit_status(error), described(error)) == (status, text)


def test_the_limit_of_cpu_time_is_told_and_comes_again_without_haste():
    """Schedulers set it, and by itself the signal would end a process without a word."""
    again = "ask()\n        except KeyboardInterrupt:\n            ask()\n            raise"
    ended = run(again, number="signal.SIGXCPU")
    assert (ended.stderr, ended.returncode) == (f"stopped: {LIMIT}\n", 128 + signal.SIGXCPU)
    ended = run("pass", before="ask()", number="signal.SIGXCPU")
    assert ended.stderr == f"stopped: {LIMIT}\n"

"""Kernels of other processors, and the lowest versions of dependencies."""

import os
import platform
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from experiments.reliability import processors
from experiments.reliability.processors import PROCESSORS, probe

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.skipif(
    platform.machine() not in ("x86_64", "AMD64") or (os.cpu_count() or 1) < 2,
    reason="needs two cores of an x86-64 processor",
)
def test_kernels_of_an_older_processor_take_effect_and_others_are_noticed():
    sse = next(processor for processor in PROCESSORS if processor.name == "sse")
    found = probe(sse.environment(threads=2))
    assert sse.missing(found, threads=2) == ""
    other = replace(sse, called=("Haswell",), torch="avx2")
    assert other.missing(found, threads=1) == "BLAS ['Nehalem'], threads [2], torch default"


def test_a_processor_that_this_one_cannot_stand_for_is_passed_over(monkeypatch, capfd):
    monkeypatch.setattr(processors, "PROBE", "import os; os.kill(os.getpid(), 4)")
    assert list(processors.present(["sse"], [1])) == []
    assert capfd.readouterr().out == (
        "skipped: sse, 1 threads: found a process that ended with -4\n"
    )


def test_the_lowest_versions_are_those_of_pyproject_and_other_lines_stay():
    def lines(*arguments):
        command = [sys.executable, str(ROOT / ".ci" / "lowest.py"), *arguments]
        done = subprocess.run(command, check=True, capture_output=True, text=True)
        return done.stdout.splitlines()

    tested = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
    pyproject = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    lowest = lines()
    assert len(lowest) == len(tested)
    changed = [line for line in lowest if line not in tested]
    assert any(line.startswith("numpy==") for line in changed)
    assert all(f'"{line.replace("==", ">=")}"'.lower() in pyproject.lower() for line in changed)
    but_torch = lines("--but", "torch")
    assert [line for line in but_torch if line.startswith("torch==")] == [
        line for line in tested if line.startswith("torch==")
    ]

"""CPU seconds of whole processes, beside a Python that imports NumPy and ends."""

from __future__ import annotations

import resource
import subprocess
import sys
import tempfile
from collections.abc import Sequence

from experiments.bench.figure import Figure

FACERT = ("-c", "from facert.cli.app import main; main()")
COMMANDS = {
    "facert --help": ("--help",),
    "facert inspect": ("inspect", "demo/training.h5"),
    "facert train": ("train", "demo/training.h5", "-o", "model.safetensors", "--overwrite"),
    "facert pose": (
        *("pose", "--model", "model.safetensors", "--set", "jawOpen=0.1"),
        *("-o", "pose.h5", "--overwrite"),
    ),
}
PYTHON = "Python with NumPy"


def cpu(arguments: Sequence[str], folder: str) -> float:
    """Of one process."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    command = [sys.executable, *arguments]
    subprocess.run(command, cwd=folder, check=True, capture_output=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def figures(runs: int) -> list[Figure]:
    """Of the commands that should feel quick."""
    with tempfile.TemporaryDirectory() as folder:
        cpu((*FACERT, "demo", "demo"), folder)
        processes = {PYTHON: ("-c", "import numpy")}
        processes |= {name: (*FACERT, *words) for name, words in COMMANDS.items()}
        times: dict[str, list[float]] = {name: [] for name in processes}
        for _ in range(runs):
            for name, words in processes.items():
                times[name].append(cpu(words, folder))
    return [
        Figure.of(f"process, {name}", times[name], "s", PYTHON, times[PYTHON]) for name in COMMANDS
    ]

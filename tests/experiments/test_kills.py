"""Commands that are ended at random moments leave nothing half-written, and nothing behind."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from experiments.reliability.kills import FACERT, FAULTS, kill, prepare

pytestmark = pytest.mark.skipif(
    not Path("/proc/self/environ").exists(), reason="processes are found in /proc"
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("kills")
    prepare(place)
    return place


@pytest.mark.parametrize(("name", "count"), [("convert", 4), ("retarget", 2)])
def test_ended_commands_leave_nothing_behind(folder, name, count):
    said = []
    found = kill(name, folder, count, random.Random(count), said.append)
    assert not any(found[fault] for fault in FAULTS), "\n".join(said)
    assert found["ended"]


@pytest.mark.slow
@pytest.mark.skipif("FACERT_LONG" not in os.environ, reason="takes minutes: set FACERT_LONG=1")
@pytest.mark.parametrize("name", ["train", "eval", "batch", "render", "report", "live"])
def test_long_commands_leave_nothing_behind(folder, name):
    said = []
    found = kill(name, folder, 3, random.Random(name), said.append)
    assert not any(found[fault] for fault in FAULTS), "\n".join(said)


def test_a_batch_outlives_its_workers(folder, tmp_path):
    with subprocess.Popen(
        [*FACERT, "clean", "takes", "--out-dir", str(tmp_path), "--jobs", "2"],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": os.pathsep.join([os.getcwd(), *sys.path])},  # noqa: PTH109
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as batch:
        while not (workers := _children(batch.pid)):
            time.sleep(0.01)
        os.kill(workers[0], signal.SIGKILL)
        out, err = batch.communicate()
    assert batch.returncode == 0, err
    lines = [line for line in out.splitlines() if line.startswith("done")]
    assert sorted(line.split()[1] for line in lines) == [f"takes/{name}.h5" for name in "abcd"]
    assert len(list(tmp_path.glob("*.h5"))) == 4


def _children(process):
    files = Path(f"/proc/{process}/task").glob("*/children")
    return [int(child) for file in files for child in file.read_text().split()]

"""``facert view`` and ``facert pose --view`` as a user calls them."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import urllib.request
from pathlib import Path

import pytest

pytest.importorskip("viser", reason="viser is not installed")

DATA = Path(__file__).parents[2] / "data"
RUN = "from facert.cli.app import main; main()"
READY = re.compile(r"http://127\.0\.0\.1:\d+")


def ended(*arguments: object) -> tuple[str, str, int]:
    """What a page served and printed until Ctrl-C once it answered, and how it ended."""
    command = [sys.executable, "-c", RUN, *map(str, arguments), "--port", "0"]
    environment = os.environ | {"OMP_NUM_THREADS": "1"}
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment
    ) as process:
        line = process.stdout.readline()
        found = READY.match(line)
        assert found, process.stderr.read()
        with urllib.request.urlopen(found.group()) as answer:
            served = answer.read().decode(errors="replace")
        process.send_signal(signal.SIGINT)
        try:
            out, err = process.communicate(timeout=60)
        finally:
            process.kill()
    return served, line + out + err, process.returncode


def test_a_performance_is_served_on_this_machine_until_ctrl_c() -> None:
    rig, take = DATA / "character.h5", DATA / "performance.h5"
    served, printed, code = ended("view", take, "--rig", rig)
    assert "<title>" in served
    assert code == 0
    assert printed.splitlines() == [printed.strip()]
    assert "Ctrl-C" in printed


def test_posing_begins_without_a_model_and_leaves_no_file_unasked(tmp_path) -> None:
    take = tmp_path / "take.h5"
    take.write_bytes((DATA / "performance.h5").read_bytes())
    options = ("--take", take, "--rig", DATA / "character.h5")
    _, printed, code = ended("pose", "--view", *options)
    assert code == 0, printed
    assert list(tmp_path.iterdir()) == [take]


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (("view", "none.h5"), 3, "none.h5"),
        (("view", DATA / "character.h5"), 3, "character.h5"),
        (("view", DATA / "performance.h5", "--truth", DATA / "training.h5"), 3, "--truth"),
        (("view", DATA / "performance.h5", "--actor", DATA / "actor.h5"), 3, "--actor"),
        (("view", DATA / "performance.h5", "--host", "256.1.1.1"), 3, "--host"),
        (("view", DATA / "performance.h5", "--port", "70000"), 3, "--port"),
        (("pose", "--view"), 2, "--rig"),
        (("pose",), 2, "--set"),
        (("pose", "--view", "--rig", DATA / "character.h5", "-m", "none.safetensors"), 3, "none"),
        (("pose", "--view", "--rig", DATA / "character.h5", "-o", "a.csv"), 3, ".h5"),
    ],
)
def test_what_cannot_be_shown_is_refused_in_a_line(
    facert, tmp_path, monkeypatch, arguments, code, message
) -> None:
    monkeypatch.chdir(tmp_path)
    failed = facert(*arguments)
    assert failed.code == code
    assert message in failed.err
    assert "Traceback" not in failed.err


def test_labels_of_another_day_are_not_lost(facert, tmp_path) -> None:
    take, posed = tmp_path / "take.h5", tmp_path / "take.posed.h5"
    for path in (take, posed):
        path.write_bytes((DATA / "performance.h5").read_bytes())
    failed = facert("pose", "--view", "--take", take, "--rig", DATA / "character.h5")
    assert failed.code == 2
    assert f"--take {posed} --overwrite" in failed.err

"""What every command does when the system, or the user, stops it."""

from __future__ import annotations

import logging
import os
import subprocess
import sys
import warnings
from pathlib import Path

import pytest

from facert.cli import app
from facert.cli.commands import inspect
from facert.cli.shared import console
from facert.data import memory
from facert.io.formats import write_take_file


def test_a_name_that_is_too_long_is_one_line(facert, tmp_path):
    failed = facert("inspect", tmp_path / f"{'x' * 300}.h5")
    assert failed.code == 1
    assert failed.err.count("\n") == 1
    assert failed.err.rstrip().endswith("File name too long")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="the system has no /dev/full")
def test_a_full_disk_is_one_line():
    command = [sys.executable, "-c", "from facert.cli.app import main; main()", "--version"]
    with open("/dev/full", "w") as full:  # noqa: PTH123
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode == 1
    assert done.stderr == f"error: input or output: {os.strerror(28)}\n"


def test_ctrl_c_reports_that_it_stopped(facert, monkeypatch):
    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(inspect, "_facts", interrupted)
    stopped = facert("inspect", app.__file__)
    assert (stopped.code, stopped.err) == (130, "stopped\n")


@pytest.mark.parametrize("option", ["-q", "--quiet"])
def test_messages_are_asked_for_before_or_after_the_command(facert, make_take, tmp_path, option):
    take = tmp_path / "take.h5"
    write_take_file(make_take(), take)
    noted = ("suggest", take, "-n", 3, "--have", "labels")
    assert "goes on from 12 posed frames" in facert(*noted).err
    assert facert(option, *noted).err == facert(*noted, option).err == ""


def test_what_follows_two_dashes_is_a_name(facert):
    refused = facert("inspect", "--", "-q")
    assert refused.code == 3
    assert refused.err.startswith("error: -q: file: expected an existing file")


def test_foreign_names_in_the_log_move_no_cursor():
    console.configure(quiet=False, verbose=False)
    with console.err.capture() as shown:
        console.log.warning("no shape for %s", "\x1b[31mjaw\x9b2J")
    assert shown.get() == "warning: no shape for \\x1b[31mjaw\\x9b2J\n"


@pytest.mark.parametrize("given", [("--max-memory", "3G"), ("--max-memory=3G",)])
@pytest.mark.parametrize("first", [True, False])
def test_the_limit_of_memory_may_stand_anywhere(facert, monkeypatch, given, first):
    monkeypatch.setenv(memory.VARIABLE, "1G")
    asked = ("inspect", "no.h5")
    facert(*((*given, *asked) if first else (*asked, *given)))
    assert memory.max_memory() == 3 << 30


def test_a_limit_of_memory_that_is_none_is_told(facert):
    refused = facert("inspect", "no.h5", "--max-memory", "much")
    assert refused.code == 3
    assert refused.err.startswith("error: --max-memory: expected a size such as 500M or 4G")


@pytest.mark.filterwarnings("always")
def test_what_libraries_warn_of_is_a_detail_on_one_line(facert, make_take, monkeypatch, tmp_path):
    facts = inspect._facts

    def warned(*given):
        warnings.warn("an overflow\x1b[31m\nsecond line", RuntimeWarning, stacklevel=1)
        logging.getLogger("library").error("lost\x1b[31m\nsecond line")
        return facts(*given)

    take = tmp_path / "take.h5"
    write_take_file(make_take(), take)
    monkeypatch.setattr(inspect, "_facts", warned)
    assert facert("inspect", take).err == ""
    first, second = facert("inspect", take, "-v").err.splitlines()
    assert first.startswith(r"RuntimeWarning: an overflow\x1b[31m\nsecond line (test_app.py, line ")
    assert second == r"library: lost\x1b[31m\nsecond line"

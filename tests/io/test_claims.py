"""One run writes a file; what dead runs left goes with the next one."""

from __future__ import annotations

import multiprocessing
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from facert.errors import InputError, OutputExistsError, OutputKeptError
from facert.io.atomic import replacing, write_text, writing
from facert.io.claims import PREFIX, claim, claims_kept
from facert.io.registry import require_replaceable

WRITER = """
import sys
from pathlib import Path
from facert.io.atomic import writing
with writing(Path(sys.argv[1]), overwrite=True) as file:
    file.write(b"half")
    print("writes", flush=True)
    sys.stdin.read()
"""


@pytest.fixture
def begin_writing():
    """Begins to write a file in another process, which goes on until its input ends."""
    begun = []

    def begin(path: Path) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-c", WRITER, str(path)]
        process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        begun.append(process)
        assert process.stdout.readline() == b"writes\n"
        return process

    yield begin
    for process in begun:
        process.kill()
        process.communicate()


def test_the_second_of_two_runs_that_write_a_file_says_so(begin_writing, tmp_path):
    path = tmp_path / "take.note"
    first = begin_writing(path)
    for overwrite in (False, True):
        with (
            pytest.raises(InputError, match=rf"one that process {first.pid} is writing"),
            replacing(path, overwrite),
        ):
            pass
        with pytest.raises(InputError, match="writing"), claims_kept():
            require_replaceable(path, overwrite)
    write_text("another", tmp_path / "other.note")
    first.communicate(b"")
    assert path.read_bytes() == b"half"
    assert {one.name for one in tmp_path.iterdir()} == {"take.note", "other.note"}


def test_what_a_killed_run_left_goes_with_the_next_one_in_that_folder(begin_writing, tmp_path):
    path = tmp_path / "take.note"
    path.write_bytes(b"before")
    write_text("{}", tmp_path / "other.note")
    killed = begin_writing(path)
    killed.send_signal(signal.SIGKILL)
    killed.wait()
    left = [one.name for one in tmp_path.iterdir() if one.name.startswith(PREFIX)]
    assert len(left) == 2  # the claim, and what was written; others may have removed neither
    assert any(f"-{killed.pid}-" in name and name.endswith(".note") for name in left)
    alive = begin_writing(tmp_path / "alive.note")
    mine = tmp_path / f"{PREFIX}mine.txt"
    mine.write_text("not of this kind")
    write_text("{}", tmp_path / "other.note", overwrite=True)
    assert path.read_bytes() == b"before"
    assert not {one.name for one in tmp_path.iterdir()} & set(left)
    alive.communicate(b"")
    names = {one.name for one in tmp_path.iterdir()}
    assert names == {"take.note", "other.note", "alive.note", mine.name}


def test_a_run_claims_early_and_takes_over_from_a_dead_one(begin_writing, tmp_path):
    path = tmp_path / "new" / "take.note"
    with claims_kept():
        require_replaceable(path, overwrite=False)
        assert [one.suffix for one in path.parent.iterdir()] == [".lock"]
        claim(path)
        write_text("done", path)
    assert list(path.parent.iterdir()) == [path]
    begin_writing(path).kill()
    write_text("again", path, overwrite=True)
    assert path.read_text() == "again"
    assert list(path.parent.iterdir()) == [path]  # what the dead one wrote is gone


def test_a_run_that_writes_nothing_leaves_no_folder(tmp_path):
    with claims_kept():
        require_replaceable(tmp_path / "a" / "b" / "take.note", overwrite=False)
    assert not list(tmp_path.iterdir())


def _write(path: Path) -> None:
    write_text("x", path)


def test_many_that_write_in_one_folder_do_not_stop_each_other(tmp_path):
    context = multiprocessing.get_context("fork")
    writers = [
        context.Process(target=_write, args=(tmp_path / f"{number}.csv",)) for number in range(20)
    ]
    for writer in writers:
        writer.start()
    for writer in writers:
        writer.join()
    assert [writer.exitcode for writer in writers] == [0] * 20
    assert len(list(tmp_path.iterdir())) == 20


def test_a_link_stays_and_the_file_that_it_leads_to_is_replaced(tmp_path):
    target, link = tmp_path / "target" / "v3.note", tmp_path / "latest.note"
    write_text("old", target)
    target.chmod(0o600)
    link.symlink_to("target/v3.note")
    with pytest.raises(OutputExistsError):
        write_text("new", link)
    write_text("new", link, overwrite=True)
    assert (link.is_symlink(), target.read_text()) == (True, "new")
    assert target.stat().st_mode & 0o777 == 0o600
    assert list(target.parent.iterdir()) == [target]


def test_a_link_that_leads_nowhere_is_not_followed_unless_asked_for(tmp_path):
    link = tmp_path / "latest.note"
    link.symlink_to("v4.note")
    with pytest.raises(OutputExistsError, match="a link to a file that is not there"):
        write_text("new", link)
    assert not (tmp_path / "v4.note").exists()
    write_text("new", link, overwrite=True)
    assert (link.is_symlink(), (tmp_path / "v4.note").read_text()) == (True, "new")
    (tmp_path / "far.note").symlink_to("no/such/folder/v5.note")
    with pytest.raises(InputError, match="No such file"):
        write_text("new", tmp_path / "far.note", overwrite=True)
    assert not (tmp_path / "no").exists()
    (tmp_path / "round.note").symlink_to("round.note")
    with pytest.raises(OutputKeptError, match="leads nowhere"):
        write_text("new", tmp_path / "round.note", overwrite=True)


@pytest.mark.parametrize("kind", ["a pipe", "a folder", "a device"])
def test_what_is_no_file_is_never_replaced(kind, tmp_path):
    path = tmp_path / "out.csv"
    if kind == "a pipe":
        os.mkfifo(path)
    elif kind == "a folder":
        path.mkdir()
    else:
        path.symlink_to("/dev/full")
    before = path.stat()
    with pytest.raises(OutputKeptError, match=f"it is {kind}") as error:
        write_text("x", path, overwrite=True)
    assert error.value.exit_code == 3
    assert os.path.samestat(before, path.stat())


def test_a_file_that_appears_meanwhile_is_kept(tmp_path):
    path = tmp_path / "appears.note"

    def write():
        with writing(path) as file:
            file.write(b"time,a\n")
            path.write_text("of somebody else")

    with pytest.raises(OutputExistsError):
        write()
    assert path.read_text() == "of somebody else"
    assert list(tmp_path.iterdir()) == [path]


def test_a_folder_that_vanishes_is_an_error_in_one_line(tmp_path):
    folder = tmp_path / "gone"

    def write():
        with writing(folder / "a.note") as file:
            file.write(b"x")
            shutil.rmtree(folder)

    with pytest.raises(InputError, match="No such file"):
        write()
    assert not list(tmp_path.iterdir())

"""Work in several processes."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from calls import at_its_end, deed, ended_while_writing, reason_of, refuse

from facert.errors import FacertError, InputError
from facert.evaluation.processes import call_each


def test_results_come_from_this_process_where_one_job_will_do():
    assert list(call_each(pow, [(2, 3), (3, 2)], jobs=1)) == [8, 9]
    assert list(call_each(os.getpid, [()], jobs=4)) == [os.getpid()]


@pytest.mark.slow
def test_a_process_that_was_killed_is_a_line_of_advice():
    with pytest.raises(FacertError, match=r"a process was killed; .* use fewer --jobs"):
        list(call_each(os._exit, [(1,), (1,)], jobs=2))


def test_a_process_that_dies_costs_its_call_alone(tmp_path):
    calls = [(tmp_path, "a"), (tmp_path, "once", 1), (tmp_path, "ever", 9), (tmp_path, "z")]
    *done, one, other = call_each(deed, calls, 2, lost=reason_of)
    assert set(done) == {"a", "z"}
    once, ever = sorted((one, other), key=len)  # whichever died first
    assert (once, ever[:47]) == ("once", "ever: a process was killed; it ended by SIGKILL")
    assert len(list(tmp_path.glob("ever-*"))) == 2


def test_a_process_that_is_asked_to_end_while_it_writes_ends_clean(tmp_path, capfd):
    for reason in call_each(ended_while_writing, [(tmp_path,), (tmp_path,)], 2, lost=reason_of):
        assert "ended with status 143" in reason
    assert capfd.readouterr().err == ""


def test_what_a_call_raises_is_raised_here(capfd):
    with pytest.raises(InputError, match=r"number: expected another, found 1"):
        list(call_each(refuse, [(1,), (1,)], 2))
    assert capfd.readouterr().out == ""


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="the system has no /proc")
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM])
def test_processes_end_with_their_parent(tmp_path, number):
    code = (
        "import pathlib, sys; from calls import cleaning_up\n"
        "from facert.evaluation.processes import call_each\n"
        "from facert.cli.shared.signals import signals; signals.install()\n"
        "folder = pathlib.Path(sys.argv[1])\n"
        "with signals.raising(): list(call_each(cleaning_up, [(folder, 'a'), (folder, 'b')], 2))"
    )
    path = os.pathsep.join([str(Path(__file__).parent), *sys.path])
    with subprocess.Popen(
        [sys.executable, "-c", code, str(tmp_path)],
        env={**os.environ, "PYTHONPATH": path},
        stderr=subprocess.DEVNULL,
    ) as parent:
        while len(list(tmp_path.iterdir())) < 2:
            time.sleep(0.01)
        children = Path(f"/proc/{parent.pid}/task").glob("*/children")
        workers = " ".join(each.read_text() for each in children).split()
        assert len(workers) == 2
        parent.send_signal(number)
    until = time.monotonic() + 10
    while any(Path(f"/proc/{worker}").exists() for worker in workers):
        assert time.monotonic() < until
        time.sleep(0.01)
    assert bool(list(tmp_path.iterdir())) == (number == signal.SIGKILL)


@pytest.mark.skipif(not hasattr(signal, "SIGXCPU"), reason="the system has no such limit")
def test_a_process_without_time_or_memory_ends_and_says_so(tmp_path):
    """One that failed to send its result would otherwise end in a traceback, or be waited for."""
    calls = [(tmp_path, "time"), (tmp_path, "memory")]
    told = " ".join(call_each(at_its_end, calls, 2, lost=lambda *call: f"{call[1]}: {call[2]}"))
    assert "time: a process was killed; it ended at the limit of CPU time" in told
    assert "memory: a process was killed; it ended for lack of memory" in told

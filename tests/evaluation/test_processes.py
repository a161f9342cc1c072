"""Work in several processes."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from facert.errors import FacertError
from facert.evaluation.processes import call_each


def test_results_come_from_this_process_where_one_job_will_do():
    assert list(call_each(pow, [(2, 3), (3, 2)], jobs=1)) == [8, 9]
    assert list(call_each(os.getpid, [()], jobs=4)) == [os.getpid()]


@pytest.mark.slow
def test_a_process_that_was_killed_is_a_line_of_advice():
    with pytest.raises(FacertError, match=r"a process was killed; .* use fewer --jobs"):
        list(call_each(os._exit, [(1,), (1,)], jobs=2))


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self").exists(), reason="the system has no /proc")
def test_processes_end_with_a_parent_that_was_killed():
    code = (
        "import time; from facert.evaluation.processes import call_each\n"
        "import os; print(*call_each(os.getpid, [(), ()], 2), flush=True)\n"
        "list(call_each(time.sleep, [(60,), (60,)], 2))"
    )
    with subprocess.Popen(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, text=True
    ) as parent:
        children = set(parent.stdout.readline().split())
        time.sleep(0.5)
        os.kill(parent.pid, signal.SIGKILL)
    until = time.monotonic() + 20
    while any(Path(f"/proc/{child}/fd/0").exists() for child in children):
        assert time.monotonic() < until
        time.sleep(0.1)

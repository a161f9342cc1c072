"""What a file or a computation may take of the memory."""

from pathlib import Path

import pytest

from facert.data import memory
from facert.data.free_memory import free_memory
from facert.data.memory import LEAST, MOST, FileMemory, parsed_size, require_memory
from facert.errors import InputError

FREE = 100 << 30


@pytest.fixture(autouse=True)
def machine(monkeypatch: pytest.MonkeyPatch) -> None:
    """A machine with plenty of memory, and no limit of the user's."""
    monkeypatch.delenv(memory.VARIABLE, raising=False)
    monkeypatch.setattr(memory, "free_memory", lambda: FREE)


@pytest.mark.parametrize(("size", "most"), [(0, LEAST), (2**22, 100 * 2**22), (MOST, MOST)])
def test_a_file_may_take_a_hundred_times_its_size_within_bounds(size: int, most: int) -> None:
    FileMemory(size).require(most, "/x")
    with pytest.raises(InputError, match="--max-memory"):
        FileMemory(size).require(most + 1, "/x")


def test_the_parts_of_a_file_add_up() -> None:
    file = FileMemory(0)
    for _ in range(4):
        file.require(LEAST // 4, "/x")
    with pytest.raises(InputError, match=r"/y: expected at most 64 MiB of memory"):
        file.require(1 << 20, "/y")


def test_the_user_sets_the_limit_for_files_and_computations(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv(memory.VARIABLE, "8G")
    FileMemory(0).require(8 << 30, "/x")
    require_memory(8 << 30, "/x")
    monkeypatch.setenv(memory.VARIABLE, "10M")
    with pytest.raises(InputError, match="10 MiB"):
        FileMemory(1 << 30).require(11 << 20, "/x")


def test_nothing_takes_more_than_is_free(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(memory, "free_memory", lambda: 1 << 30)
    monkeypatch.setenv(memory.VARIABLE, "8G")
    with pytest.raises(InputError, match="which is free"):
        require_memory(2 << 30, "markers")


def test_worker_processes_share_what_is_free(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(memory, "_sharing", 1)
    monkeypatch.setattr(memory, "free_memory", lambda: 2 << 30)
    require_memory(1 << 30, "markers")
    memory.share_memory(4)
    with pytest.raises(InputError, match="at most 512 MiB of memory, which is free"):
        require_memory(1 << 30, "markers")


@pytest.mark.parametrize("text", ["", "much", "-1G", "0", "1Q", "nan", "9" * 30])
def test_a_size_that_is_none_is_refused(text: str) -> None:
    with pytest.raises(InputError, match="a size such as"):
        parsed_size(text, memory.OPTION)


def _machine(root: Path, files: dict[str, str]) -> Path:
    for name, text in files.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text)
    return root


MACHINE = {"proc/meminfo": "MemTotal: 8000000 kB\nMemAvailable:    4000000 kB\n"}


def test_free_memory_is_what_the_machine_has_available(tmp_path: Path) -> None:
    assert free_memory(_machine(tmp_path, MACHINE)) == 4000000 * 1024


@pytest.mark.parametrize(
    "groups",
    [
        {
            "proc/self/cgroup": "0::/job/step\n",
            "sys/fs/cgroup/job/step/memory.max": "max\n",
            "sys/fs/cgroup/job/step/memory.current": "600\n",
            "sys/fs/cgroup/job/memory.max": "1000\n",
            "sys/fs/cgroup/job/memory.current": "700\n",
            "sys/fs/cgroup/job/memory.stat": "anon 500\ninactive_file 200\n",
        },
        {  # in a container the group's name is that outside of it
            "proc/self/cgroup": "4:memory:/docker/abc\n3:cpuset:/\n0::/\n",
            "sys/fs/cgroup/memory/memory.limit_in_bytes": "1000\n",
            "sys/fs/cgroup/memory/memory.usage_in_bytes": "500\n",
        },
    ],
    ids=["version 2", "version 1"],
)
def test_a_container_may_have_less_than_its_machine(tmp_path: Path, groups: dict[str, str]) -> None:
    assert free_memory(_machine(tmp_path, MACHINE | groups)) == 500


def test_files_of_the_system_that_make_no_sense_set_no_limit(tmp_path: Path) -> None:
    nonsense = {"proc/self/cgroup": "\n::\n0::\n", "sys/fs/cgroup/memory.max": "much\n"}
    assert free_memory(_machine(tmp_path, MACHINE | nonsense)) == 4000000 * 1024


def test_this_machine_has_some() -> None:
    free = free_memory()
    assert free is None or free > 1 << 20

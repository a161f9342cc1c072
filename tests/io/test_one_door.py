"""Every file that facert writes goes through `facert.io.atomic`."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import facert

ROOT = Path(facert.__file__).parent
DOORS = {
    "io/atomic.py",
    "io/claims.py",  # locks, which hold nothing
    "io/importers/shared.py",  # the add-on, which runs in other programs without facert
}
WRITERS = {
    "copyfile", "copyfileobj", "CreateNew", "mkstemp", "NamedTemporaryFile", "rename", "savefig",
    "save_file", "savez", "savez_compressed", "symlink_to", "to_csv", "tofile", "touch",
    "write_frames", "write_image",
}  # fmt: skip
METHODS = {"write_bytes", "write_text"}  # of a path; `atomic` has functions of these names
OPENERS = {"fdopen", "File", "FileIO", "memmap", "open", "ZipFile"}
MODES = set("wax+")
ANY = re.compile(rf"\b({'|'.join(sorted(WRITERS | METHODS | OPENERS))})\(")
NO_FILE = (
    "open(os.devnull",
    "os.fdopen(",  # of a pipe
    "savefig(content,",  # bytes in memory
    "savefig(buffer,",
    "h5py.File(output,",  # a file of `atomic` that is open
    "Usd.Stage.CreateNew(str(temporary))",
)


def calls(text: str) -> Iterator[int]:
    """Lines of the calls that write a file by its name."""
    if not ANY.search(text):  # to parse it takes its time
        return
    for call in ast.walk(ast.parse(text)):
        if isinstance(call, ast.Call):
            method = call.func.attr if isinstance(call.func, ast.Attribute) else ""
            name = method or (call.func.id if isinstance(call.func, ast.Name) else "")
            if (name in OPENERS and writes(call)) or name in WRITERS or method in METHODS:
                yield call.lineno


def writes(call: ast.Call) -> bool:
    """Whether an argument looks like a mode of writing."""
    given = [*call.args, *(word.value for word in call.keywords)]
    texts = [one.value for one in given if isinstance(one, ast.Constant)]
    return any(isinstance(one, str) and len(one) < 4 and set(one) & MODES for one in texts)


def written(module: Path) -> list[str]:
    """The lines of a module that write a file by its name."""
    lines = module.read_text(encoding="utf-8").splitlines()
    found = [lines[number - 1].strip() for number in calls("\n".join(lines))]
    where = module.relative_to(ROOT)
    return [f"{where}: {line}" for line in found if not any(one in line for one in NO_FILE)]


@pytest.mark.parametrize(
    "text",
    [
        'open(p, "w")', 'p.open("ab")', "p.write_text(t)", "f.savefig(p)", 'h5py.File(p, "w")',
        "np.savez(p, a=a)", 'open(p, mode="r+")',
    ],
)  # fmt: skip
def test_it_is_seen_where_a_file_is_written(text):
    assert list(calls(text))


def test_no_other_module_writes_a_file():
    modules = [one for one in sorted(ROOT.rglob("*.py")) if str(one.relative_to(ROOT)) not in DOORS]
    assert not [line for module in modules for line in written(module)]

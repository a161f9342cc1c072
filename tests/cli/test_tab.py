"""Tab in a shell offers commands, options, and the names that options take."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import typer

from facert.cli.app import app
from facert.io.registry import endings
from facert.live.endpoints import INPUTS, OUTPUTS, parse_input, parse_output
from facert.methods.registry import REGISTRY
from facert.models.kernels import KERNELS
from facert.topology import driving, propagation


@pytest.fixture(name="tab")
def _tab(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch):
    """What Tab at the end of a line offers, as the script in bash asks for it."""

    def tab(line: str) -> list[str]:
        monkeypatch.setenv("_FACERT_COMPLETE", "complete_bash")
        monkeypatch.setenv("COMP_WORDS", line)
        monkeypatch.setenv("COMP_CWORD", str(len(f"{line}|".split()) - 1))
        with pytest.raises(SystemExit):
            typer.main.get_command(app)(prog_name="facert")
        return capsys.readouterr().out.split()

    return tab


def test_commands(tab) -> None:
    assert tab("facert re") == ["regions", "retarget", "render", "report"]
    assert tab("facert points ") == ["suggest"]


def test_options_of_the_command_at_hand(tab) -> None:
    assert tab("facert train take.h5 --alp") == []
    assert tab("facert train take.h5 --ani") == ["--animation"]
    assert tab("facert -q retarget in.h5 --out") == ["--out-dir"]


def test_names_of_methods_and_kernels(tab) -> None:
    assert tab("facert train --method ") == list(REGISTRY)
    assert tab("facert train --source-kernel ") == list(KERNELS)
    assert tab("facert propagate --method ") == list(propagation.METHODS)
    assert tab("facert drive --method ") == list(driving.METHODS)


def test_a_list_is_completed_after_each_comma(tab) -> None:
    assert tab("facert eval --methods ") == ["all", *REGISTRY]
    assert tab("facert eval --methods gpr,r") == ["gpr,ridge", "gpr,rbf"]
    assert tab("facert eval --methods gpr,gpr") == ["gpr,gpr-linear"]


def test_formats_units_and_other_words(tab) -> None:
    assert tab("facert retarget a.h5 --ending ") == list(endings("write", "take"))
    assert tab("facert convert a.h5 b.h5 --units m") == ["m", "mm"]
    assert tab("facert train --limits ") == ["auto", "declared", "none"]
    assert tab("facert retarget a.h5 --mode ") == ["offline", "online"]
    assert tab("facert export-script ") == ["blender", "maya"]


def test_kinds_of_streams(tab) -> None:
    assert tab("facert live --in ") == list(INPUTS)
    assert tab("facert live --out ") == list(OUTPUTS)
    assert [parse_input(f"{kind}:1").kind for kind in INPUTS] == list(INPUTS)
    places = {"csv": "a.csv", "h5": "a.h5"}
    made = [parse_output(f"{kind}:{places.get(kind, 'localhost:1')}").kind for kind in OUTPUTS]
    assert made == list(OUTPUTS)


def test_files_are_left_to_the_shell(tab) -> None:
    assert tab("facert train ta") == []


@pytest.fixture(name="home")
def _home(tmp_path: Path) -> Path:
    """A home with ``facert`` in its folder of programs."""
    program = tmp_path / "bin" / "facert"
    program.parent.mkdir()
    program.write_text(
        f"#!{sys.executable}\nfrom facert.cli.app import main\nif __name__ == '__main__':\n"
        "    main()\n"
    )
    program.chmod(0o755)
    return tmp_path


IN_SHELLS = {
    "bash": """
eval "$(facert --show-completion)"
COMP_WORDS=(facert train --meth); COMP_CWORD=2
"$(complete -p facert | sed 's/.*-F \\([^ ]*\\).*/\\1/')" facert
printf '%s\\n' "${COMPREPLY[@]}"
""",
    "zsh": """
zmodload zsh/zpty
zpty inner zsh -f -i
zpty -w inner 'autoload -U compinit; compinit -u -D'
zpty -w inner 'eval "$(facert --show-completion)"; clear'
zpty -w -n inner $'facert train --meth\\t'
zpty -r -m inner line '*--method *'
print -r -- ${${(M)${(z)line}:#--method*}[-1]}
""",
    "fish": """
facert --show-completion | source
complete -C 'facert train --meth' | string split -f 1 \\t
""",
}


@pytest.mark.parametrize("shell", IN_SHELLS)
def test_a_shell_asks_for_it_by_the_script_that_is_shown(shell: str, home: Path) -> None:
    if shutil.which(shell) is None:
        pytest.skip(f"no {shell} on this machine")
    path, modules = f"{home}/bin:/usr/bin:/bin", ":".join(sys.path)
    done = subprocess.run(
        [shell, "-c", IN_SHELLS[shell]],
        env={"PATH": path, "HOME": str(home), "PYTHONPATH": modules},
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert done.stdout.split() == ["--method"], done.stderr

"""Terminals that know few letters, are narrow, or are closed; and what styles may do to text."""

from __future__ import annotations

import io
import re
import sys

import pytest

import facert as api
from facert.cli.shared import console
from facert.data.take import Source, Take

STYLES = re.compile(r"\x1b\[[\d;]*m")


@pytest.fixture
def take(make_take, tmp_path):
    found = make_take(animation=0)
    names = ["mouth ± é", "[/bold]", ":smile:", "日本語の名前", "Kinn"]
    path = tmp_path / "étude ‮.h5"
    api.write_take(Take(found.time, Source(found.source.values, names), units="°"), path)
    return path


@pytest.mark.parametrize("encoding", ["ascii", "latin-1", "utf-8"])
def test_a_stream_shows_what_letters_it_knows(encoding: str, facert, take, monkeypatch) -> None:
    raw = io.BytesIO()
    stream = io.TextIOWrapper(raw, encoding=encoding)
    monkeypatch.setattr(sys, "stdout", stream)
    monkeypatch.setattr(sys, "argv", ["facert", "inspect", str(take)])
    api_main()
    stream.flush()
    shown = raw.getvalue().decode(encoding)
    assert "[/bold]" in shown
    assert ":smile:" in shown
    assert ("mouth ± é" in shown) == (encoding != "ascii")
    assert ("\\u65e5" in shown) == (encoding != "utf-8")


def api_main() -> None:
    from facert.cli import app

    with pytest.raises(SystemExit) as stop:
        app.main()
    assert not stop.value.code


def test_a_closed_stdout_is_no_fault(take, monkeypatch, capsys) -> None:
    for options in ((), ("--json",)):
        monkeypatch.setattr(sys, "argv", ["facert", "inspect", str(take), *options])
        with monkeypatch.context() as closed:
            closed.setattr(sys, "stdout", None)
            api_main()
    assert "Traceback" not in capsys.readouterr().err


@pytest.mark.parametrize("width", [1, 20, 500])
def test_a_narrow_terminal_still_shows_names(facert, take, width: int, monkeypatch) -> None:
    monkeypatch.setattr(console.out, "_width", width)
    done = facert("inspect", take)
    assert done.code == 0
    if width == 500:
        assert "(5) mouth ± é, [/bold], :smile:, 日本語の名前, Kinn" in done.out


def test_on_a_terminal_nothing_but_styles_stands_beside_text(facert, take, monkeypatch) -> None:
    for one in (console.out, console.err):
        monkeypatch.setattr(one, "_force_terminal", True)
        monkeypatch.setattr(one, "_color_system", 1)
    done = facert("inspect", take, "-v")
    bad = facert("inspect", "\x1b]0;x\x07[red].h5")
    text = done.out + done.err + bad.err
    assert STYLES.search(text)
    plain = STYLES.sub("", text).replace("\n", "")
    assert all(sign.isprintable() for sign in plain)
    assert r"étude \u202e.h5" in plain
    assert r"\x1b]0;x\x07[red].h5" in plain


def test_a_name_in_the_log_begins_no_line_of_its_own(capsys) -> None:
    console.configure(quiet=False, verbose=False)
    console.log.warning("name %s", "a\nwarning: \x1b[2Jforged")
    assert capsys.readouterr().err == "warning: name a\\nwarning: \\x1b[2Jforged\n"

"""Several files at once: what goes where, a status line for each, and none stops the others."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import typer

from facert.cli.shared import console
from facert.cli.shared.failures import described, is_unexpected, trace
from facert.cli.shared.files import identity, require_other_file
from facert.cli.shared.in_and_out import SWAPPED, require_in_and_out
from facert.data.subject import about
from facert.data.text import for_shell
from facert.errors import InputError, OutputExistsError, OutputKeptError
from facert.evaluation.processes import call_each, cores
from facert.io.claims import claim, claims_kept
from facert.io.registry import Kind, output_format, require_free

Thing = TypeVar("Thing")
Work = Callable[[Path, Path], Thing]
"""Makes one file from another, and returns its note for the end; must be picklable
where there are several jobs."""


@dataclass(frozen=True)
class Plan:
    """Files to read, each with the file to write from it, and how many at a time.

    Where there are to be many, each has its line, whether it failed or not.
    """

    pairs: tuple[tuple[Path, Path], ...]
    many: bool
    jobs: int = 1


def plan(
    paths: Sequence[Path],
    out_dir: Path | None,
    ending: str | None,
    jobs: int | None,
    overwrite: bool,
    kinds: tuple[Kind, ...] = ("take",),
    others: Sequence[Path | None] = (),
) -> Plan:
    """The plan of the options: IN and OUT, or files and folders of takes for `out_dir`.

    Results there are named after their sources, with `ending`, by default ``".h5"``, which must be
    that of a format for one of the `kinds`; `jobs` are by default 1, and 0 as many as there are
    processor cores. `others` are read with the takes: no result may take their place.

    Raises
    ------
    InputError
        When there is nothing to do, two results would have the same name, or one would take the
        place of a file that is read, also with `overwrite`.
    OutputExistsError
        For a single OUT that exists and may not be replaced.
    """
    _require_no_model(paths)
    if out_dir is None:
        source, output = _single(paths, {"--ending": ending, "--jobs": jobs})
        _require_kept([output], others)
        _require_single(source, output, overwrite, kinds)
        return Plan(((source, output),), many=False)
    if ending is not None and not ending.startswith("."):
        raise typer.BadParameter(f"write --ending with its dot: .{ending}")
    sources = [file for path in paths for file in _files(path)]
    outputs = [out_dir / (_stem(source) + (ending or ".h5")) for source in sources]
    output_format(outputs[0], *kinds)
    twice = [name for name in outputs if outputs.count(name) > 1]
    if twice:
        expected, found = "files with a name each", f"two for {twice[0].name}"
        raise InputError("--out-dir", expected, found, "Rename one.")
    inputs = {identity(source) for source in sources if source.exists()}
    lost = [name for name in outputs if name.exists() and identity(name) in inputs]
    if lost:
        expected = "another folder than that of the takes"
        raise InputError("--out-dir", expected, str(lost[0]), "Give another.")
    _require_kept(outputs, others)
    out_dir.mkdir(parents=True, exist_ok=True)
    count = 1 if jobs is None else jobs or cores()
    return Plan(tuple(zip(sources, outputs, strict=True)), many=True, jobs=count)


def _require_no_model(paths: Sequence[Path]) -> None:
    """Refuse a model among the takes: it has an option of its own."""
    for path in paths:
        if path.suffix.lower() == ".safetensors":
            fix = "Give it with --model, and the takes in the order IN OUT."
            raise InputError("IN or OUT", "a take", "a model", fix, where=str(path))


def _require_kept(outputs: Sequence[Path], others: Sequence[Path | None]) -> None:
    """Refuse a result that would take the place of another file that is read with the takes."""
    for output in outputs:
        for other in others:
            if other is not None:
                require_other_file(other, output, str(other))


def carry_out(
    todo: Plan,
    work: Work[Thing],
    overwrite: bool,
    conclude: Callable[[Mapping[Path, Thing]], object] | None = None,
) -> None:
    """Carry out a plan, several files at a time if asked; exits with status 1 if any failed.

    Before that, `conclude` is given what the work returned, by the sources that were done.
    """
    done: dict[Path, Thing] = {}
    failed = there = 0
    if not todo.many:
        done[todo.pairs[0][0]] = work(*todo.pairs[0])
    else:
        wanted, failed = _writable(todo.pairs, overwrite)
        there = len(todo.pairs) - len(wanted) - failed
        calls = [(work, *pair) for pair in wanted]
        for file, thing, error in call_each(_attempt, calls, todo.jobs, console.like_here(), _lost):
            failed += error is not None
            console.show(f"failed  {error}" if error else f"done    {file}")
            if error is None:
                done[file] = thing
    if conclude is not None:
        conclude(done)
    if failed:
        left = f", {there} {'exists' if there == 1 else 'exist'} already" if there else ""
        console.err.print(f"{failed} of {len(todo.pairs)} files failed{left}", style="red")
        raise typer.Exit(1)


def _writable(
    pairs: Sequence[tuple[Path, Path]], overwrite: bool
) -> tuple[list[tuple[Path, Path]], int]:
    """The pairs whose output may be written, and how many of the others failed by that."""
    wanted, failed = [], 0
    for source, output in pairs:
        try:
            require_free(output, overwrite)
        except OutputKeptError as error:
            failed += 1
            console.show(f"failed  {source}: {error}")
        except OutputExistsError:
            console.show(f"exists  {source}: {output} is there; --overwrite makes it anew")
        else:
            wanted.append((source, output))
    return wanted, failed


def _single(paths: Sequence[Path], many: dict[str, object]) -> tuple[Path, Path]:
    """IN and OUT of a single file, without the options for many."""
    if len(paths) != 2:
        raise typer.BadParameter("give IN and OUT, or files with --out-dir DIR")
    for option, given in many.items():
        if given is not None:
            raise typer.BadParameter(f"{option} is for many files: give --out-dir DIR as well")
    return paths[0], paths[1]


def _require_single(source: Path, output: Path, overwrite: bool, kinds: tuple[Kind, ...]) -> None:
    """Refuse what cannot be read or written; two that are there may both be takes to read."""
    if source.is_dir() and ("rig" not in kinds or not output.suffix):
        fix = f"For all takes of a folder: --out-dir {for_shell(output.name)}."
        raise InputError("IN", "a file, where OUT is one", "a folder", fix, where=str(source))
    try:
        require_in_and_out(source, output, overwrite, *kinds)
    except OutputExistsError as error:
        if not error.fix.endswith(SWAPPED):
            error.fix = f"{error.fix.removesuffix('.')}; for two takes, --out-dir DIR."
        raise


def _attempt(work: Work[Any], source: Path, output: Path) -> tuple[Path, Any, str | None]:
    """Do the work on one file; return it, what the work returned, and its error in one line.

    Whatever is logged meanwhile names the file.
    """
    try:
        with about(str(source)), claims_kept():
            claim(output)
            return source, work(source, output), None
    except Exception as error:  # whatever is wrong with one file, the others are done
        if is_unexpected(error):
            console.log.debug("%s", trace(error))
        return _lost(work, source, output, described(error))


def _lost(_work: Work[Any], source: Path, _output: Path, reason: str) -> tuple[Path, None, str]:
    """One file that was not done, and the reason in one line."""
    return source, None, reason if str(source) in reason else f"{source}: {reason}"


def _files(path: Path) -> list[Path]:
    """A file, or the takes in a folder."""
    if not path.is_dir():
        return [path]
    from facert.io.folder import takes_in  # NumPy, which --help does without

    found = takes_in(path)
    if not found:
        raise InputError("the folder", "takes", "none", "Give a folder with takes.", str(path))
    return found


def _stem(path: Path) -> str:
    """The name without its ending, also without a double one such as ``.livelink.csv``."""
    return path.name.removesuffix(path.suffix).removesuffix(".livelink")

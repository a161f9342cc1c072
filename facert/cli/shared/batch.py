"""Several files at once: what goes where, a status line for each, and none stops the others."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import typer

from facert.cli.shared import console
from facert.cli.shared.files import identity, require_other_file
from facert.errors import FacertError, InputError, OutputExistsError
from facert.evaluation.processes import call_each, cores
from facert.io.registry import Kind, format_of, require_output

Work = Callable[[Path, Path], None]
"""Makes one file from another; must be picklable where there are several jobs."""


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
) -> Plan:
    """The plan of the options: IN and OUT, or files and folders of takes for `out_dir`.

    Results there are named after their sources, with `ending`, by default ``".h5"``, which must be
    that of a format for one of the `kinds`; `jobs` are by default 1, and 0 as many as there are
    processor cores.

    Raises
    ------
    InputError
        When there is nothing to do, two results would have the same name, or one would take the
        place of a file that is read, also with `overwrite`.
    OutputExistsError
        For a single OUT that exists.
    """
    if out_dir is None:
        return _single(paths, {"--ending": ending, "--jobs": jobs}, overwrite, kinds)
    if ending is not None and not ending.startswith("."):
        raise typer.BadParameter(f"write --ending with its dot: .{ending}")
    sources = [file for path in paths for file in _files(path)]
    outputs = [out_dir / (_stem(source) + (ending or ".h5")) for source in sources]
    require_output(outputs[0], True, *kinds)
    twice = [name for name in outputs if outputs.count(name) > 1]
    if twice:
        expected, found = "files with a name each", f"two for {twice[0].name}"
        raise InputError("--out-dir", expected, found, "Rename one.")
    inputs = {identity(source) for source in sources if source.exists()}
    lost = [name for name in outputs if name.exists() and identity(name) in inputs]
    if lost:
        expected = "another folder than that of the takes"
        raise InputError("--out-dir", expected, str(lost[0]), "Give another.")
    out_dir.mkdir(parents=True, exist_ok=True)
    count = 1 if jobs is None else jobs or cores()
    return Plan(tuple(zip(sources, outputs, strict=True)), many=True, jobs=count)


def require_kept(todo: Plan, *others: Path | None) -> None:
    """Refuse a result that would take the place of another file that is read with the takes."""
    for _, output in todo.pairs:
        for other in others:
            if other is not None:
                require_other_file(other, output, str(other))


def carry_out(todo: Plan, work: Work, overwrite: bool) -> None:
    """Carry out a plan, several files at a time if asked; exits with status 1 if any failed."""
    if not todo.many:
        work(*todo.pairs[0])
        return
    wanted = []
    for source, output in todo.pairs:
        if overwrite or not output.exists():
            wanted.append((work, source, output))
        else:
            console.show(f"exists  {source}: {output} is there; --overwrite makes it anew")
    failed = 0
    for file, error in call_each(_attempt, wanted, todo.jobs, partial(_begin, console.log.level)):
        failed += error is not None
        console.show(f"failed  {error}" if error else f"done    {file}")
    if failed:
        there = len(todo.pairs) - len(wanted)
        left = f", {there} {'exists' if there == 1 else 'exist'} already" if there else ""
        console.err.print(f"{failed} of {len(todo.pairs)} files failed{left}", style="red")
        raise typer.Exit(1)


def _single(
    paths: Sequence[Path], many: dict[str, object], overwrite: bool, kinds: tuple[Kind, ...]
) -> Plan:
    """The plan for a single file, IN to OUT, without the options for many."""
    if len(paths) != 2:
        raise typer.BadParameter("give IN and OUT, or files with --out-dir DIR")
    for option, given in many.items():
        if given is not None:
            raise typer.BadParameter(f"{option} is for many files: give --out-dir DIR as well")
    require_output(paths[1], True, *kinds)
    if paths[1].exists():
        require_other_file(paths[0], paths[1], "IN")
        if not overwrite:
            raise _SecondPathExistsError(paths[1])
    return Plan(((paths[0], paths[1]),), many=False)


class _SecondPathExistsError(OutputExistsError):
    """Error that the second of two paths exists: perhaps both are takes to read."""

    def __str__(self) -> str:
        return f"{super().__str__().removesuffix('.')}; for two takes, --out-dir DIR."


def _begin(level: int) -> None:
    """Set a worker process to log as much as the first one."""
    console.configure(quiet=False, verbose=False)
    console.log.setLevel(level)


def _attempt(work: Work, source: Path, output: Path) -> tuple[Path, str | None]:
    """Do the work on one file; return it with its error in one line, or with None."""
    try:
        work(source, output)
    except FacertError as error:
        text = str(error)
    except OSError as error:
        text = error.strerror or str(error)
    except Exception as error:  # whatever is wrong with one file, the others are done
        text = f"unexpected {type(error).__name__}: {error}"
    else:
        return source, None
    return source, text if str(source) in text else f"{source}: {text}"


def _files(path: Path) -> list[Path]:
    """A file, or the takes in a folder."""
    if not path.is_dir():
        return [path]
    files = (file for file in path.iterdir() if file.is_file())
    found = sorted(file for file in files if format_of(file, "read", "take"))
    if not found:
        raise InputError("the folder", "takes", "none", "Give a folder with takes.", str(path))
    return found


def _stem(path: Path) -> str:
    """The name without its ending, also without a double one such as ``.livelink.csv``."""
    return path.name.removesuffix(path.suffix).removesuffix(".livelink")

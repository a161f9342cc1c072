"""Several files at once: what goes where, a status line for each, and none stops the others."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path

import typer

from facert.cli.shared import console
from facert.errors import FacertError, InputError, OutputExistsError
from facert.io.registry import Kind, format_of, output_format

Work = Callable[[Path, Path], None]
"""Makes one file from another; must be picklable where there are several jobs."""


@dataclass(frozen=True)
class Plan:
    """The files to read, and what to write for each.

    Parameters
    ----------
    pairs : tuple of (Path, Path)
    many : bool
        Whether a folder was asked for: failures are then told line by line.
    jobs : int
        Files at a time; 0: as many as there are processor cores.
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
    """What to do.

    Parameters
    ----------
    paths : sequence of Path
        IN and OUT; or with `out_dir` any number of files, and folders whose takes are all meant.
    out_dir : Path or None
        Each result goes here, named after its source.
    ending : str, optional
        Of the results in `out_dir`; by default ``".h5"``.
    jobs : int, optional
        Files at a time in `out_dir`; by default one, 0 as many as there are processor cores.
    overwrite : bool
    kinds : tuple of str
        What results may be: their endings are those of a format for one of them.

    Raises
    ------
    InputError
        When there is nothing to do, two results would have the same name, or one would take the
        place of a file that is read, also with `overwrite`.
    OutputExistsError
        For a single OUT that exists.
    """
    if out_dir is None:
        return _single(paths, ending, jobs, overwrite, kinds)
    if ending is not None and not ending.startswith("."):
        raise typer.BadParameter(f"write --ending with its dot: .{ending}")
    sources = [file for path in paths for file in _files(path)]
    outputs = [out_dir / (_stem(source) + (ending or ".h5")) for source in sources]
    output_format(outputs[0], *kinds)
    twice = [name for name in outputs if outputs.count(name) > 1]
    if twice:
        raise InputError(
            "--out-dir", "files with a name each", f"two for {twice[0].name}", "Rename one."
        )
    inputs = {_identity(source) for source in sources if source.exists()}
    lost = [name for name in outputs if name.exists() and _identity(name) in inputs]
    if lost:
        raise InputError(
            "--out-dir", "another folder than that of the takes", str(lost[0]), "Give another."
        )
    out_dir.mkdir(parents=True, exist_ok=True)
    return Plan(tuple(zip(sources, outputs, strict=True)), True, 1 if jobs is None else jobs)


def require_kept(todo: Plan, *others: Path | None) -> None:
    """Refuse to write a result over another file that is read with the takes.

    Raises
    ------
    InputError
        When a result would take the place of one of `others`.
    """
    for _, output in todo.pairs:
        for other in others:
            if other is not None:
                require_other_file(other, output, str(other))


def _single(
    paths: Sequence[Path],
    ending: str | None,
    jobs: int | None,
    overwrite: bool,
    kinds: tuple[Kind, ...],
) -> Plan:
    """One file, IN to OUT."""
    if len(paths) != 2:
        raise typer.BadParameter("give IN and OUT, or files with --out-dir DIR")
    for option, given in (("--ending", ending), ("--jobs", jobs)):
        if given is not None:
            raise typer.BadParameter(f"{option} is for many files: give --out-dir DIR as well")
    output_format(paths[1], *kinds)
    if paths[1].exists():
        require_other_file(paths[0], paths[1], "IN")
        if not overwrite:
            raise _SecondPathExistsError(paths[1])
    return Plan(((paths[0], paths[1]),), many=False)


class _SecondPathExistsError(OutputExistsError):
    """Of two paths the second one exists: perhaps both are takes to read."""

    def __str__(self) -> str:
        return f"{super().__str__().removesuffix('.')}; for two takes, --out-dir DIR."


def require_other_file(source: Path, output: Path, name: str) -> None:
    """Refuse to write over what is read, whatever it is called."""
    if source.exists() and output.exists() and _identity(source) == _identity(output):
        fix = "Give another name: what is read would be lost."
        raise InputError("OUT", f"another file than {name}", "the same", fix, str(output))


def _identity(path: Path) -> tuple[int, int]:
    """The same for every name of a file: other spellings, symbolic and hard links."""
    found = path.stat()
    return found.st_dev, found.st_ino


def carry_out(todo: Plan, work: Work, overwrite: bool) -> None:
    """Do it, several files at a time if asked; ends the command with status 1 if any failed."""
    if not todo.many:
        (pair,) = todo.pairs
        work(*pair)
        return
    wanted = [pair for pair in todo.pairs if overwrite or not pair[1].exists()]
    for source, output in todo.pairs:
        if (source, output) not in wanted:
            _tell("exists", f"{source}: {output} is there; --overwrite makes it anew")
    failed = 0
    for source, error in _outcomes(wanted, work, todo.jobs):
        failed += error is not None
        _tell("failed" if error else "done", error or str(source))
    if failed:
        console.err.print(f"{failed} of {len(wanted)} files failed", style="red")
        raise typer.Exit(1)


def _outcomes(
    pairs: Sequence[tuple[Path, Path]], work: Work, jobs: int
) -> Iterator[tuple[Path, str | None]]:
    """Each source with what went wrong, as they finish."""
    if jobs == 1 or len(pairs) < 2:
        for pair in pairs:
            yield pair[0], _attempt(work, *pair)
        return
    # Spawned, not forked: BLAS and torch have threads of their own.
    count = min(jobs or os.cpu_count() or 1, len(pairs))
    with ProcessPoolExecutor(
        count, get_context("spawn"), initializer=_begin, initargs=(console.log.level,)
    ) as pool:
        running = {pool.submit(_attempt, work, *pair): pair[0] for pair in pairs}
        for done in as_completed(running):
            yield running[done], done.result()


def _begin(level: int) -> None:
    """A process of its own logs as much as the first one."""
    console.configure(quiet=False, verbose=False)
    console.log.setLevel(level)


def _attempt(work: Work, source: Path, output: Path) -> str | None:
    """What went wrong, in one line; None when nothing did."""
    try:
        work(source, output)
    except FacertError as error:
        text = str(error)
    except OSError as error:
        text = error.strerror or str(error)
    except Exception as error:  # whatever is wrong with one file, the others are done
        text = f"unexpected {type(error).__name__}: {error}"
    else:
        return None
    return text if str(source) in text else f"{source}: {text}"


def _tell(status: str, text: str) -> None:
    console.show(f"{status:7s} {text}")


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

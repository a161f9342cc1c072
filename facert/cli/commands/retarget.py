"""``facert retarget``: a performance in, the character's parameters out."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from facert.cli.shared import console
from facert.cli.shared.batch import Plan, carry_out, plan
from facert.cli.shared.files import require_report, write_beside
from facert.cli.shared.options import (
    CONTROLS,
    DEFAULT_MODEL,
    DEVICE,
    ENDING,
    JOBS,
    MODEL,
    NO_DETECT,
    NO_SMOOTH,
    OUT_DIR,
    OVERWRITE,
    SIGMA,
    TARGET,
    MappingOptions,
    argument,
    file_option,
    option,
)
from facert.cli.shared.verdicts import print_verdicts, save_verdicts
from facert.data.text import plural
from facert.errors import InputError, reading
from facert.io.registry import OWN_ENDINGS

Mode = Literal["offline", "online"]

if TYPE_CHECKING:
    from facert.data.take import Take
    from facert.data.verdict import Verdict
    from facert.retarget.retargeter import Retargeter


def command(
    paths: Annotated[
        list[Path],
        argument(
            "IN OUT",
            "Take to retarget, and result: .h5, .csv, .json, or .livelink.csv for ARKit "
            "controls. With --out-dir: any number of takes, or folders of takes.",
        ),
    ],
    model: MODEL = DEFAULT_MODEL,
    mode: Annotated[
        Mode, option("All frames at once, or one after the other as in a live stream.")
    ] = "offline",
    neutral: Annotated[
        str | None,
        option(
            "Frames in which the actor rests, as 12 or 0..20: takes out what differs there "
            "from the training take.",
            metavar="FRAMES",
        ),
    ] = None,
    controls: CONTROLS = None,
    sigma: SIGMA = None,
    no_detect: NO_DETECT = False,
    no_smooth: NO_SMOOTH = False,
    target: TARGET = None,
    drop: Annotated[
        bool,
        option("Leave out the corrections of IN, and of OUT as it was.", "--drop-corrections"),
    ] = False,
    device: DEVICE = "cpu",
    out_dir: OUT_DIR = None,
    ending: ENDING = None,
    jobs: JOBS = None,
    json_path: Annotated[
        Path | None, file_option("The verdicts, for programs.", "--json", metavar="FILE")
    ] = None,
    overwrite: OVERWRITE = False,
) -> None:
    """Write the character's parameters for every frame of a take.

    In the end each take gets a verdict: good, look at it, or bad, with the reasons, where they are,
    and what helps.

    facert retarget facert-demo/performance.h5 retargeted.h5
    facert retarget facert-demo/training.h5 --out-dir results --ending .csv
    """
    if json_path is not None:
        require_report(json_path, overwrite)
    todo = plan(paths, out_dir, ending, jobs, overwrite)
    options = MappingOptions(controls, no_detect, no_smooth, sigma, neutral)
    work = partial(
        _retarget,
        model=model,
        mode=mode,
        options=options,
        target=target,
        drop=drop,
        device=device,
        overwrite=overwrite,
    )
    carry_out(todo, work, overwrite, partial(_conclude, todo, model, json_path, overwrite))


def _conclude(
    todo: Plan, model: Path, json_path: Path | None, overwrite: bool, done: Mapping[Path, Verdict]
) -> None:
    """Show the verdict of each take, also of those that were there already."""
    verdicts = {pair: done.get(pair[0]) or _kept(pair[1]) for pair in todo.pairs}
    known = {pair: verdict for pair, verdict in verdicts.items() if verdict is not None}
    print_verdicts(known, model, todo.many)
    if json_path is not None:
        save_verdicts(known, model, json_path, overwrite)


def _kept(result: Path) -> Verdict | None:
    """The verdict in a result that is there."""
    from facert.io.verdict import read_verdict

    try:
        there = result.is_file() and result.suffix.lower() in OWN_ENDINGS
        return read_verdict(result) if there else None
    except InputError:
        return None


def _retarget(
    source: Path,
    output: Path,
    *,
    model: Path,
    mode: Mode,
    options: MappingOptions,
    target: str | None,
    drop: bool,
    device: str,
    overwrite: bool,
) -> Verdict:
    """Retarget one take, report its error, and judge it."""
    import time

    import facert
    from facert.cli.shared.kept_corrections import with_kept
    from facert.data.labelling import without_predicted
    from facert.io.formats import read_source_file
    from facert.io.take import beside_recording, with_recording
    from facert.io.verdict import beside_result

    retargeter = _loaded(model, _stamp(model))
    take = read_source_file(source, target, retargeter.controls.names)
    began = time.perf_counter()
    chosen = options(retargeter)
    with reading(source), console.without_judged():
        take = with_recording(take, source)
        result = retargeter.retarget(take, mode, chosen, device)
    seconds = time.perf_counter() - began
    made = result if drop else with_kept(result, source, take, output)
    verdict = facert.judge(take, made, retargeter, chosen)
    beside = dict(beside_result(verdict))
    if output.suffix.lower() in OWN_ENDINGS and chosen.neutral is None:
        beside |= beside_recording(take.source)  # a calibrated one is of no other use
    write_beside(made, output, overwrite, beside)
    frames, each = plural(len(take), "frame"), 1e3 * seconds / len(take)
    console.log.info("%s in %.2f s (%.3f ms a frame)", frames, seconds, each)
    console.show(f"wrote {output}")
    if take.corrections is None:  # else its poses are of a model, set right here and there
        _print_error(without_predicted(take), result, retargeter)
    return verdict


@lru_cache(maxsize=1)
def _loaded(model: Path, _stamp: tuple[int, ...]) -> Retargeter:
    """The model of a file, read once a process until the file changes."""
    import facert

    return facert.load(model)


def _stamp(path: Path) -> tuple[int, ...]:
    """What tells a file from others and from what it was; empty where there is none."""
    try:
        found = path.stat()
    except OSError:  # which reading reports
        return ()
    return found.st_dev, found.st_ino, found.st_mtime_ns, found.st_size


def _print_error(take: Take, result: Take, retargeter: Retargeter) -> None:
    """RMS over the poses that the input held, but for those that the model was trained on."""
    from facert.data.shared_controls import shared_controls

    if not len(take.labels):
        return
    shared = shared_controls(take, result)
    if shared is None:
        console.log.info("the poses in the input are of other controls: not compared")
        return
    unseen = retargeter.without_known(shared.truth)
    if not len(unseen.labels):
        console.log.info(
            "no error shown: the input's poses were, or may have been, used in training"
        )
        return
    # Where the input lacks controls of the model, its poses may be known ones.
    trust = "" if shared.of_result else " that it was not trained on"
    _print_errors(unseen, shared.result, trust)
    if shared.left_out:
        console.log.info("%s", shared.left_out)


def _print_errors(truth: Take, result: Take, trust: str) -> None:
    """RMS against the truth of the same controls."""
    from rich.table import Table

    from facert.evaluation.metrics import compare

    comparison = compare(truth, result)
    assert comparison is not None  # they share controls and posed frames
    table = Table(title=f"RMS against {plural(comparison.frames, 'pose')}{trust}")
    table.add_column("controls")
    table.add_column("number", justify="right")
    table.add_column("RMS", justify="right")
    for group in comparison.groups:
        table.add_row(group.name, str(group.controls), f"{group.rms:.4f}")
    table.add_row("all", str(comparison.controls), f"{comparison.rms:.4f}", style="bold")
    console.out.print(table)

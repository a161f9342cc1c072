"""``facert clean``: markers without gaps and noise."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from facert.cli.shared import console
from facert.cli.shared.batch import carry_out, plan
from facert.cli.shared.files import read_observed, write_beside
from facert.cli.shared.options import (
    ENDING,
    JOBS,
    NO_DETECT,
    OUT_DIR,
    OVERWRITE,
    SIGMA,
    TARGET,
    argument,
    option,
)
from facert.errors import reading
from facert.io.registry import listed

if TYPE_CHECKING:
    from facert.data.take import Take
    from facert.retarget.cleaning import Cleaned
    from facert.retarget.options import RetargetOptions


def command(
    paths: Annotated[
        list[Path],
        argument(
            "IN OUT",
            f"Take with gaps and noise, and result: {listed('write', 'take')}; .h5 keeps its "
            "uncertainty. With --out-dir: any number of takes, or folders of takes.",
        ),
    ],
    model: Annotated[
        Path | None, option("Clean by this model of train, not by the take alone.", "--model", "-m")
    ] = None,
    no_detect: NO_DETECT = False,
    sigma: SIGMA = None,
    target: TARGET = None,
    out_dir: OUT_DIR = None,
    ending: ENDING = None,
    jobs: JOBS = None,
    overwrite: OVERWRITE = False,
) -> None:
    """Fill gaps in markers or weights, and remove noise.

    Markers that are frozen, swapped, at zero, elsewhere or absurd, single spikes, absurd weights,
    and frames of weights without a face are taken as not observed. OUT.h5 has a standard deviation
    for every value as /source/std, and /source/filled marks what had not been observed. What was
    never observed stays open.

    facert clean facert-demo/performance.h5 clean.h5
    facert clean facert-demo/training.h5 --out-dir cleaned --ending .csv
    """
    todo = plan(paths, out_dir, ending, jobs, overwrite)
    work = partial(
        _clean, model=model, no_detect=no_detect, sigma=sigma, target=target, overwrite=overwrite
    )
    carry_out(todo, work, overwrite)


def _clean(
    source: Path,
    output: Path,
    *,
    model: Path | None,
    no_detect: bool,
    sigma: float | None,
    target: str | None,
    overwrite: bool,
) -> None:
    """Clean one take and print what changed."""
    from facert.retarget.options import RetargetOptions

    take = read_observed(source, target, no_detect)
    with reading(source):
        # Bad markers are hidden by now, if they are to be.
        cleaned = _cleaned(take, model, RetargetOptions(detect=False, sigma=sigma))
    write_beside(cleaned.take, output, overwrite, {"/source/filled": cleaned.filled})
    _print_changes(cleaned, output)


def _cleaned(take: Take, model: Path | None, options: RetargetOptions) -> Cleaned:
    from facert.retarget.cleaning import clean, clean_with_model

    if model is None:
        return clean(take, options.sigma)
    from facert.retarget.retargeter import load

    return clean_with_model(take, load(model), options)


def _print_changes(cleaned: Cleaned, output: Path) -> None:
    source = cleaned.take.source
    unit = f" {cleaned.take.units}" if cleaned.take.units else ""
    share = 100.0 * cleaned.filled.mean()
    console.show(f"wrote {output}")
    console.show(
        f"filled {cleaned.filled.sum()} of {cleaned.filled.size} {source.kind} ({share:.1f} %)"
    )
    if cleaned.sigma is not None:
        console.show(f"capture noise {cleaned.sigma:.2g}{unit}")

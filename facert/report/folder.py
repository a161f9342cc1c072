"""What of a folder goes into a report: evaluations, performances, models."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TypeVar

import facert
from facert.data import Rig, Take
from facert.errors import InputError, reading
from facert.io.formats import HDF5_ENDINGS
from facert.io.hdf5 import stated_format
from facert.io.rig import FORMAT as RIG_FORMAT
from facert.io.rig import read_rig
from facert.io.take import FORMAT as TAKE_FORMAT
from facert.io.take import read_take
from facert.report.evaluation import read_evaluation
from facert.report.performance import fits, is_truth_of, performance_section
from facert.report.sections import Fact, Section

log = logging.getLogger(__name__)

MOST = 40  # files of a kind
Thing = TypeVar("Thing")


def file_section(path: Path, rig: Rig | None = None, truth: Take | None = None) -> Section:
    """The section of one file: an evaluation (.json), else a take.

    Raises
    ------
    InputError
        When it is neither.
    """
    if path.suffix.lower() == ".json":
        return read_evaluation(path)
    take = facert.read_take(path)
    with reading(path):
        return performance_section(path.name, take, rig, truth)


def folder_sections(
    folder: Path, rig: Rig | None = None, truth: Take | None = None
) -> tuple[Section, ...]:
    """Sections of all that lies in a folder; what is none of it is passed over.

    Retargeted takes are shown with the first rig in the folder that has their controls, and
    beside the first take that is posed throughout and has the same frames.

    Raises
    ------
    InputError
        When there is nothing to report.
    """
    rigs = [rig] if rig is not None else list(_read(_of_format(folder, RIG_FORMAT), read_rig))
    takes = dict(_named(_of_format(folder, TAKE_FORMAT)))
    evaluations = list(_read(sorted(folder.glob("*.json"))[:MOST], read_evaluation))
    performances = [
        _performance(path, take, rigs, [truth] if truth is not None else list(takes.values()))
        for path, take in takes.items()
        if take.std is not None and len(take.labels)
    ]
    models = list(_read(sorted(folder.glob("*.safetensors"))[:MOST], _model))
    sections = (*evaluations, *performances, *models)
    if not sections:
        expected = "what eval --json or retarget wrote, or models"
        raise InputError("folder", expected, "none", "Give another folder.", where=str(folder))
    return sections


def _performance(path: Path, take: Take, rigs: list[Rig], truths: list[Take]) -> Section:
    rig = next((one for one in rigs if fits(one, take)), None)
    truth = next((one for one in truths if one is not take and is_truth_of(one, take)), None)
    with reading(path):
        return performance_section(path.name, take, rig, truth)


def _model(path: Path) -> Section:
    """What a model says of itself."""
    facts = facert.load(path).facts
    names = facts["source_names"]
    told: dict[str, Any] = {
        "source": f"{len(names)} {facts['source_kind']}",
        "controls": ", ".join(facts["target_names"]),
        **{name: value for name, value in facts["settings"].items() if value is not None},
        **facts["figures"],
    }
    shown = tuple(Fact(str(name), _told(value)) for name, value in told.items())
    return Section(f"Model: {path.name}", facts=shown)


def _told(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _of_format(folder: Path, form: str) -> list[Path]:
    """HDF5 files of a folder that say that they are of a format."""
    found = [path for path in sorted(folder.iterdir()) if path.suffix.lower() in HDF5_ENDINGS]
    return [path for path in found if _stated(path) == form][:MOST]


def _stated(path: Path) -> str:
    try:
        return stated_format(path)
    except InputError:
        return ""


def _named(paths: list[Path]) -> Iterator[tuple[Path, Take]]:
    for path in paths:
        yield from ((path, take) for take in _read([path], read_take))


def _read(paths: list[Path], read: Callable[[Path], Thing]) -> Iterator[Thing]:
    """Read files one after the other; those that cannot be read are named and passed over."""
    for path in paths:
        try:
            yield read(path)
        except InputError as error:
            log.warning("passed over: %s", error)

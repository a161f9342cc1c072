"""The files of a folder that go into a report: evaluations, performances, models."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

import facert
from facert.data.rig import Rig
from facert.data.take import Controls, Take
from facert.data.text import plural
from facert.data.verdict import Verdict
from facert.errors import InputError, reading
from facert.io.curves import read_json_object
from facert.io.formats import read_take_file
from facert.io.guarded import files_in
from facert.io.hdf5 import RIG_FORMAT, TAKE_FORMAT, stated_format
from facert.io.registry import OWN_ENDINGS
from facert.io.rig import read_rig
from facert.io.verdict import read_verdict
from facert.pages.report.evaluation_section import read_evaluation
from facert.pages.report.performance_section import fits, performance_section, truth_among
from facert.pages.report.sections import Section, Table
from facert.retarget.model import TrainedModel
from facert.retarget.verdict import judge

log = logging.getLogger("facert")

MOST = 40  # files of a kind
CURVES = {"weightMat", "weights"}  # keys of a .json that holds them
Thing = TypeVar("Thing")


def file_section(
    path: Path,
    rig: Rig | None = None,
    truth: Take | None = None,
    model: TrainedModel | None = None,
) -> Section:
    """The section of one file: an evaluation (.json), else a performance.

    The verdict is that of the file; where it has none, one by the `model`.

    Raises
    ------
    InputError
        When it is neither.
    """
    if _is_evaluation(path):
        return read_evaluation(path)
    take = read_performance(path)
    with reading(path):
        return performance_section(path.name, take, rig, truth, _verdict(path, take, model))


def _verdict(path: Path, take: Take, model: TrainedModel | None) -> Verdict | None:
    """The verdict in a file, or by a model of the same controls."""
    found = read_verdict(path) if path.suffix.lower() in OWN_ENDINGS else None
    if found is not None or model is None or take.controls is None:
        return found
    if take.controls.names != model.controls.names:
        return None
    return judge(None, take, model)


def folder_sections(
    folder: Path,
    rig: Rig | None = None,
    truth: Take | None = None,
    model: TrainedModel | None = None,
) -> tuple[Section, ...]:
    """Sections of all results in a folder; other files are passed over.

    Retargeted takes are shown with the first rig in the folder that has their controls, and
    beside the take that is posed throughout, has the same frames, and shares most controls. A
    take that is the truth of another one has no section of its own, nor has a table or JSON of
    curves beside the .h5 file of the same name.

    Raises
    ------
    InputError
        When there is nothing to report.
    """
    own = {path: _stated(path) for path in _files(folder, *OWN_ENDINGS)}
    rigs = [path for path, form in own.items() if form == RIG_FORMAT] if rig is None else []
    documents = {path: _is_evaluation(path) for path in _files(folder, ".json")}
    evaluations = [path for path, is_one in documents.items() if is_one]
    curves = [path for path, is_one in documents.items() if not is_one]
    # Curves beside a take of the same name are of that take.
    stems = {path.stem for path in own}
    takes = [path for path, form in own.items() if form == TAKE_FORMAT]
    curves += _files(folder, ".csv")
    takes += [path for path in curves if path.stem.removesuffix(".livelink") not in stems]
    known = [rig] if rig is not None else list(_read(rigs, read_rig).values())
    unread: dict[Path, str] = {}
    sections = (
        *_read(evaluations, read_evaluation).values(),
        *_performances(_read(takes, read_performance, unread), known, truth, model),
        *_read(_files(folder, ".safetensors"), _model, unread).values(),
    )
    if not sections:
        expected = "what eval --json or retarget wrote, or models"
        raise InputError("folder", expected, "none", "Give another folder.", where=str(folder))
    return (*_unread(unread), *sections)


def _unread(found: Mapping[Path, str]) -> Iterator[Section]:
    """The files that could not be read, and why."""
    if found:
        rows = tuple((path.name, text) for path, text in found.items())
        table = Table("Files that could not be read", ("file", "why"), rows, words=True)
        yield Section("Left out", tables=(table,))


def read_performance(path: Path) -> Take:
    """A take with poses; what is written in columns alone, as .csv or .json, is taken for poses.

    Raises
    ------
    InputError
        When the file cannot be read.
    """
    take = read_take_file(path)
    if path.suffix.lower() in OWN_ENDINGS or take.source.kind != "weights":
        return take
    values = take.source.values
    whole = ~np.isnan(values).any(axis=1, keepdims=True)
    return replace(
        take, controls=Controls(take.source.names), params=np.where(whole, values, np.nan)
    )


def _performances(
    takes: dict[Path, Take], rigs: list[Rig], truth: Take | None, model: TrainedModel | None
) -> Iterator[Section]:
    """The takes that are posed throughout, but for those that are the truth of a result."""
    whole = {path: take for path, take in takes.items() if 0 < len(take) == len(take.labels)}
    results = {path: take for path, take in whole.items() if _is_result(path, take)}
    others = [take for path, take in whole.items() if path not in results]
    known = others if truth is None else [truth]
    truths = {path: truth_among(known, take) for path, take in results.items()}
    for path, take in whole.items():
        if not any(take is found for found in truths.values()):
            with reading(path):
                rig = next((one for one in rigs if fits(one, take)), None)
                verdict = _verdict(path, take, model)
                yield performance_section(path.name, take, rig, truths.get(path), verdict)


def _is_result(path: Path, take: Take) -> bool:
    """Whether a method wrote the poses; only HDF5 files hold a truth."""
    return take.std is not None or path.suffix.lower() not in OWN_ENDINGS


def _model(path: Path) -> Section:
    """The settings and figures of a model."""
    facts = facert.load(path).facts
    names = facts["source_names"]
    shown: dict[str, Any] = {
        "source": plural(len(names), facts["source_kind"][:-1]),
        "controls": ", ".join(facts["target_names"]),
        **{name: value for name, value in facts["settings"].items() if value is not None},
        **facts["figures"],
    }
    texts = {n: f"{v:.4g}" if isinstance(v, float) else str(v) for n, v in shown.items()}
    return Section(f"Model: {path.name}", facts=texts)


def _is_evaluation(path: Path) -> bool:
    """Whether a file is what `eval --json` wrote, and not curves; also of one that is damaged."""
    if path.suffix.lower() != ".json":
        return False
    try:
        return not CURVES & read_json_object(path).keys()
    except InputError:
        return True


def _files(folder: Path, *endings: str) -> list[Path]:
    """The first files with such an ending, by name."""
    found = [path for path in files_in(folder) if path.suffix.lower() in endings]
    if len(found) > MOST:
        log.warning("%s: the first %d of %d %s files", folder, MOST, len(found), endings[0])
    return found[:MOST]


def _stated(path: Path) -> str:
    """The format that an HDF5 file states; that of takes for one that is damaged."""
    try:
        return stated_format(path)
    except InputError:
        return TAKE_FORMAT  # who reads it says what is wrong


def _read(
    paths: list[Path], read: Callable[[Path], Thing], unread: dict[Path, str] | None = None
) -> dict[Path, Thing]:
    """Read some files; those that cannot be are named in the log, and join the `unread` ones."""
    found = {}
    for path in paths:
        try:
            found[path] = read(path)
        except InputError as error:
            log.warning("passed over: %s", error)
            if unread is not None:
                unread[path] = str(error).removeprefix(f"{path}: ")
    return found

"""A section from a retargeted take: faces, curves, and errors where the truth is known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from facert.data.rig import Rig
from facert.data.shared_controls import SharedControls, require_shared, shared_controls
from facert.data.take import Take
from facert.data.text import plural
from facert.data.verdict import Verdict
from facert.demo.stand_in import is_tracked, stand_in_face
from facert.evaluation.metrics import Comparison, compare
from facert.pages.report.embedding import embedded
from facert.pages.report.judged import judged
from facert.pages.report.sections import Picture, Section, Table
from facert.render.faces import Face, choose_frames, drives, posed_face, require_poses
from facert.render.plots import plot_controls
from facert.render.sheet import render_sheet

FACES = 6
PIXELS = 240  # a face a side: a page shows six beside each other


def performance_section(
    name: str,
    take: Take,
    rig: Rig | None = None,
    truth: Take | None = None,
    verdict: Verdict | None = None,
) -> Section:
    """Pictures and facts of a take with poses; with the character's rig its faces as well.

    Where the source is weights of ARKit, the actor is drawn above. With a `truth`, the true poses
    of the same frames, there are errors by part of the face. A `verdict` comes first.

    Raises
    ------
    InputError
        When the take has no poses, or rig or truth do not fit it.
    """
    poses = require_poses(take)
    shared = None if truth is None else require_shared(truth, take, "Give the truth of this take.")
    pictures: list[Picture] = []
    faces: list[Face] = [stand_in_face(take)] if is_tracked(take) else []
    if rig is not None:
        faces.append(posed_face(take, rig, "character"))
        if truth is not None and shared is not None:
            faces.append(posed_face(truth if fits(rig, truth) else shared.truth, rig, "truth"))
        sheet = render_sheet(faces, choose_frames(poses, FACES), take, PIXELS)
        pictures.append(embedded(sheet, "Frames that differ well", "png"))
    curves = plot_controls(take) if shared is None else plot_controls(shared.result, shared.truth)
    pictures.append(embedded(curves, "The controls that vary most", "svg"))
    section = Section(f"Performance: {name}", "", tuple(pictures), facts=_facts(take, rig))
    if verdict is not None:
        section = replace(section, judged=judged(name, take, verdict, faces, rig))
    return section if shared is None else _with_errors(section, shared)


def fits(rig: Rig, take: Take) -> bool:
    """Whether the rig has a shape for every control of the take."""
    return take.controls is not None and drives(rig, take.controls.names)


def truth_among(known: Sequence[Take], take: Take) -> Take | None:
    """The take that holds somebody's poses for every frame of another one.

    Of several, the one that shares most controls is taken, and none that shares less than half.
    """
    best, least = None, None
    for truth in known:
        whole = truth.std is None and len(truth.labels) == len(truth) == len(take)
        shared = shared_controls(truth, take) if whole else None
        if shared is not None and len(shared.of_result) <= len(shared.names):
            lacking = len(shared.of_result), len(shared.of_truth)
            if least is None or lacking < least:
                best, least = truth, lacking
    return best


def _with_errors(section: Section, shared: SharedControls) -> Section:
    comparison = compare(shared.truth, shared.result)
    assert comparison is not None  # they share controls and posed frames
    text = f"RMS to the truth {comparison.rms:.4f}"
    text += f"; {shared.left_out}" if shared.left_out else ""
    return replace(section, text=text, tables=(_errors(comparison),), comparison=comparison)


def _errors(comparison: Comparison) -> Table:
    rows = tuple((g.name, str(g.controls), f"{g.rms:.4f}") for g in comparison.groups)
    whole = ("all", str(comparison.controls), f"{comparison.rms:.4f}")
    caption = f"RMS to the truth over {plural(comparison.frames, 'frame')}"
    return Table(caption, ("part", "controls", "RMS"), (*rows, whole), frozenset([len(rows)]))


def _facts(take: Take, rig: Rig | None) -> dict[str, str]:
    assert take.controls is not None  # poses come with controls
    source = plural(len(take.source.names), take.source.kind[:-1])
    facts = {
        "frames": f"{len(take)}, {len(take.labels)} with a pose",
        "seconds": f"{take.time[-1] - take.time[0]:.2f} at {take.fps:g} frames/s",
        "source": f"{source}, {1 - take.source.valid.mean():.1%} not observed",
        "controls": ", ".join(take.controls.names),
        "rig": "" if rig is None else f"{len(rig.neutral)} vertices, in {rig.units or 'no unit'}",
        "model": take.model,
        "created by": take.created_by,
    }
    return {name: value for name, value in facts.items() if value}

"""A section from a retargeted take: faces, curves, and errors where the truth is known."""

from __future__ import annotations

from facert.data import Rig, Take
from facert.errors import InputError
from facert.metrics import Comparison, compare
from facert.names import shape_drivers
from facert.report.pictures import embedded
from facert.report.sections import Fact, Picture, Section, Table
from facert.view.faces import choose_frames, posed_face, require_poses
from facert.view.plots import plot_controls
from facert.view.render import render_sheet
from facert.wording import plural

FACES = 6
PIXELS = 240  # a face a side: a page shows six beside each other


def performance_section(
    name: str, take: Take, rig: Rig | None = None, truth: Take | None = None
) -> Section:
    """What there is to see of a take.

    Parameters
    ----------
    name : str
    take : Take
        With poses.
    rig : Rig, optional
        The character.
    truth : Take, optional
        True poses of the same frames.

    Raises
    ------
    InputError
        When the take has no poses, or rig or truth do not fit it.
    """
    poses = require_poses(take)
    comparison = None if truth is None else _compared(truth, take)
    pictures: list[Picture] = []
    if rig is not None:
        faces = [posed_face(take, rig, "character")]
        faces += [] if truth is None else [posed_face(truth, rig, "truth")]
        sheet = render_sheet(faces, choose_frames(poses, FACES), take, PIXELS)
        pictures.append(embedded(sheet, "Frames that differ well", "png"))
    pictures.append(embedded(plot_controls(take, truth), "The controls that vary most", "svg"))
    tables = () if comparison is None else (_errors(comparison),)
    text = "" if comparison is None else f"RMS to the truth {comparison.rms:.4f}"
    return Section(f"Performance: {name}", text, tuple(pictures), tables, _facts(take, rig))


def fits(rig: Rig, take: Take) -> bool:
    """Whether a rig has a shape for every control of a take."""
    if take.controls is None:
        return False
    try:
        shape_drivers(take.controls.names, rig.names)
    except InputError:
        return False
    return True


def is_truth_of(truth: Take, take: Take) -> bool:
    """Whether a take holds somebody's poses for every frame of another one."""
    whole = truth.std is None and len(truth.labels) == len(truth) == len(take)
    return whole and compare(truth, take) is not None


def _compared(truth: Take, take: Take) -> Comparison:
    comparison = compare(truth, take) if len(truth) == len(take) else None
    if comparison is None:
        expected = f"poses of the same controls in {plural(len(take), 'frame')}"
        raise InputError("--truth", expected, "others", "Give the truth of this take.")
    return comparison


def _errors(comparison: Comparison) -> Table:
    rows = tuple((g.name, str(g.controls), f"{g.rms:.4f}") for g in comparison.groups)
    whole = ("all", str(comparison.controls), f"{comparison.rms:.4f}")
    caption = f"RMS to the truth over {plural(comparison.frames, 'frame')}"
    return Table(caption, ("part", "controls", "RMS"), (*rows, whole), frozenset([len(rows)]))


def _facts(take: Take, rig: Rig | None) -> tuple[Fact, ...]:
    assert take.controls is not None  # poses come with controls
    source = plural(len(take.source.names), take.source.kind[:-1])
    facts = {
        "frames": f"{len(take)}, {len(take.labels)} with a pose",
        "seconds": f"{take.time[-1] - take.time[0]:.2f} at {take.fps:g} frames/s",
        "source": f"{source}, {1 - take.source.valid.mean():.1%} not observed",
        "controls": ", ".join(take.controls.names),
        "rig": "" if rig is None else f"{len(rig.neutral)} vertices, in {rig.units or 'no unit'}",
        "created by": take.created_by,
    }
    return tuple(Fact(name, value) for name, value in facts.items() if value)

"""The verdict on a take as it stands on the page: level, reasons, worst frames, a clip."""

from __future__ import annotations

import base64
import logging
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from facert.data.arrays import IntArray
from facert.data.moments import frame_label
from facert.data.rig import Rig
from facert.data.take import Take
from facert.data.verdict import LEVELS, Reason, Verdict
from facert.io.video import write_clip
from facert.pages.report.embedding import embedded
from facert.pages.report.sections import Judged, Picture, Section, Table
from facert.render.clip import draw_clip, sampled_frames
from facert.render.faces import Face
from facert.render.sheet import contact_sheet, render_sheet

log = logging.getLogger("facert")

WORST, PIXELS = 6, 240
"""Frames that are shown, and pixels of a face a side."""
SECONDS, RATE, SIZE = 3.0, 12.0, 192
"""Length of a clip, its frames a second, and pixels of a face a side."""
MOST_BYTES = 2**21
"""Of a clip: a page is sent by mail."""
GOOD = "Nothing needs to be done. Look at the frames below, and take the result on."


def judged(
    name: str, take: Take, verdict: Verdict, faces: Sequence[Face], rig: Rig | None
) -> Judged:
    """A verdict with pictures of the worst frames, as faces where there is a rig, else as markers.

    Parameters
    ----------
    name : str
        Of the file of the result.
    take : Take
    verdict : Verdict
    faces : sequence of Face
        The character, and the truth if that is known; none without a rig.
    rig : Rig, optional
    """
    model = take.model.partition(":")[0] or "MODEL"
    frames = verdict.worst(WORST)
    moving = rig is not None and len(frames) > 0 and verdict.level != LEVELS[0]
    clip = _clip(take, verdict, faces) if moving else None
    return Judged(
        verdict.level,
        tuple(dict.fromkeys(r.kind for r in verdict.reasons if r.level != LEVELS[0])),
        tuple(f"{reason.kind}: {reason.text}" for reason in verdict.reasons),
        _cures(verdict.reasons, name, model),
        tuple(_worst(take, frames, faces)),
        clip,
    )


def summary_section(sections: Sequence[Section]) -> Section | None:
    """A table of the verdicts of several takes, the worst first; None where they are fewer."""
    found = [(section.title.partition(": ")[2], section.judged) for section in sections]
    known = [(name, one) for name, one in found if one is not None]
    if len(known) < 2:
        return None
    known.sort(key=lambda pair: -LEVELS.index(pair[1].level))
    rows = tuple((name, one.level, ", ".join(one.kinds)) for name, one in known)
    columns = ("take", "verdict", "why")
    return Section("Verdicts", tables=(Table("The worst first", columns, rows, words=True),))


def worst_first(sections: Sequence[Section]) -> tuple[Section, ...]:
    """The sections with those that hold a verdict by its level, in the places of such ones."""
    judged = [section for section in sections if section.judged is not None]
    ordered = iter(sorted(judged, key=_goodness))
    return tuple(section if section.judged is None else next(ordered) for section in sections)


def _goodness(section: Section) -> int:
    assert section.judged is not None
    return -LEVELS.index(section.judged.level)


def _cures(reasons: Sequence[Reason], take: str, model: str) -> tuple[str, ...]:
    """What to do next, a line a reason; notes on a good take stay notes."""
    good = all(reason.level == LEVELS[0] for reason in reasons)
    cures = [f"{reason.kind}: {reason.cure_for(take, model)}" for reason in reasons]
    return (*([GOOD] if good else []), *dict.fromkeys(cures))


def _worst(take: Take, frames: IntArray, faces: Sequence[Face]) -> list[Picture]:
    """A picture of the frames to look at first."""
    if not len(frames):
        return []
    chosen = [int(frame) for frame in frames]
    if faces:
        sheet = render_sheet(faces, chosen, take, PIXELS)
    elif take.source.kind == "markers":
        sheet = contact_sheet(take, chosen, [frame_label(take, frame) for frame in chosen])
    else:
        return []
    return [embedded(sheet, "The frames to look at first", "png")]


def _clip(take: Take, verdict: Verdict, faces: Sequence[Face]) -> Picture | None:
    """The seconds around the worst frame in motion; None where they are too large for a page."""
    middle = float(take.time[int(np.argmax(verdict.anomaly))])
    start = max(take.time[0], min(middle - SECONDS / 2, take.time[-1] - SECONDS))
    rows = np.flatnonzero((take.time >= start) & (take.time <= start + SECONDS))
    part = range(int(rows[0]), int(rows[-1]) + 1)
    if len(part) < 2:
        return None
    rate = min(RATE, take.fps)
    pictures = draw_clip(faces, sampled_frames(take.time, part, rate), SIZE)
    with TemporaryDirectory() as folder:
        path = Path(folder) / "clip.mp4"
        write_clip(pictures, path, rate)
        content = path.read_bytes()
    if len(content) > MOST_BYTES:
        log.warning("the clip is left out: %d bytes", len(content))
        return None
    caption = f"Around the worst of them: frames {part.start}-{part.stop - 1}"
    return Picture(caption, f"data:video/mp4;base64,{base64.b64encode(content).decode()}")

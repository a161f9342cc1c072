"""What facert does in a scene of Blender: key curves and poses, mark frames, write poses."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

from facert.io.importers.blender_face import Face
from facert.io.importers.blender_keys import key_controls, keyed_frames
from facert.io.importers.shared import (
    Pose,
    ScriptError,
    Timeline,
    find,
    keys,
    listed_frames,
    plural,
    read_curves,
    read_poses,
    read_suggestions,
    some,
    write_poses,
)

MARKER = "facert "
TIMELINE = "facert_timeline"  # of the scene: which frame of the recording is when


class Report(NamedTuple):
    """What was done, and what a user should know of the rest."""

    done: str
    warnings: list[str]


def scene_rate(scene: Any) -> float:
    """Frames a second of a scene."""
    return float(scene.render.fps / scene.render.fps_base)


def timeline_of(scene: Any) -> Timeline:
    """The recording's frames in time, as the last file stated them; else those of the scene."""
    kept = scene.get(TIMELINE)
    if kept is None:
        return Timeline(scene_rate(scene))
    rate, known, _ = json.loads(kept)
    return Timeline(rate, [(frame, seconds) for frame, seconds in known])


def import_curves(
    scene: Any,
    objects: Iterable[Any],
    drivers: Mapping[str, Any],
    path: str,
    start: float,
    fit: bool,
) -> Report:
    """Key curves anew by time; `fit` gives the scene their rate and range."""
    curves, face = read_curves(path), Face(objects, drivers)
    if fit:
        _fit(scene, curves.fps, start, curves.time[-1] - curves.time[0])
    rate = scene_rate(scene)
    points = {
        control: [(start + (key.time - curves.time[0]) * rate, key.value) for key in found]
        for control in curves.values
        if (found := keys(curves, control))
    }
    warnings = key_controls(face, points, anew=True)
    time = [second - curves.time[0] for second in curves.time]
    _keep(scene, Timeline(curves.fps, list(enumerate(time))), list(curves.values))
    names = some(face.names, 4)
    at = f"{len(curves.time)} frames at {curves.fps:g} frames/s"
    at += "" if math.isclose(rate, curves.fps, rel_tol=1e-4) else f" in a scene of {rate:g}"
    return Report(f"{at}, keyed on {names}", [*face.warnings, *warnings])


def export_poses(
    scene: Any,
    objects: Iterable[Any],
    drivers: Mapping[str, Any],
    path: str,
    start: float,
    which: str,
) -> Report:
    """Write the poses of ``KEYED`` frames, of ``MARKED`` ones, or of ``SELECTED`` markers."""
    now = scene.frame_current
    scene.frame_set(math.floor(start))  # where objects that were never keyed are at rest
    face = Face(objects, drivers)
    scene.frame_set(now)
    frames = keyed_frames(face)
    if which != "KEYED":
        frames = [_at_key(frame, frames) for frame in _marked(scene, which == "SELECTED")]
    if not frames:
        fix = "key the poses first" if which == "KEYED" else "set a marker at each pose first"
        raise ScriptError(f"no frame is {which.lower()}: {fix}")
    poses, outside = _posed(scene, face, frames, start)
    if not poses:
        raise ScriptError(f"all frames are before the recording's first, which is at {start:g}")
    poses = _without_strangers(scene, poses)
    write_poses(path, poses, timeline_of(scene).rate)
    notes = [f"not in the recording, left out: {some(outside)}"] if outside else []
    shown = some([str(pose.frame) for pose in poses])
    what = f"{plural(len(poses), 'pose')} of {plural(len(poses[0].values), 'control')}"
    return Report(f"{what}, of frames {shown}", [*face.warnings, *notes])


def mark_frames(scene: Any, path: str, text: str, take: str, start: float) -> Report:
    """Set a marker at each suggested frame, from a file or a text, by time where it is known."""
    found = listed_frames(text) if text.strip() else read_suggestions(path, take.strip())
    known = [(frame, seconds) for frame, seconds in found if seconds is not None]
    if known:
        _keep(scene, Timeline(_usual_rate([(0, 0.0), *known], scene_rate(scene)), known))
    line, rate = timeline_of(scene), scene_rate(scene)
    for marker in [m for m in scene.timeline_markers if m.name.startswith(MARKER)]:
        scene.timeline_markers.remove(marker)
    for frame, seconds in found:
        when = line.seconds(frame) if seconds is None else seconds
        _mark(scene, frame, start + when * rate)
    last = max(marker.frame for marker in scene.timeline_markers)
    scene.frame_end = max(scene.frame_end, last)
    notes = [] if known or TIMELINE in scene else [f"by the scene's {rate:g} frames/s"]
    return Report(plural(len(found), "marker"), notes)


def key_poses(
    scene: Any, objects: Iterable[Any], drivers: Mapping[str, Any], path: str, start: float
) -> Report:
    """Key the poses of a table at their frames alone, and mark these."""
    face, line, rate = Face(objects, drivers), timeline_of(scene), scene_rate(scene)
    warnings: list[str] = []
    now, found = scene.frame_current, read_poses(path)
    for number, seconds, values in found:
        when = line.seconds(number or 0) if seconds is None else seconds
        frame = round(start + when * rate, 3)
        scene.frame_set(math.floor(frame), subframe=frame % 1)
        notes = key_controls(face, {c: [(frame, v)] for c, v in values.items()}, anew=False)
        warnings += [text for text in notes if text not in warnings]
        _mark(scene, line.frame(when) if number is None else number, frame)
    scene.frame_set(now)
    return Report(f"{plural(len(found), 'pose')} keyed", [*face.warnings, *warnings])


def _fit(scene: Any, fps: float, start: float, seconds: float) -> None:
    """Give a scene a rate, such as 29.97 as 30 / 1.001, and a range."""
    whole = max(1, round(fps))
    base = whole / fps
    scene.render.fps = whole
    scene.render.fps_base = 1.001 if abs(base - 1.001) < 2e-4 else base
    scene.frame_start = math.floor(start)
    scene.frame_end = math.ceil(start + seconds * scene_rate(scene) - 1e-3)


def _posed(
    scene: Any, face: Face, frames: Sequence[float], start: float
) -> tuple[list[Pose], list[str]]:
    """The poses of frames of the scene, and those that the recording has not."""
    line, rate, now = timeline_of(scene), scene_rate(scene), scene.frame_current
    poses: dict[int, Pose] = {}
    outside = []
    for frame in frames:
        seconds = (frame - start) / rate
        number = line.frame(seconds)
        if number is None:
            outside.append(f"{frame:g}")
        elif number not in poses:
            scene.frame_set(math.floor(frame), subframe=frame % 1)
            poses[number] = Pose(number, line.seconds(number), face.values())
    scene.frame_set(now)
    return [poses[number] for number in sorted(poses)], outside


def _without_strangers(scene: Any, poses: Sequence[Pose]) -> list[Pose]:
    """Poses without the controls that the imported curves have not and no pose moves.

    A result that is corrected has those of its model alone.
    """
    kept = scene.get(TIMELINE)
    curves = json.loads(kept)[2] if kept else []
    moved = {name for pose in poses for name, value in pose.values.items() if abs(value) > 1e-6}
    names = [n for n in poses[0].values if not curves or n in moved or find(n, curves) is not None]
    return [pose._replace(values={name: pose.values[name] for name in names}) for pose in poses]


def _marked(scene: Any, selected: bool) -> list[float]:
    markers = [m for m in scene.timeline_markers if m.select or not selected]
    return sorted({float(marker.frame) for marker in markers})


def _at_key(frame: float, keyed: Sequence[float]) -> float:
    """The key that a marker is for, as markers stand on whole frames; else its frame."""
    near = min(keyed, key=lambda key: abs(key - frame), default=frame)
    return near if abs(near - frame) <= 0.5 else frame


def _mark(scene: Any, frame: int | None, place: float) -> None:
    place = round(place)
    if not any(marker.frame == place for marker in scene.timeline_markers):
        scene.timeline_markers.new(f"{MARKER}{frame}", frame=place)


def _keep(scene: Any, line: Timeline, controls: Sequence[str] = ()) -> None:
    known = [(frame, round(seconds, 6)) for frame, seconds in line.known]
    scene[TIMELINE] = json.dumps([line.rate, known, list(controls)])


def _usual_rate(known: Sequence[tuple[int, float]], otherwise: float) -> float:
    """The usual rate between frames whose seconds are known."""
    rates = sorted(
        (frame - before) / (when - then)
        for (before, then), (frame, when) in zip(known, known[1:])
        if when > then
    )
    return rates[len(rates) // 2] if rates else otherwise

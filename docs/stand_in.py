"""Recordings to follow the guides with, where there is no phone and no camera system at hand.

    python docs/stand_in.py phone FOLDER
    python docs/stand_in.py optical FOLDER

The demo's actor rests for a second and performs, once for `recording` and once for `shot`, as a
phone or optical cameras would record it. `character.glb` is the demo's character, and `poses.csv`
has the poses that an artist would give it in the frames that `facert suggest -n 20` names (without
head motion).
"""

from __future__ import annotations

import csv
import sys
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

import facert
from facert.data.arrays import FloatArray
from facert.demo import acting, actor_rig, character_rig
from facert.demo.build import ACTOR
from facert.demo.character import CONTROLS, animate
from facert.demo.expressions import ACTIVATIONS
from facert.demo.head import make_head, marker_vertices
from facert.io.gltf.writer import write_glb
from facert.mesh.morphs import Morphs
from facert.preprocess.faults import without_faults
from facert.preprocess.head_motion import stabilise

FPS = 30.0
SECONDS = {"recording": 20.0, "shot": 8.0}
REST = 1.0  # seconds of them, at the beginning
POSED = 20

# The ARKit shapes that the actor's muscles move, in ARKit's order of words.
ARKIT = {
    "brow_inner_up": ("browInnerUp",),
    "brow_outer_up_L": ("browOuterUpLeft",),
    "brow_outer_up_R": ("browOuterUpRight",),
    "brow_down_L": ("browDownLeft",),
    "brow_down_R": ("browDownRight",),
    "blink_L": ("eyeBlinkLeft",),
    "blink_R": ("eyeBlinkRight",),
    "squint": ("eyeSquintLeft", "eyeSquintRight"),
    "eye_wide": ("eyeWideLeft", "eyeWideRight"),
    "cheek_raise": ("cheekSquintLeft", "cheekSquintRight"),
    "nose_wrinkle": ("noseSneerLeft", "noseSneerRight"),
    "smile_L": ("mouthSmileLeft",),
    "smile_R": ("mouthSmileRight",),
    "frown_L": ("mouthFrownLeft",),
    "frown_R": ("mouthFrownRight",),
    "stretch": ("mouthStretchLeft", "mouthStretchRight"),
    "pucker": ("mouthPucker",),
    "funnel": ("mouthFunnel",),
    "lips_press": ("mouthPressLeft", "mouthPressRight"),
    "upper_lip_up": ("mouthUpperUpLeft", "mouthUpperUpRight"),
    "lower_lip_down": ("mouthLowerDownLeft", "mouthLowerDownRight"),
    "mouth_left": ("mouthLeft",),
    "mouth_right": ("mouthRight",),
    "jaw_open": ("jawOpen",),
    "jaw_left": ("jawLeft",),
    "jaw_right": ("jawRight",),
}
JITTER = 0.01  # of a tracked weight
NOISE, HIDDEN = 0.1, 0.02  # mm, and the share of the markers that no camera sees
STABLE = ("forehead", "nose_bridge", "forehead_L", "forehead_R")
NOD, DRIFT = 8.0, 30.0  # degrees and mm, how far the head moves


def performed(name: str) -> FloatArray:
    """What the actor's muscles do in the recording or the shot, (T, 26)."""
    activations = acting.perform(SECONDS[name], FPS, list(SECONDS).index(name))
    since = np.arange(len(activations)) / FPS - REST
    return activations * np.clip(2.0 * since, 0.0, 1.0)[:, None]


def phone(folder: Path) -> None:
    """Live Link Face recordings, with the jitter of a tracker."""
    for seed, name in enumerate(SECONDS):
        activations = performed(name)
        shapes = tuple(shape for muscle in ACTIVATIONS for shape in ARKIT[muscle])
        columns = [i for i, muscle in enumerate(ACTIVATIONS) for _ in ARKIT[muscle]]
        jitter = np.random.default_rng(seed).normal(
            scale=JITTER, size=(len(activations), len(columns))
        )
        weights = np.clip(activations[:, columns] + jitter, 0.0, 1.0)
        take = facert.Take(_clock(activations), facert.Source(weights, shapes), fps=FPS)
        written = folder / f"{name}.livelink.csv"
        facert.write_take(take, written)
        written.rename(folder / f"{name}.csv")
    _character(folder)
    _poses(folder, facert.read_take(folder / "recording.csv"))


def optical(folder: Path) -> None:
    """TRC files in mm, with head motion, noise, hidden markers, and a frozen one."""
    names, vertices = marker_vertices(make_head(ACTOR))
    rig = actor_rig()
    for seed, name in enumerate(SECONDS):
        activations = performed(name)
        face = 10.0 * rig.deform(activations)[:, vertices]
        markers = _with_head(face, seed) + np.random.default_rng(seed).normal(
            scale=NOISE, size=face.shape
        )
        markers[np.random.default_rng(seed).random(markers.shape[:2]) < HIDDEN] = np.nan
        markers[100:140, names.index("lip_corner_L")] = markers[100, names.index("lip_corner_L")]
        _write_trc(folder / f"{name}.trc", _clock(activations), names, markers)
    _character(folder)
    recording = without_faults(facert.read_take(folder / "recording.trc"))
    _poses(folder, stabilise(recording, STABLE).take)


def _with_head(face: FloatArray, seed: int) -> FloatArray:
    """The face (T, M, 3) of an actor who nods, turns and sways."""
    phase = np.arange(len(face))[:, None] / FPS * [0.31, 0.23, 0.17] * 2.0 * np.pi + seed
    turned = Rotation.from_euler("xyz", NOD * np.sin(phase), degrees=True).as_matrix()
    return np.asarray(np.einsum("tij,tmj->tmi", turned, face) + DRIFT * np.cos(phase)[:, None])


def _clock(frames: FloatArray) -> FloatArray:
    return np.arange(len(frames)) / FPS


def _character(folder: Path) -> None:
    rig = character_rig()
    rest = np.zeros((1, len(rig.names)))
    write_glb(Morphs(rig.mesh, rig.shapes, rig.names, rest, np.zeros(1)), folder / "character.glb")


def _poses(folder: Path, recording: facert.Take) -> None:
    """What an artist makes of the frames that facert suggests."""
    frames = np.sort(facert.suggest_frames(recording, POSED).frames)
    poses = animate(performed("recording")[frames])
    with (folder / "poses.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["frame", *(control.name for control in CONTROLS)])
        writer.writerows([frame, *pose] for frame, pose in zip(frames, poses.round(3), strict=True))


def _write_trc(path: Path, time: FloatArray, names: tuple[str, ...], markers: FloatArray) -> None:
    """As Motion Analysis writes it; a hidden marker is three blank cells."""
    rate = round(1.0 / (time[1] - time[0]), 3)
    facts = {"DataRate": rate, "NumFrames": len(time), "NumMarkers": len(names), "Units": "mm"}
    coordinates = [f"{axis}{i}" for i in range(1, len(names) + 1) for axis in "XYZ"]
    header: list[list[object]] = [
        ["PathFileType", "4", "(X/Y/Z)", path.name],
        list(facts),
        list(facts.values()),
        ["Frame#", "Time", *(cell for name in names for cell in (name, "", ""))],
        ["", "", *coordinates],
    ]
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, delimiter="\t", lineterminator="\n")
        writer.writerows(header)
        for frame, row in enumerate(markers.reshape(len(markers), -1)):
            cells = ["" if np.isnan(value) else f"{value:.4f}" for value in row]
            writer.writerow([frame + 1, f"{time[frame]:.6f}", *cells])


KINDS = {"phone": phone, "optical": optical}


def main(arguments: list[str]) -> None:
    """Write the recordings of one kind into a new folder."""
    if len(arguments) != 2 or arguments[0] not in KINDS:
        sys.exit(__doc__)
    folder = Path(arguments[1])
    folder.mkdir(parents=True)
    KINDS[arguments[0]](folder)


if __name__ == "__main__":
    main(sys.argv[1:])

"""What a few posed frames buy: a performance from 5, 15 and 40 of them, and the truth.

    python -m experiments.few_poses docs/few_poses.png
    python -m experiments.few_poses --tracks utterance_a utterance_b --target units

The first draws the demo's performance. The second prints the same for two recordings of a phone:
poses of frames of the first, and the second as the performance. The frames are those that
`facert suggest` names in the recording. Nothing else is known of the character: old animation is
left out.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

import facert
from experiments.drawing import save
from experiments.tracks import read_track
from facert import Take
from facert.data.arrays import rms
from facert.demo import character_rig, performance_take, training_take
from facert.render.faces import posed_face
from facert.render.sheet import render_sheet

COUNTS = (5, 15, 40)
FRAMES = (109, 219, 262, 322, 440, 545)  # of the performance: those of the README's first picture
PIXELS = 200


def retargeted(posed: Take, performance: Take) -> Iterator[tuple[str, Take]]:
    """The performance from each number of poses of a wholly posed take, with a label."""
    assert posed.params is not None
    assert performance.params is not None
    print(f"the mean pose: RMS {rms(posed.params.mean(axis=0) - performance.params):.3f}")
    for count in COUNTS:
        params = np.full_like(posed.params, np.nan)
        frames = facert.suggest_frames(posed, count).frames
        params[frames] = posed.params[frames]
        retargeter = facert.train(replace(posed, params=params, animation=None))
        result = retargeter.retarget(performance)
        assert result.params is not None
        error = rms(result.params - performance.params)
        print(f"{count} poses: RMS {error:.3f}", flush=True)
        yield f"{count} poses, RMS {error:.2f}", result


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("picture", type=Path, nargs="?")
    parser.add_argument("--tracks", nargs=2)
    parser.add_argument("--target", default="units")
    options = parser.parse_args()
    if options.tracks:
        posed, performance = (read_track(name, options.target) for name in options.tracks)
    else:
        posed, performance = training_take(posed=None), performance_take()
    results = list(retargeted(posed, performance))
    if options.picture and not options.tracks:
        rig = character_rig()
        faces = [posed_face(result, rig, label) for label, result in results]
        faces.append(posed_face(performance, rig, "truth"))
        save(render_sheet(faces, FRAMES, pixels=PIXELS), options.picture)


if __name__ == "__main__":
    main()

"""What a few posed frames buy: the demo's performance from 5, 15 and 40 of them, and the truth.

    python -m experiments.few_poses docs/few_poses.png

The frames are those that `facert suggest` names in the demo's recording. Nothing else is known of
the character: the demo's old animation is left out.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np

import facert
from experiments.drawing import save
from facert.data.arrays import rms
from facert.demo import character_rig, performance_take, training_take
from facert.render.faces import posed_face
from facert.render.sheet import render_sheet

COUNTS = (5, 15, 40)
FRAMES = (109, 219, 262, 322, 440, 545)  # of the performance: those of the README's first picture
PIXELS = 200


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("picture", type=Path)
    picture = parser.parse_args().picture
    posed, performance, rig = training_take(posed=None), performance_take(), character_rig()
    assert posed.params is not None
    assert performance.params is not None
    still = posed.params.mean(axis=0) - performance.params
    print(f"the mean pose: RMS {rms(still):.3f}")
    faces = []
    for count in COUNTS:
        params = np.full_like(posed.params, np.nan)
        frames = facert.suggest_frames(posed, count).frames
        params[frames] = posed.params[frames]
        retargeter = facert.train(replace(posed, params=params, animation=None))
        result = retargeter.retarget(performance)
        assert result.params is not None
        error = rms(result.params - performance.params)
        print(f"{count} poses: RMS {error:.3f}")
        faces.append(posed_face(result, rig, f"{count} poses, RMS {error:.2f}"))
    faces.append(posed_face(performance, rig, "truth"))
    save(render_sheet(faces, FRAMES, pixels=PIXELS), picture)


if __name__ == "__main__":
    main()

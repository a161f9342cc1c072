"""What limits of 0 to 1 do, by rule: the error over that within the range of the poses alone.

    python -m experiments.limits

Trains on suggested frames of one recording and tests on another one, of the tracks that the
environment variable FACERT_DATA points to. Writes a row for each pair, target and number of poses.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

import facert
from experiments.tracks import read_track
from facert.data.arrays import rms
from facert.data.limits import SHARE
from facert.data.names import match
from facert.data.take import Controls, Take

PAIRS = [
    ("utterance_b", "utterance_a"),
    ("utterance_a", "utterance_b"),
    ("rom", "utterance_a"),
    ("rom", "utterance_b"),
    ("utterance_b", "rom"),
]
TARGETS, COUNTS = ("units", "arkit"), (10, 20, 40)


def main() -> None:
    """Print the table, and the mean and the largest ratio of each rule."""
    ratios = []
    print("| trained on | tested on | target | poses | range | auto | declared |")
    print("|---|---|---|---|---|---|---|")
    for pair in PAIRS:
        for target in TARGETS:
            trained, tested = (read_track(name, target) for name in pair)
            for count in COUNTS:
                plain, *others = _errors(trained, tested, count)
                ratios.append([error / plain for error in others])
                cells = " | ".join(f"{ratio:.3f}" for ratio in ratios[-1])
                print(f"| {' | '.join(pair)} | {target} | {count} | {plain:.4f} | {cells} |")
    mean, most = np.exp(np.log(ratios).mean(axis=0)), np.max(ratios, axis=0)
    for rule, one, worst in zip(("auto", "declared"), mean, most, strict=True):
        print(f"{rule}: {one:.3f} on average, {worst:.3f} at most")


def _errors(trained: Take, tested: Take, count: int) -> list[float]:
    """RMS without limits, and with limits of 0 to 1 by each rule."""
    assert trained.controls is not None
    assert trained.params is not None
    bare = replace(trained, controls=None, params=None)
    frames = facert.suggest_frames(bare, count).frames
    params = np.full_like(trained.params, np.nan)
    params[frames] = trained.params[frames]
    names = trained.controls.names
    limits = np.tile(SHARE, (len(names), 1))
    posed = replace(trained, params=params)
    limited = replace(posed, controls=Controls(names, limits))
    models = (
        facert.train(posed),
        facert.train(limited),
        facert.train(limited, facert.Settings(limits="declared")),
    )
    return [_error(model, tested) for model in models]


def _error(model: facert.Retargeter, tested: Take) -> float:
    assert tested.controls is not None
    assert tested.params is not None
    result = model.retarget(replace(tested, controls=None, params=None))
    assert result.params is not None
    columns = match(model.controls.names, tested.controls.names, "/target/names")
    return rms(result.params - tested.params[:, columns])


if __name__ == "__main__":
    main()

"""Corrections of a whole shot: the frames around them, and what a model learns from them.

    python -m experiments.correcting_shots

A model is trained on 20 suggested frames of one take of an actor and retargets another. Its worst
frames, a second apart, are set to the truth with `facert.correct`. Measured over other frames is
the RMS of the shot

- as it was, and with the corrections alone (a window of 0 s), or blended over 0.25 to 2 s,
- after training anew on the first take and the corrections, as labels of the source that the model
  has cleaned, and of the recording, which a result keeps for that; and with twice as many suggested
  frames that are labelled as they were predicted,

and in the window of 0.5 s the RMS of the errors in standard deviations that the result states,
before and after, for the model's own and for those shrunk with the weight w of a correction,
sqrt(1 - w²). Writes `experiments/results/correcting_shots.md`.
"""

from __future__ import annotations

import argparse
import logging
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from threadpoolctl import threadpool_limits

import facert
from experiments.grid import RESULTS
from experiments.report import markdown, write_text
from experiments.tracks import read_track
from facert import Take
from facert.data.arrays import FloatArray, IntArray, rms
from facert.data.corrections import WIDTH

PROBLEMS = (
    ("utterance_a", "utterance_b", "units", 0.0),
    ("utterance_b", "utterance_a", "units", 0.0),
    ("utterance_a", "utterance_b", "arkit", 0.0),
    ("utterance_b", "utterance_a", "arkit", 0.0),
    ("utterance_a", "utterance_b", "units", 0.03),
    ("utterance_b", "utterance_a", "units", 0.03),
)
"""Shot, take of the labels, target, and marker noise in cm."""
LABELS, APART = 20, 1.0
CONFIRMED = 2
COUNTS, WIDTHS = (5, 20), (0.0, 0.25, 0.5, 1.0, 2.0)


@dataclass(frozen=True, eq=False)
class Shot:
    """A retargeted shot with its truth."""

    taught: Take  # What the model was trained on
    result: Take
    truth: Take

    def worst(self, count: int) -> IntArray:
        """The frames with the largest errors, at least `APART` from each other, rising."""
        left = np.sqrt(np.mean(self.errors(self.result) ** 2, axis=1))
        chosen = []
        for _ in range(count):
            chosen.append(int(left.argmax()))
            left[np.abs(self.truth.time - self.truth.time[chosen[-1]]) < APART] = -1.0
        return np.sort(np.array(chosen, dtype=np.int64))

    def with_confirmed(self, corrected: Mapping[int, FloatArray]) -> Take:
        """The shot retargeted anew, by a model that learns from suggested frames as predicted too.

        There are `CONFIRMED` times as many of them as corrected ones.
        """
        assert self.result.params is not None
        bare = replace(self.truth, params=None)
        frames = facert.suggest_frames(bare, CONFIRMED * len(corrected)).frames.tolist()
        confirmed = {frame: self.result.params[frame] for frame in frames}
        made = facert.correct(self.result, confirmed | dict(corrected))
        as_recorded = replace(made, source=self.truth.source)
        model = facert.train([self.taught, as_recorded], corrections_only=True)
        return model.retarget(bare)

    def errors(self, result: Take) -> FloatArray:
        """Errors of a result, (T, P)."""
        assert result.params is not None
        assert self.truth.params is not None
        return np.asarray(result.params - self.truth.params)


def make_shot(name: str, taught: str, target: str, noise: float) -> Shot:
    """Train on suggested frames of one take, and retarget the other."""
    truth, other = (noisy(read_track(one, target), noise) for one in (name, taught))
    posed = with_poses(other, facert.suggest_frames(other, LABELS).frames)
    result = facert.train(posed).retarget(replace(truth, params=None))
    return Shot(posed, result, truth)


def noisy(take: Take, noise: float) -> Take:
    """The take with noise in its markers."""
    drawn = np.random.default_rng(len(take)).normal(size=take.source.matrix.shape)
    return replace(take, source=take.source.with_matrix(take.source.matrix + noise * drawn))


def with_poses(take: Take, frames: IntArray) -> Take:
    """The take with the poses of some frames."""
    assert take.params is not None
    params = np.full_like(take.params, np.nan)
    params[frames] = take.params[frames]
    return replace(take, params=params)


def measure(shot: Shot, count: int) -> dict[str, float]:
    """RMS over the frames that are not corrected, and errors in deviations near them."""
    frames = shot.worst(count)
    others = np.setdiff1d(np.arange(len(shot.truth)), frames)
    assert shot.truth.params is not None
    truth = dict(zip(frames.tolist(), shot.truth.params[frames], strict=True))
    found = {"before": rms(shot.errors(shot.result)[others])}
    for width in WIDTHS:
        made = facert.correct(shot.result, truth, width=width)
        found[f"{width:g} s"] = rms(shot.errors(made)[others])
    made = facert.correct(shot.result, truth)
    labels = {"anew, cleaned": made, "anew": with_poses(shot.truth, frames)}
    for name, labelled in labels.items():
        model = facert.train([shot.taught, labelled], corrections_only=True)
        anew = model.retarget(replace(shot.truth, params=None))
        found[name] = rms(shot.errors(anew)[others])
    found["anew, others confirmed"] = rms(shot.errors(shot.with_confirmed(truth))[others])
    return found | in_deviations(shot, made, frames)


def in_deviations(shot: Shot, made: Take, frames: IntArray) -> dict[str, float]:
    """RMS of errors divided by their deviations, in the windows of corrections."""
    assert shot.result.std is not None
    distance = np.abs(shot.truth.time[:, None] - shot.truth.time[frames]).min(axis=1)
    r = distance / (WIDTH / 2.0)
    near = (r > 0.0) & (r < 1.0)
    w = (1.0 - 3.0 * r**2 + 2.0 * r**3)[near, None]
    std, after = shot.result.std[near], shot.errors(made)[near]
    return {
        "± before": rms(shot.errors(shot.result)[near] / std),
        "± own": rms(after / std),
        "± shrunk": rms(after / (std * np.sqrt(1.0 - w**2))),
    }


def main() -> None:
    """Measure, and write the table."""
    argparse.ArgumentParser(description=__doc__).parse_args()
    logging.getLogger("facert").setLevel(logging.ERROR)
    lines, columns = [], []
    with threadpool_limits(1):
        for problem in PROBLEMS:
            shot = make_shot(*problem)
            for count in COUNTS:
                found = measure(shot, count)
                columns = list(found)
                name, taught, target, noise = problem
                head = [f"{name} after {taught}", target, f"{noise:g}", str(count)]
                lines.append(head + [f"{value:.4f}" for value in found.values()])
                print(lines[-1], flush=True)
    heading = "# A shot of which some frames are corrected: RMS over all other frames"
    about = str(__doc__).split("\n\n", 2)[2]
    table = markdown(["shot", "target", "noise, cm", "corrected", *columns], lines, texts=2)
    write_text(RESULTS / "correcting_shots.md", [heading, about, table])


if __name__ == "__main__":
    main()

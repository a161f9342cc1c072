"""A label added to a trained shared model: training that begins at it, against training anew.

    python -m experiments.another_label [--labels 10 20 40] [--repeats 4] [TRACK ...]

Each draw poses so many frames of a track. The model before knows all labels but one; from it a
second training goes on with all of them, as `train(take, start=before)` does, with its wider
tolerance and to the end with that of the first. RMS is over frames whose pose none of them saw,
and is given relative to training anew. Frames are taken as they are.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace

import numpy as np
from threadpoolctl import threadpool_limits

import facert
from experiments.grid import RESULTS
from experiments.report import markdown, write_text
from experiments.tracks import draw, read_track
from facert import Settings, Take
from facert.data.arrays import FloatArray, rms
from facert.methods.shared_gplvm import SOONER
from facert.retarget.options import AS_IT_IS
from facert.retarget.retargeter import Retargeter

SETTINGS = Settings(method="ssgplvm", unlabelled=100, detect=False, smooth=False)
TRACKS = ("rom", "utterance_a", "utterance_b")
COLUMNS = (
    "before, RMS",
    "begun, RMS",
    "begun, to the end, RMS",
    "anew, iterations",
    "begun, iterations",
    "begun, to the end, iterations",
    "anew, s",
    "begun, s",
)


def without_last(take: Take) -> Take:
    """The take before its last label was added."""
    assert take.params is not None
    params = take.params.copy()
    params[take.labels[-1]] = np.nan
    return replace(take, params=params)


def measured(truth: Take, labels: int, seed: int) -> FloatArray:
    """One draw, in the order of `COLUMNS`."""
    take, test = draw(truth, labels, 100, seed)
    assert truth.params is not None
    known = truth.params[test]

    def error(model: Retargeter) -> float:
        predicted = model.retarget(take, options=AS_IT_IS).params
        assert predicted is not None
        return rms(predicted[test] - known)

    def timed(settings: Settings | None, start: Retargeter | None) -> tuple[Retargeter, float]:
        began = time.process_time()
        model = facert.train(take, settings, start=start)
        return model, time.process_time() - began

    settings = replace(SETTINGS, seed=seed)
    before = facert.train(without_last(take), settings)
    anew, slow = timed(settings, None)
    begun, quick = timed(None, before)
    patient = replace(before.settings, tolerance=SETTINGS.tolerance / SOONER)
    finished, _ = timed(patient, before)
    reference = error(anew)
    ratios = [error(model) / reference for model in (before, begun, finished)]
    steps = [float(model.figures["iterations"]) for model in (anew, begun, finished)]
    return np.array([*ratios, *steps, slow, quick])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("tracks", nargs="*", default=TRACKS)
    parser.add_argument("--labels", type=int, nargs="+", default=[10, 20, 40])
    parser.add_argument("--repeats", type=int, default=4)
    given = parser.parse_args()
    rows = []
    with threadpool_limits(1):
        for track in given.tracks:
            truth = read_track(track, "arkit")
            for labels in given.labels:
                draws = np.array([measured(truth, labels, s) for s in range(given.repeats)])
                rows.append([track, str(labels), *(f"{v:.3g}" for v in draws.mean(axis=0))])
                print(*rows[-1], sep="  ", flush=True)
    table = markdown(["track", "labels", *COLUMNS], rows, texts=1)
    note = (
        f"Mean of {given.repeats} draws, target arkit. RMS relative to training anew; seconds of "
        "CPU hold the whole of `train`."
    )
    write_text(RESULTS / "another_label.md", ["# Another label", note, table])


if __name__ == "__main__":
    main()

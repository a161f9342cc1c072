import json
from dataclasses import asdict, replace

import numpy as np
import pytest

from facert.data.rig import Rig
from facert.data.summary import Gap, summarise
from facert.data.take import Controls, Source, Take


def make_take():
    values = np.random.default_rng(0).normal(size=(10, 3, 3))
    values[:, 1] = 1.0
    values[2:4, 2] = np.nan
    params = np.full((10, 2), np.nan)
    params[[3, 7]] = [[0.1, 0.5], [0.3, 0.5]]
    return Take(
        time=np.delete(np.arange(11), 5) / 60,
        source=Source(values, ["a", "still", "b"]),
        controls=Controls(["c", "constant"], [[0, 1], [-1, 1]]),
        params=params,
        fps=60.0,
    )


def test_a_take_is_summed_up():
    summary = summarise(make_take())
    assert (summary.kind, summary.frames, summary.time_gaps) == ("take", 10, 1)
    assert summary.seconds == pytest.approx(10 / 60)
    assert (summary.source.active, summary.source.constant) == (2, ("still",))
    assert summary.source.missing == pytest.approx(2 / 30)
    assert summary.source.worst == (Gap("b", pytest.approx(0.2)),)
    assert (summary.target.labels, summary.target.first_labels) == (2, (3, 7))
    assert (summary.target.active, summary.target.constant) == (1, ("constant",))
    assert summary.target.limits == ((0.0, 1.0), (-1.0, 1.0))
    assert not summary.target.deviations


def test_a_take_without_poses_or_with_animation_only():
    take = make_take()
    assert summarise(replace(take, params=None, controls=None)).target is None
    animation = summarise(replace(take, params=None, animation=[[0.0, 1.0], [0.0, 2.0]])).target
    assert (animation.labels, animation.animation, animation.constant) == (0, 2, ("c",))
    assert summarise(replace(take, params=None)).target.active == 0


def test_a_channel_that_was_never_observed_is_constant():
    source = Source([[0.0, np.nan], [1.0, np.nan]], ["seen", "lost"])
    summary = summarise(Take(time=[0.0, 1.0], source=source)).source
    assert summary.constant == ("lost",)
    assert summary.worst == (Gap("lost", 1.0),)


def test_one_frame_is_a_take_too():
    summary = summarise(Take(time=[2.0], source=Source([[1.0]], ["a"])))
    assert (summary.seconds, summary.time_gaps, summary.source.active) == (0.0, 0, 0)


def test_a_rig_is_summed_up():
    shapes = np.zeros((2, 3, 3))
    shapes[0, 1] = [3.0, 4.0, 0.0]
    rig = Rig(np.diag([1.0, 2.0, 4.0]), shapes, ("moves", "rests"), [[0, 1, 2]], "cm")
    summary = summarise(rig)
    assert (summary.vertices, summary.triangles, summary.units) == (3, 1, "cm")
    assert summary.extents == (1.0, 2.0, 4.0)
    assert summary.largest_displacement == 5.0
    assert summary.still == ("rests",)


def test_a_summary_is_valid_json():
    facts = asdict(summarise(make_take()))
    assert json.loads(json.dumps(facts, allow_nan=False))["source"]["worst"][0]["name"] == "b"


def test_markers_at_the_origin_are_counted():
    take = make_take()
    assert summarise(take).source.zeros is None
    values = take.source.values.copy()
    values[:2, 0] = values[5, 2] = 0.0
    values[6, 2, 0] = 0.0
    marked = replace(take, source=Source(values, take.source.names))
    assert summarise(marked).source.zeros == 3

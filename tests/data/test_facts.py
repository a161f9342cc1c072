import json
from dataclasses import replace

import numpy as np
import pytest

from facert.data.facts import facts_of
from facert.data.rig import Rig
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
    facts = facts_of(make_take())
    assert (facts["kind"], facts["frames"], facts["time_gaps"]) == ("take", 10, 1)
    assert facts["seconds"] == pytest.approx(10 / 60)
    source, target = facts["source"], facts["target"]
    assert (source["active"], source["constant"]) == (2, ("still",))
    assert source["missing"] == pytest.approx(2 / 30)
    assert source["worst"] == ({"name": "b", "missing": pytest.approx(0.2)},)
    assert (target["labels"], target["first_labels"]) == (2, (3, 7))
    assert (target["active"], target["constant"]) == (1, ("constant",))
    assert target["limits"] == ((0.0, 1.0), (-1.0, 1.0))
    assert not target["deviations"]


def test_a_take_without_poses_or_with_animation_only():
    take = make_take()
    assert facts_of(replace(take, params=None, controls=None))["target"] is None
    target = facts_of(replace(take, params=None, animation=[[0.0, 1.0], [0.0, 2.0]]))["target"]
    assert (target["labels"], target["animation"], target["constant"]) == (0, 2, ("c",))
    assert facts_of(replace(take, params=None))["target"]["active"] == 0


def test_a_channel_that_was_never_observed_is_constant():
    source = Source([[0.0, np.nan], [1.0, np.nan]], ["seen", "lost"])
    facts = facts_of(Take(time=[0.0, 1.0], source=source))["source"]
    assert facts["constant"] == ("lost",)
    assert facts["worst"] == ({"name": "lost", "missing": 1.0},)


def test_one_frame_is_a_take_too():
    facts = facts_of(Take(time=[2.0], source=Source([[1.0]], ["a"])))
    assert (facts["seconds"], facts["time_gaps"], facts["source"]["active"]) == (0.0, 0, 0)


def test_a_rig_is_summed_up():
    shapes = np.zeros((2, 3, 3))
    shapes[0, 1] = [3.0, 4.0, 0.0]
    rig = Rig(np.diag([1.0, 2.0, 4.0]), shapes, ("moves", "rests"), [[0, 1, 2]], "cm")
    facts = facts_of(rig)
    assert (facts["vertices"], facts["triangles"], facts["units"]) == (3, 1, "cm")
    assert facts["extents"] == (1.0, 2.0, 4.0)
    assert facts["largest_displacement"] == 5.0
    assert facts["still"] == ("rests",)


def test_the_facts_are_valid_json():
    facts = facts_of(make_take())
    assert json.loads(json.dumps(facts, allow_nan=False))["source"]["worst"][0]["name"] == "b"


def test_markers_at_the_origin_are_counted():
    take = make_take()
    assert facts_of(take)["source"]["zeros"] is None
    values = take.source.values.copy()
    values[:2, 0] = values[5, 2] = 0.0
    values[6, 2, 0] = 0.0
    marked = replace(take, source=Source(values, take.source.names))
    assert facts_of(marked)["source"]["zeros"] == 3


def test_frames_of_weights_that_are_all_zero_are_counted():
    weights = np.random.default_rng(0).random((10, 4))
    weights[:, 1] = 0.0
    take = Take(np.arange(10) / 30.0, Source(weights, "abcd"))
    assert facts_of(take)["source"]["zero_rows"] is None
    weights[2:5] = 0.0
    weights[7] = [0.0, 0.0, 0.0, np.nan]
    found = facts_of(replace(take, source=Source(weights, "abcd")))["source"]
    assert (found["zero_rows"], found["zeros"]) == (3, None)

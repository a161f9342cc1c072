"""Training on several takes: what is learned from which, and that another one never hurts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import facert
from facert.data.corrections import put_in
from facert.data.take import Corrections, Source, Take
from facert.data.takes import Takes
from facert.errors import InputError
from facert.settings import Settings

PLAIN = Settings(method="nearest", smooth=False, detect=False)


@pytest.fixture(name="truth", scope="module")
def _truth(make_take) -> Take:
    """A pose in every frame."""
    return make_take(frames=80, posed=80, animation=0)


def part(truth: Take, frames: slice, every: int) -> Take:
    """Some frames, of which every so manieth is posed."""
    params = truth.params[frames].copy()
    params[np.arange(len(params)) % every > 0] = np.nan
    return replace(
        truth,
        time=truth.time[frames],
        source=truth.source.with_matrix(truth.source.matrix[frames]),
        params=params,
    )


@pytest.fixture(name="takes", scope="module")
def _takes(truth) -> list[Take]:
    return [part(truth, slice(0, 40), 4), part(truth, slice(40, 80), 8)]


def error(model, truth: Take) -> float:
    return float(np.sqrt(np.mean((model.retarget(truth).params - truth.params) ** 2)))


def test_a_list_of_one_take_is_that_take(takes) -> None:
    one, other = (facert.train(given, PLAIN) for given in (takes[0], [takes[0]]))
    assert one.figures.keys() == other.figures.keys()
    for name, array in one.method.save().items():
        np.testing.assert_array_equal(array, other.method.save()[name])


def test_labels_of_all_takes_are_learned_from(takes, truth) -> None:
    both = facert.train(takes, PLAIN)
    assert both.labels == 15
    assert both.figures["takes"] == "take 1 (10 poses), take 2 (5 poses)"
    alone = [error(facert.train(take, PLAIN), truth) for take in takes]
    assert error(both, truth) < min(alone)


def test_a_take_without_a_pose_changes_no_prediction(takes, truth) -> None:
    bare = replace(takes[1], params=None)
    for method in ("gpr", "ssgpr"):
        settings = replace(PLAIN, method=method)
        one = facert.train(takes[0], settings).retarget(truth).params
        np.testing.assert_array_equal(
            facert.train([takes[0], bare], settings).retarget(truth).params, one
        )


def test_old_animation_is_learned_from_as_poses_without_a_frame(takes, truth) -> None:
    names = [name.upper() for name in truth.controls.names]
    old = Take(truth.time, Source(truth.params, names))
    model = facert.train(takes[0], replace(PLAIN, method="ssgpr"), animation=[old])
    assert model.figures["unlabelled poses"] == 80
    np.testing.assert_allclose(model.bounds[:, 1], truth.params.max(axis=0))


@pytest.fixture(name="result", scope="module")
def _result(takes) -> Take:
    model = facert.train(takes[0], replace(PLAIN, method="gpr"))
    return model.retarget(replace(takes[1], params=None))


def test_of_a_result_its_corrections_alone_are_learned_from(takes, truth, result, caplog) -> None:
    poses = truth.params[[45, 50, 60]]
    corrected = put_in(result, Corrections(np.array([5, 10, 20]), poses, 0.5))
    again = facert.train([takes[0], corrected], PLAIN, corrections_only=True)
    assert again.labels == 13
    np.testing.assert_array_equal(again.poses[-3:], poses)
    assert "take 2: 37 poses predicted by a model, and not learned from" in caplog.text
    assert facert.train(corrected, PLAIN).labels == 3
    assert facert.train([takes[0], result], PLAIN).labels == 10
    with pytest.raises(InputError, match="a model predicted all 80 of them"):
        facert.train([result, result], PLAIN)


def test_twice_as_many_frames_as_predicted_keep_corrections_in_their_place(
    takes, truth, result, caplog
) -> None:
    caplog.set_level("INFO")
    values = result.source.values.copy()
    values[30:, :4] = np.nan  # these show too little
    hidden = replace(result, source=replace(result.source, values=values))
    corrected = put_in(hidden, Corrections([5], truth.params[[45]], 0.5))
    model = facert.train([takes[0], corrected], PLAIN)
    others = model.poses[-2:]
    places = [int(np.abs(result.params - pose).sum(axis=1).argmin()) for pose in others]
    assert len(set(places)) == 2
    assert 5 + 0.25 * 30 < min(places) < max(places) < 30
    assert "take 2: but 2 of them, so that 1 correction does not stand for" in caplog.text
    assert "--corrections-only" in caplog.text


def test_confirmed_frames_count_among_those_as_predicted(takes, truth, result) -> None:
    poses = np.vstack([truth.params[45], result.params[30]])
    corrected = put_in(result, Corrections([5, 30], poses, 0.5))
    assert facert.train([takes[0], corrected], PLAIN).labels == 13
    confirmed = put_in(result, Corrections([30], result.params[[30]], 0.5))
    assert facert.train([takes[0], confirmed], PLAIN).labels == 11


def test_a_pose_of_the_recording_counts_and_not_what_was_predicted(takes, truth, result) -> None:
    corrected = put_in(result, Corrections([5], truth.params[[45]], 0.1))
    recording = replace(result, std=None, corrections=None, model="", params=truth.params[40:])
    model = facert.train([takes[0], recording, corrected], PLAIN)
    assert model.labels == 10 + 40


def test_a_slip_among_labels_is_named_with_its_file(takes, caplog) -> None:
    params = takes[1].params.copy()
    params[8, 1] = 400.0
    named = Takes((takes[0], replace(takes[1], params=params)), ("a.h5", "b.h5"))
    facert.train(named, PLAIN)
    assert "the pose of frame b.h5:8 has smile at 400" in caplog.text


def test_a_posed_frame_that_shows_too_little_is_named_with_its_file(takes, caplog) -> None:
    values = takes[1].source.values.copy()
    values[8, :4] = np.nan
    hidden = replace(takes[1], source=Source(values, takes[1].source.names))
    facert.train(Takes((replace(takes[0], params=None), hidden), ("a.h5", "b.h5")), PLAIN)
    assert "left out (b.h5:8)" in caplog.text
    caplog.clear()
    facert.train(Takes((takes[0], hidden), ("a.h5", "b.h5")), PLAIN)
    assert "1 posed frames show less than half of the source: left out (b.h5:8)" in caplog.text


def test_a_shared_model_starts_from_one_of_fewer_takes(takes, caplog) -> None:
    settings = Settings(method="ssgplvm", smooth=False, detect=False, latent_dim=2, unlabelled=10)
    first = facert.train(takes[0], replace(settings, max_iterations=3))
    both = facert.train(takes, start=first)
    assert both.labels == 15
    assert "begins anew" not in caplog.text


def test_regions_are_found_over_all_takes(takes) -> None:
    model = facert.train(takes, replace(PLAIN, regions="auto"))
    assert model.labels == 15


def test_a_recording_given_twice_has_one_pose_a_frame(takes, caplog) -> None:
    """Else its poses would count double, or a frame have two: those of the last take count."""
    once, twice = (facert.train(given, PLAIN) for given in (takes[0], [takes[0], takes[0]]))
    assert "same recording: of 10 frames posed in both" in caplog.text
    assert twice.labels == once.labels == 10
    changed = replace(takes[0], params=takes[0].params + 1.0)
    found = facert.train([takes[0], changed], PLAIN)
    np.testing.assert_array_equal(found.poses, once.poses + 1.0)

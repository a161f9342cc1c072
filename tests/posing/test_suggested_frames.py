"""Which frames are suggested: invariances, and what is never suggested."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

import facert
from facert.data.take import Source, Take
from facert.errors import InputError
from facert.posing import suggested_frames as frames_module
from facert.posing.suggested_frames import APART, suggest_frames

COUNT = 6


@pytest.fixture(name="take")
def _take(make_take) -> Take:
    return make_take(frames=200, posed=20)


def frames(take: Take, *arguments, **options) -> list[int]:
    return suggest_frames(take, *arguments, **options).frames.tolist()


def with_markers(take: Take, values: np.ndarray) -> Take:
    return replace(take, source=Source(values, take.source.names))


def test_units_place_and_names_do_not_matter(take: Take) -> None:
    order = [3, 0, 4, 1, 2]
    values = 25.4 * take.source.values[:, order] + [1.0, -200.0, 30.0]
    other = replace(take, source=Source(values, [take.source.names[k] for k in order]), units="mm")
    assert frames(other, COUNT) == frames(take, COUNT)


def test_the_direction_of_time_does_not_matter(take: Take) -> None:
    backwards = replace(
        take,
        time=take.time[-1] - take.time[::-1],
        source=take.source.with_matrix(take.source.matrix[::-1]),
        params=None,
    )
    assert frames(backwards, COUNT) == [199 - frame for frame in frames(take, COUNT)]


def test_poses_are_not_looked_at(take: Take) -> None:
    assert frames(replace(take, params=None, animation=None), COUNT) == frames(take, COUNT)


def test_suggested_frames_are_different_and_apart_in_time(take: Take) -> None:
    times = take.time[np.sort(frames(take, 8))]
    assert np.diff(times).min() >= APART - 1e-9


def test_posed_frames_and_their_neighbours_are_not_suggested_again(take: Take) -> None:
    first = frames(take, COUNT)
    more = frames(take, 2, have=first)
    assert np.abs(take.time[more][:, None] - take.time[first]).min() >= APART - 1e-9
    assert frames(take, COUNT, have=take.labels) != first


def test_a_short_take_can_be_posed_throughout(make_take) -> None:
    take = make_take(frames=12, posed=0)
    assert sorted(frames(take, 12)) == list(range(12))


def test_frames_that_hide_most_are_not_suggested(take: Take) -> None:
    values = take.source.values.copy()
    chosen = frames(take, COUNT)
    values[chosen, :3] = np.nan
    again = frames(with_markers(take, values), COUNT)
    assert not set(again) & set(chosen)


def test_among_frames_that_serve_as_well_complete_ones_are_suggested(take: Take) -> None:
    values = take.source.values.copy()
    values[1::2, 0] = np.nan
    doubled = with_markers(take, values)
    hidden = np.isnan(doubled.source.values[frames(doubled, COUNT), 0]).any(axis=1)
    assert hidden.mean() < 0.4


def test_a_marker_that_is_never_seen_changes_nothing(take: Take) -> None:
    values = np.concatenate([take.source.values, np.full((200, 1, 3), np.nan)], axis=1)
    other = replace(take, source=Source(values, (*take.source.names, "lost")))
    assert frames(other, COUNT) == frames(take, COUNT)


def test_frames_that_are_held_still_are_preferred() -> None:
    poses = np.random.default_rng(0).normal(size=(8, 12))
    moves = [a + s * (b - a) for a, b in pairwise(poses)
             for s in (*np.zeros(10), *np.linspace(0, 1, 5)[1:-1])]  # fmt: skip
    held = [*moves, *np.tile(poses[-1], (10, 1))]
    values = np.array(held).reshape(len(held), 4, 3)
    take = Take(np.arange(len(held)) / 30, Source(values, tuple("abcd")))
    chosen = np.array(frames(take, 8))
    speed = np.linalg.norm(np.gradient(values.reshape(len(held), -1), axis=0), axis=1)
    assert (speed[chosen] == 0).all()


def test_shares_are_of_the_frames_that_each_stands_for(take: Take) -> None:
    assert suggest_frames(take, COUNT).shares.sum() == pytest.approx(1.0)
    assert suggest_frames(take, COUNT, have=[0, 100]).shares.sum() < 1.0


def test_a_long_take_is_looked_at_in_part_by_the_seed(take: Take, monkeypatch) -> None:
    monkeypatch.setattr(frames_module, "MOST_FRAMES", 60)
    assert frames(take, COUNT, seed=3) == frames(take, COUNT, seed=3)
    assert frames(take, COUNT, seed=3) != frames(take, COUNT, seed=4)


def test_suggested_frames_come_nearer_to_all_than_random_ones(take: Take) -> None:
    def distance(chosen) -> float:
        away = take.source.matrix[:, None] - take.source.matrix[list(chosen)]
        return float(np.linalg.norm(away, axis=2).min(axis=1).mean())

    rng = np.random.default_rng(0)
    at_random = [distance(rng.permutation(200)[:COUNT]) for _ in range(20)]
    assert distance(frames(take, COUNT)) < 0.8 * np.mean(at_random)


def test_a_model_is_asked_where_it_is_uncertain(take: Take) -> None:
    early = np.where(np.arange(200)[:, None] < 60, take.params, np.nan)
    known = replace(take, params=early)
    model = facert.train(known, facert.Settings(method="ssgpr"))
    std = model.retarget(known).std.mean(axis=1)
    chosen = frames(known, COUNT, have=model)
    assert not set(chosen) & set(known.labels.tolist())
    assert std[chosen].mean() > std.mean()


def test_what_a_model_learned_from_is_not_suggested_again_though_the_take_lacks_its_labels(
    take: Take, tmp_path
) -> None:
    """The recording goes on as it came from the camera; the labels are in another file."""
    model = facert.train(take, facert.Settings(method="gpr"))
    model.save(tmp_path / "model.safetensors")
    bare = replace(take, params=None, controls=None, animation=None)
    chosen = frames(bare, COUNT, have=facert.load(tmp_path / "model.safetensors"))
    assert not set(chosen) & set(take.labels.tolist())
    np.testing.assert_array_equal(chosen, frames(bare, COUNT, have=model))


def test_a_model_must_predict_how_certain_it_is(take: Take) -> None:
    model = facert.train(take, facert.Settings(method="ridge"))
    with pytest.raises(InputError, match="found ridge"):
        suggest_frames(take, COUNT, have=model)


@pytest.mark.parametrize("count", [0, 201])
def test_an_impossible_number_is_refused(take: Take, count: int) -> None:
    with pytest.raises(InputError, match=f"found {count} of 200"):
        suggest_frames(take, count)


@pytest.mark.parametrize("have", [[3, 200], [-1], [2.5], "labels"])
def test_a_posed_frame_must_be_one_of_the_take(take: Take, have) -> None:
    with pytest.raises(InputError, match="frames from 0 to 199"):
        suggest_frames(take, COUNT, have=have)


def test_where_every_frame_is_near_a_posed_one_there_is_still_a_suggestion(make_take) -> None:
    take = make_take(frames=12, posed=0)
    assert sorted(frames(take, 6, have=range(0, 12, 2))) == list(range(1, 12, 2))
    close = replace(take, time=np.cumsum([0.0, *np.tile([0.01, 5.0], 6)])[:12])
    assert frames(close, 1, have=range(0, 12, 2))[0] % 2 == 1


@pytest.mark.real
def test_suggested_frames_of_a_real_take_teach_more_than_random_ones(real_data) -> None:
    track = facert.read_take(real_data / "tracks" / "optical_cheeks.npz", target="solved")

    def error(labels) -> float:
        known = np.isin(np.arange(len(track)), labels)[:, None]
        given = replace(track, params=np.where(known, track.params, np.nan))
        settings = facert.Settings(method="ssgpr", unlabelled=100)
        found = facert.train(given, settings).retarget(track)
        return float(np.sqrt(np.mean((found.params - track.params) ** 2)))

    rng = np.random.default_rng(0)
    at_random = [error(rng.permutation(len(track))[:10]) for _ in range(6)]
    assert error(frames(track, 10)) < 0.8 * np.mean(at_random)

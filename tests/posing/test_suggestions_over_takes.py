"""Suggestions over several takes: one coverage of all, every frame with its take."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import facert
from facert.data.take import Take
from facert.errors import InputError
from facert.posing.suggested_frames import APART, suggest_frames
from facert.settings import Settings


@pytest.fixture(name="take")
def _take(make_take) -> Take:
    return make_take(frames=160, posed=10)


def part(take: Take, frames: slice) -> Take:
    return replace(
        take,
        time=take.time[frames],
        source=take.source.with_matrix(take.source.matrix[frames]),
        params=take.params[frames],
    )


@pytest.fixture(name="takes")
def _takes(take: Take) -> list[Take]:
    return [part(take, slice(0, 100)), part(take, slice(100, 160))]


def test_a_list_of_one_take_is_that_take(take: Take) -> None:
    one, other = suggest_frames(take, 5), suggest_frames([take], 5)
    np.testing.assert_array_equal(one.frames, other.frames)
    assert one.takes.tolist() == [0] * 5


def test_all_takes_are_covered_together(takes: list[Take]) -> None:
    found = suggest_frames(takes, 6)
    assert set(found.takes.tolist()) == {0, 1}
    for place, own in enumerate(takes):
        frames = found.frames[found.takes == place]
        assert frames.max() < len(own)
        assert np.diff(np.sort(own.time[frames])).min(initial=1.0) >= APART - 1e-9
    assert found.shares.sum() == pytest.approx(1.0)


def test_a_take_that_shows_the_same_needs_no_frame_of_its_own(take: Take) -> None:
    """What is posed in one take is as near to the same frame in the other."""
    posed = suggest_frames(take, 5).frames
    again = suggest_frames([take, take], 4, have=[posed, []])
    alone = suggest_frames(take, 4, have=posed)
    assert not set(zip(again.takes.tolist(), again.frames.tolist(), strict=True)) & {
        (place, frame) for place in (0, 1) for frame in posed.tolist()
    }
    assert set(again.frames.tolist()) == set(alone.frames.tolist())


def test_posed_frames_are_given_for_each_take(takes: list[Take]) -> None:
    with pytest.raises(InputError, match="a list for each take"):
        suggest_frames(takes, 3, have=[1, 2])
    with pytest.raises(InputError, match="have: expected frames from 0 to 59"):
        suggest_frames(takes, 3, have=[[1], [60]])


def test_a_model_goes_on_with_a_second_take(takes: list[Take]) -> None:
    model = facert.train(takes[0], Settings(method="gpr", smooth=False, detect=False))
    found = suggest_frames([takes[0], replace(takes[1], params=None)], 4, have=model)
    known = takes[0].labels.tolist()
    assert not set(found.frames[found.takes == 0].tolist()) & set(known)

"""Evaluation on several takes: draws over all, blocks of each, a journal of all."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from facert.errors import InputError
from facert.evaluation.protocol import Protocol, draw, make_problem, pools
from facert.evaluation.run import fingerprint


@pytest.fixture(name="takes")
def _takes(make_take):
    return [make_take(frames=frames, posed=frames, animation=0) for frames in (100, 50)]


def test_labels_are_drawn_from_all_takes_and_all_others_tested(takes):
    problem = make_problem(takes, Protocol())
    chosen = draw(problem, 20, 20, 0)
    assert (chosen.labelled < 100).any()
    assert (chosen.labelled >= 100).any()
    assert len(chosen.test) == 150 - 20 - 20 - 20


def test_blocks_are_tenths_of_each_take(takes):
    trained, tested = pools(make_problem(takes, Protocol(split="block")), 0)
    for first, length in ((0, 100), (100, 50)):
        own = trained[(trained >= first) & (trained < first + length)] - first
        assert set((own * 10 // length).tolist()) == {0, 2, 4, 6, 8}
    assert not set(trained.tolist()) & set(tested.tolist())


def test_frames_at_a_border_do_not_follow_each_other(takes):
    problem = make_problem(takes, Protocol())
    frames = problem.in_time(np.array([98, 99, 100, 101]))
    assert np.diff(frames).tolist() == [1, 2, 1]
    alone = make_problem(takes[0], Protocol())
    assert alone.in_time(np.array([98, 99])).tolist() == [98, 99]


def test_a_journal_is_of_all_takes_and_where_they_begin(takes):
    one = fingerprint(make_problem(takes, Protocol()))
    assert one == fingerprint(make_problem(takes, Protocol()))
    first, second = takes
    other = replace(second, params=second.params + 0.01)
    assert fingerprint(make_problem([first, other], Protocol())) != one
    assert fingerprint(make_problem(make_problem(takes, Protocol()).take, Protocol())) != one


def test_one_of_the_takes_may_have_no_pose_and_none_predicted_ones(takes):
    first, second = takes
    bare = make_problem([first, replace(second, params=None)], Protocol())
    assert len(draw(bare, 10, 10, 0).labelled) == 10
    predicted = replace(second, std=np.ones_like(second.params))
    with pytest.raises(InputError, match="take 2: /target/std: expected true poses"):
        make_problem([first, predicted], Protocol())


def test_a_recording_that_is_given_twice_is_refused(takes):
    """Its frames would be learned from and tested on."""
    with pytest.raises(InputError, match="take 1 and take 3 with the very same frames"):
        make_problem([*takes, takes[0]], Protocol())

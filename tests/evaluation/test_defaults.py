"""Numbers of labels that suit a take, however few of its frames are posed."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from facert.errors import InputError
from facert.evaluation.cells import Cell, evaluate
from facert.evaluation.defaults import (
    LABELS,
    UNLABELLED,
    chosen_grid,
    default_labels,
    default_unlabelled,
)
from facert.evaluation.protocol import Protocol, draw, make_problem, training_take
from facert.settings import Settings


def test_a_take_that_is_posed_throughout_gets_the_papers_numbers(make, make_take) -> None:
    problem = make(make_take(frames=300, posed=300, animation=0))
    assert default_unlabelled(problem) == 75
    assert default_labels(problem, 75) == LABELS
    longer = make(make_take(frames=400, posed=400, animation=0))
    assert default_unlabelled(longer) == UNLABELLED


@pytest.mark.parametrize(
    ("posed", "labels"),
    [(4, (3,)), (10, (3, 5, 7)), (20, (5, 10, 15)), (40, (10, 20, 30)), (50, LABELS)],
)
def test_few_posed_frames_are_parted_in_labels_and_tests(make, make_take, posed, labels) -> None:
    problem = make(make_take(frames=150, posed=posed, animation=0))
    assert default_unlabelled(problem) == UNLABELLED
    assert default_labels(problem, UNLABELLED) == labels


@settings(
    max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(
    frames=st.integers(20, 130),
    share=st.floats(0.15, 1.0),
    animation=st.sampled_from([0, 20]),
    split=st.sampled_from(["random", "block"]),
    repeat=st.integers(0, 3),
)
def test_every_draw_with_them_finds_its_frames(
    make_take, frames, share, animation, split, repeat
) -> None:
    take = make_take(frames=frames, posed=int(share * frames), animation=animation)
    problem = make_problem(take, Protocol(split=split))
    unlabelled = default_unlabelled(problem)
    try:
        labels = default_labels(problem, unlabelled)
    except InputError:
        assert len(take.labels) < 40
        return
    for count in labels:
        chosen = draw(problem, count, unlabelled, repeat)
        assert len(chosen.labelled) == count
        assert len(chosen.test)
        assert not set(chosen.test) & (set(chosen.labelled) | set(chosen.unlabelled))


def test_a_sparsely_posed_take_is_learned_from_all_its_frames_and_poses_of_labels_alone(
    make, make_take
) -> None:
    problem = make(make_take(frames=100, posed=12, animation=0))
    chosen = draw(problem, 8, 60, 0)
    assert len(chosen.test) == 4
    assert len(chosen.unlabelled) == 60
    assert not len(chosen.poses)
    take = training_take(problem, chosen, 0)
    assert len(take.labels) == 8
    assert take.animation is None
    outcome = evaluate(problem, Cell("ridge", 8, 60, 0), Settings(method="ridge"))
    assert outcome.scores is not None, outcome.failure
    assert np.isfinite(outcome.scores.rms)


def test_too_few_posed_frames_are_refused_with_what_to_do(make, make_take) -> None:
    problem = make(make_take(frames=50, posed=3, animation=0))
    with pytest.raises(InputError, match=r"4 posed frames .* found 3, .* facert suggest"):
        default_labels(problem, 40)


def test_more_trainings_than_anyone_waits_for_are_refused_before_they_are_listed(
    make, make_take
) -> None:
    problem = make(make_take(frames=60, posed=60, animation=0))
    with pytest.raises(InputError, match="at most 262144 trainings in all, found 3000000000"):
        chosen_grid(problem, ("ridge",), (5, 6, 7), (5,), 10**9)
    assert len(chosen_grid(problem, ("ridge",), (5, 6, 7), (5,), 4)) == 12

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from facert.data.normalisation import Normalisation
from facert.data.rig import Rig
from facert.data.take import Controls, Source
from facert.errors import InputError
from facert.evaluation.protocol import (
    BLOCKS,
    Protocol,
    draw,
    held_out_take,
    make_problem,
    training_take,
    true_poses,
)


def sets(chosen):
    return [set(part) for part in (chosen.labelled, chosen.unlabelled, chosen.poses, chosen.test)]


@settings(
    max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(
    labels=st.integers(3, 20),
    unlabelled=st.integers(0, 15),
    repeat=st.integers(0, 5),
    split=st.sampled_from(["random", "block"]),
)
def test_test_frames_are_never_trained_on(make, labels, unlabelled, repeat, split):
    parts = sets(draw(make(split=split), labels, unlabelled, repeat))
    assert [len(part) for part in parts[:3]] == [labels, unlabelled, unlabelled]
    assert sum(map(len, parts)) == len(set.union(*parts))


def test_all_other_frames_are_tested_by_default(make):
    assert sum(map(len, sets(draw(make(), 10, 20, 0)))) == 120


def test_a_draw_depends_on_seed_repeat_and_numbers_alone(make):
    first, again = (sets(draw(make(seed=3), 10, 20, 1)) for _ in range(2))
    assert first == again
    assert first != sets(draw(make(seed=4), 10, 20, 1))
    assert first != sets(draw(make(seed=3), 10, 20, 2))


def test_draws_of_a_repeat_are_nested(make):
    few, more = (sets(draw(make(), labels, n, 1)) for labels, n in ((5, 8), (9, 20)))
    assert all(small < large for small, large in zip(few[:3], more[:3], strict=True))


def test_blocks_are_kept_apart_and_change_places(make):
    problem = make(split="block")
    for repeat in range(2):
        labelled, unlabelled, poses, test = (
            {frame * BLOCKS // 120 for frame in part} for part in sets(draw(problem, 9, 9, repeat))
        )
        assert not test & (labelled | unlabelled | poses)
        assert test == set(range(1 - repeat, BLOCKS, 2))


def test_an_old_animation_is_the_unlabelled_target(make, make_take):
    problem = make(make_take(frames=60, posed=60, animation=30))
    chosen = draw(problem, 10, 20, 0)
    assert len(chosen.poses) == 20
    assert len(chosen.test) == 60 - 10 - 20
    animation = training_take(problem, chosen, 0).animation
    assert np.array_equal(animation, problem.take.animation[chosen.poses])


def test_frames_without_a_pose_are_unlabelled_first_and_never_tested(make, make_take):
    problem = make(make_take(frames=80, posed=50, animation=0))
    chosen = draw(problem, 10, 30, 0)
    unposed = set(range(80)) - set(problem.take.labels)
    assert set(chosen.unlabelled) == unposed
    assert not set(chosen.test) & unposed


def test_frames_that_show_too_little_are_not_used(make, make_take):
    take = make_take(frames=120, posed=120, animation=0)
    values = take.source.values.copy()
    values[::4, :3] = np.nan
    chosen = draw(make(replace(take, source=Source(values, take.source.names))), 10, 20, 0)
    assert not set.union(*sets(chosen)) & set(range(0, 120, 4))


def test_methods_see_poses_of_labelled_frames_alone(make):
    problem = make()
    chosen = draw(problem, 10, 20, 0)
    take = training_take(problem, chosen, 0)
    assert len(take) == 30
    assert np.array_equal(take.params[take.labels], problem.take.params[chosen.labelled])
    assert np.array_equal(take.time[take.labels], problem.take.time[chosen.labelled])
    assert held_out_take(problem, chosen, 0).params is None


def test_noise_is_a_share_of_the_largest_deviation_on_all_frames(make):
    problem = make(noise=0.1)
    largest = Normalisation.of(problem.take.source.matrix, "/source").scale
    chosen = draw(problem, 10, 20, 0)
    rows = np.union1d(chosen.labelled, chosen.unlabelled)
    for take, frames in (
        (training_take(problem, chosen, 0), rows),
        (held_out_take(problem, chosen, 0), chosen.test),
    ):
        difference = take.source.matrix - problem.take.source.matrix[frames]
        assert difference.std() == pytest.approx(0.1 * largest, rel=0.15)


def test_markers_are_hidden_in_test_frames_alone(make):
    problem = make(missing=0.3)
    chosen = draw(problem, 10, 20, 0)
    assert training_take(problem, chosen, 0).source.valid.all()
    assert 1 - held_out_take(problem, chosen, 0).source.valid.mean() == pytest.approx(0.3, abs=0.08)


def test_a_capped_test_has_consecutive_frames(make):
    chosen = draw(make(test_frames=30), 5, 10, 0)
    everything = draw(make(), 5, 10, 0)
    assert len(chosen.test) == 30
    assert set(chosen.test) < set(everything.test)
    assert np.median(np.diff(chosen.test)) == 1


def test_another_take_is_tested_in_full_with_controls_by_name(make_take):
    take = make_take(frames=60, posed=60, animation=0)
    other = make_take(frames=40, posed=40, animation=0)
    turned = replace(
        other, controls=Controls(other.controls.names[::-1]), params=other.params[:, ::-1]
    )
    problem = make_problem(take, Protocol(), across=turned)
    chosen = draw(problem, 10, 20, 0)
    assert chosen.test.tolist() == list(range(40))
    assert np.array_equal(true_poses(problem, chosen), other.params)
    both = np.vstack([take.params, other.params])
    assert problem.ranges == pytest.approx(both.max(axis=0) - both.min(axis=0))


def test_what_does_not_fit_together_is_refused(make, make_take):
    posed = make_take(frames=60, posed=60, animation=0)
    unposed = replace(posed, params=None)
    with pytest.raises(InputError, match="known poses"):
        make_problem(unposed, Protocol())
    with pytest.raises(InputError, match="take to test on: /target/params: expected known poses"):
        make_problem(posed, Protocol(), across=unposed)
    rig = Rig(np.zeros((3, 3)), np.zeros((1, 3, 3)), ["jaw"], np.array([[0, 1, 2]]))
    with pytest.raises(InputError, match="controls that the rig has a shape for, found 'smile'"):
        make_problem(posed, Protocol(), rig=rig)
    with pytest.raises(InputError, match="fewer labels"):
        draw(make(posed), 20, 30, 0)


@pytest.mark.parametrize(
    "options",
    [{"split": "odd"}, {"noise": -1.0}, {"missing": 1.0}, {"test_frames": 0}, {"seed": -1}],
)
def test_a_protocol_checks_itself(options):
    with pytest.raises(InputError, match=next(iter(options))):
        Protocol(**options)


def test_one_pose_is_left_for_the_test(make, make_take):
    problem = make(make_take(frames=120, posed=15, animation=0))
    assert len(draw(problem, 14, 100, 0).test) == 1
    with pytest.raises(InputError, match="at most 14 labels: one pose is needed for the test"):
        draw(problem, 15, 100, 0)

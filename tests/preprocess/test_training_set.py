from dataclasses import replace

import numpy as np
import pytest

from facert.errors import InputError
from facert.preprocess.training_set import FILL_FRAMES, choose_training_set
from facert.settings import Settings


@pytest.fixture
def take(make_take):
    return make_take(frames=60, posed=12, animation=20)


def hide(take, rows, markers):
    """The take with markers not observed in some frames."""
    values = take.source.values.copy()
    values[np.ix_(np.atleast_1d(rows), np.atleast_1d(markers))] = np.nan
    return replace(take, source=replace(take.source, values=values))


def test_every_posed_frame_is_a_label_and_every_other_frame_may_serve_without(take):
    chosen = choose_training_set(take, Settings())
    np.testing.assert_array_equal(chosen.frames, take.labels)
    np.testing.assert_array_equal(chosen.X_labelled, take.source.matrix[take.labels])
    np.testing.assert_array_equal(chosen.Y_labelled, take.params[take.labels])
    assert len(chosen.X_unlabelled) == 60 - 12
    assert len(chosen.Y_unlabelled) == 20


def test_unlabelled_frames_are_none_of_the_labels(take):
    chosen = choose_training_set(take, Settings(unlabelled=30))
    labelled = {row.tobytes() for row in chosen.X_labelled}
    assert not labelled & {row.tobytes() for row in chosen.X_unlabelled}
    assert len(chosen.X_unlabelled) == 30


def test_the_seed_draws_the_labels(take):
    def labels(seed):
        return choose_training_set(take, Settings(labels=5, seed=seed)).frames.tolist()

    assert labels(0) == labels(0)
    assert len({tuple(labels(seed)) for seed in range(5)}) > 1
    assert set(labels(0)) <= set(take.labels.tolist())


def test_poses_that_were_not_drawn_are_not_used(take):
    """Their frames may serve as unlabelled source: that pose is then unknown."""
    chosen = choose_training_set(take, Settings(labels=5))
    assert len(chosen.Y_labelled) == 5
    assert len(chosen.X_unlabelled) == 60 - 5


def test_a_take_without_animation_has_no_unlabelled_poses(take):
    chosen = choose_training_set(replace(take, animation=None), Settings())
    assert chosen.Y_unlabelled.shape == (0, 4)


def test_fewer_than_three_labels_are_refused(make_take, take):
    for few in (make_take(posed=2), make_take(posed=0)):
        with pytest.raises(InputError, match="/target/params: expected at least 3 posed frames"):
            choose_training_set(few, Settings())
    with pytest.raises(InputError, match="at least 3"):
        choose_training_set(take, Settings(labels=2))


def test_more_labels_than_there_are_are_refused(take):
    with pytest.raises(InputError, match=r"labels: expected at most 12.* found 13"):
        choose_training_set(take, Settings(labels=13))


def test_frames_that_show_less_than_half_of_the_source_are_left_out(take, caplog):
    label, other = take.labels[0], np.setdiff1d(np.arange(60), take.labels)[0]
    chosen = choose_training_set(hide(take, [label, other], [0, 1, 2]), Settings())
    np.testing.assert_array_equal(chosen.frames, take.labels[1:])
    assert len(chosen.X_unlabelled) == 60 - 12 - 1
    assert "1 posed frames show less than half" in caplog.text


def test_labels_are_drawn_among_the_frames_that_can_be_used(take):
    chosen = choose_training_set(hide(take, take.labels[:6], [0, 1, 2]), Settings(labels=6))
    np.testing.assert_array_equal(chosen.frames, take.labels[6:])


def test_gaps_are_filled_close_to_the_truth(take):
    gaps = hide(take, take.labels[:4], [1])
    chosen, truth = (choose_training_set(t, Settings()) for t in (gaps, take))
    assert np.isfinite(chosen.X_labelled).all()
    error = np.abs(chosen.X_labelled - truth.X_labelled)
    assert error.max() < 0.2 * take.source.values[:, 1].std()


def test_a_marker_that_was_hardly_ever_seen_is_filled_too(make_take):
    """More frames than gaps are filled from; the marker is seen in one that is seldom drawn."""
    take = make_take(frames=FILL_FRAMES + 400)
    gaps = hide(take, np.arange(len(take) - 1), [2])
    for seed in range(3):
        chosen = choose_training_set(gaps, Settings(seed=seed, unlabelled=20))
        assert np.isfinite(chosen.X_labelled).all()
        assert np.isfinite(chosen.X_unlabelled).all()

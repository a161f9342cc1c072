"""Several takes are cleaned each on its own, and moved to the first by the actor at rest."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from facert.data.matching_takes import as_takes
from facert.data.take import Source, Take
from facert.errors import InputError
from facert.preprocess.motion.estimate import estimate
from facert.preprocess.motion.motion import Motion
from facert.preprocess.neutral import rest_frames
from facert.preprocess.preparation import prepare, training_data
from facert.preprocess.training_set import choose_training_set, serving
from facert.settings import Settings


@pytest.fixture(autouse=True)
def quick(monkeypatch):
    """Few factors suffice for what moves in two dimensions."""
    monkeypatch.setattr("facert.preprocess.motion.motion.FACTORS", 4)


def noisy(take, noise, seed):
    values = take.source.values
    rng = np.random.default_rng(seed)
    spoilt = values + noise * values.std() * rng.normal(size=values.shape)
    return replace(take, source=replace(take.source, values=spoilt))


@pytest.fixture(name="takes")
def _takes(make_take):
    """Two takes of one actor, the second with twice the noise."""
    return [noisy(make_take(frames=f, posed=8), n, f) for f, n in ((60, 0.03), (45, 0.06))]


def test_each_take_is_cleaned_as_if_it_were_alone(takes):
    both = prepare(as_takes(takes), Settings())
    for part, alone in zip(both.takes.parts, takes, strict=True):
        found = prepare(alone, Settings()).take.source.values
        np.testing.assert_array_equal(part.source.values, found)
    assert both.take.source.values.shape[0] == 105


def test_the_noise_of_takes_is_pooled(takes):
    one, other = (estimate(take.source.matrix, take.time).sigma for take in takes)
    found = prepare(as_takes(takes), Settings()).estimate
    assert one < found.sigma < other
    assert found.sigma == pytest.approx(np.sqrt((60 * one**2 + 45 * other**2) / 105))


def jumping(length, seed):
    """A smooth motion around another place in each take."""
    time = np.arange(length) / 30.0
    rng = np.random.default_rng(seed)
    walk = np.stack([np.sin(3.0 * time), np.cos(2.0 * time)], axis=1)
    offset = 5.0 * rng.normal(size=6)
    return walk @ np.random.default_rng(0).normal(size=(2, 6)) + offset


def test_no_stretch_of_the_motion_crosses_from_take_to_take():
    """Joined in time, the jumps at the borders would pass for fast motion."""
    parts = [jumping(50, seed) for seed in range(8)]
    apart = Motion.learned_over(parts, 0.01, [1 / 30] * 8)
    joined = Motion.learned(np.concatenate(parts), 0.01, 1 / 30)
    assert apart.rates.max() < 0.7 * joined.rates.max()


def test_the_motion_of_one_take_is_that_of_a_list_of_it():
    X = jumping(80, 0)
    one, other = Motion.learned(X, 0.01, 0.5), Motion.learned_over([X], 0.01, [0.5])
    for name, array in one.arrays.items():
        np.testing.assert_array_equal(array, other.arrays[name])


def test_the_same_motion_at_another_rate_gives_the_same_rates():
    """Every take counts by its own clock; rates are for the frames of the first."""
    slow = jumping(200, 0)
    both = Motion.learned_over([slow, slow[::2]], 0.01, [1 / 60, 1 / 30])
    alone = Motion.learned(slow, 0.01, 1 / 60)
    np.testing.assert_allclose(both.rates[:2], alone.rates[:2], rtol=0.15)
    assert both.clock[0] == 1 / 60


def test_a_column_that_one_take_lacks_is_learned_from_the_other():
    one, other = jumping(60, 0), jumping(60, 0)
    other = other.copy()
    other[:, 2] = np.nan
    found = Motion.learned_over([one, other], 0.01, [1 / 30] * 2)
    assert all(np.isfinite(array).all() for array in found.arrays.values())


def test_another_day_is_calibrated_to_the_first_by_the_actor_at_rest(takes):
    moved = takes[1].source.values + np.array([0.5, -0.2, 0.1])
    other = replace(takes[1], source=Source(moved, takes[1].source.names))
    plain = Settings(smooth=False, detect=False)
    given = as_takes([takes[0], other], names=("a.h5", "b.h5"))
    at_rest = replace(plain, neutral="b.h5:10; a.h5:10")
    found = training_data(given, at_rest)
    own = found.prepared.takes.parts[1].source.values
    np.testing.assert_allclose(own[10], takes[0].source.values[10])
    np.testing.assert_allclose(np.diff(own, axis=0), np.diff(moved, axis=0), atol=1e-12)
    np.testing.assert_array_equal(found.neutral, takes[0].source.matrix[10])
    unmoved = training_data(given, replace(plain, neutral="10"))
    np.testing.assert_array_equal(unmoved.prepared.takes.parts[1].source.values, moved)


def test_rest_is_named_by_order_or_by_file(takes):
    given = as_takes(takes, names=("day 1/a.h5", "day 2/b.h5"))
    assert [frames.tolist() for frames in rest_frames("3,4; 5..6", given)] == [[3, 4], [5, 6]]
    named = rest_frames("b.h5:0..4:2; day 1/a.h5:1", given)
    assert [frames.tolist() for frames in named] == [[1], [0, 2, 4]]
    assert rest_frames("7", given)[1] is None
    for text, message in (
        ("c.h5:1", "'c.h5'"),
        ("b.h5:1", "day 1/a.h5 as well"),
        ("1; 2; 3", "2 takes"),
        ("1; day 1/a.h5:2", "once"),
    ):
        with pytest.raises(InputError, match=message):
            rest_frames(text, given)


def test_a_take_that_lies_elsewhere_is_warned_of(takes, caplog):
    far = replace(takes[1], source=Source(takes[1].source.values + 20.0, takes[1].source.names))
    prepare(as_takes([takes[0], far], names=("a.h5", "b.h5")), Settings(smooth=False))
    assert "b.h5 lies far from a.h5" in caplog.text


def test_a_take_gives_frames_in_proportion_to_its_labels(make_take):
    """All of the take with most labels, so many a label of the others."""
    takes = as_takes([make_take(frames=f, posed=p) for f, p in ((80, 20), (200, 5), (10, 5))])
    first, second, third = np.split(serving(takes, 0), takes.starts[1:-1])
    assert first.all()
    assert second.sum() == 20
    assert third.all()
    assert serving(as_takes(takes.parts[1]), 0).all()
    chosen = choose_training_set(takes, Settings(unlabelled=None))
    assert len(chosen.X_labelled) == 30
    assert len(chosen.X_unlabelled) <= 60 + 20 + 5


def test_a_take_in_another_unit_that_no_file_states_is_warned_of(make_take, caplog):
    takes = [replace(make_take(frames=f, posed=8), units="") for f in (60, 45)]
    far = [takes[0], replace(takes[1], source=takes[1].source.with_matrix(far_matrix(takes[1])))]
    for given, warned in ((takes, False), (far, True)):
        caplog.clear()
        prepare(as_takes(given), Settings())
        assert ("another unit" in caplog.text) == warned


def far_matrix(take):
    """A few markers far from the origin, as all are, in millimetres."""
    return 10.0 * (take.source.matrix + np.linspace(0.0, 20.0, take.source.matrix.shape[1]))


def test_weights_in_percent_beside_shares_are_named(caplog):
    shares = np.abs(np.sin(np.arange(60)[:, None] / np.array([5.0, 7.0])))
    takes = [
        Take(np.arange(60) / 30.0, Source(scale * shares, ("jaw", "smile")), None)
        for scale in (1.0, 100.0)
    ]
    prepare(as_takes(takes, names=("a.csv", "b.csv")), Settings(smooth=False))
    assert "b.csv lies far from a.csv" in caplog.text
    assert "percent instead of fractions" in caplog.text
    assert "stabilise" not in caplog.text

"""Methods on a source of many columns: the same poses, by its leading directions."""

from dataclasses import replace

import numpy as np
import pytest

import facert
from facert import InputError, Settings, Source
from facert.data.arrays import rms
from facert.data.regions import Regions
from facert.methods.base import Labelled, Unlabelled
from facert.methods.dense import Dense, DenseStepwise
from facert.methods.registry import make_method
from facert.models.leading_directions import DENSE, RANK
from facert.retarget.options import AS_IT_IS

QUICK = {"latent_dim": 3, "neighbours": 5, "max_iterations": 15, "unlabelled": 30}
MARKERS = 130


@pytest.fixture(scope="module")
def truth(make_take):
    """A take of many markers that move alike, with the pose of every frame."""
    few = make_take(frames=60, posed=60)
    mixed = np.random.default_rng(0).dirichlet(np.ones(5), size=MARKERS)
    names = tuple(f"p{index:03d}" for index in range(MARKERS))
    return replace(few, source=Source(np.einsum("mk,tkc->tmc", mixed, few.source.values), names))


@pytest.fixture(scope="module")
def take(truth, pose_few):
    return pose_few(truth, 14)


@pytest.fixture(scope="module")
def trained(take):
    kept = {}

    def train(name):
        if name not in kept:
            kept[name] = facert.train(take, Settings(method=name, **QUICK))
        return kept[name]

    return train


def hidden(take, first=40):
    values = take.source.values.copy()
    values[5:9, :first] = np.nan
    return replace(take, source=replace(take.source, values=values))


@pytest.mark.parametrize("name", ["auto", "nearest"])
def test_methods_learn_from_many_markers(name, trained, take, truth, tmp_path):
    model = trained(name)
    assert isinstance(model.method, Dense)
    assert model.method.dimensions == (3 * MARKERS, 4)
    result = model.retarget(take)
    assert rms(result.params - truth.params) < {"nearest": 0.5, "rbf": 0.35}.get(name, 0.25)
    model.save(tmp_path / "model.safetensors")
    again = facert.load(tmp_path / "model.safetensors")
    gappy = hidden(take)
    for mode in ("offline", "online"):
        here, there = model.retarget(gappy, mode), again.retarget(gappy, mode)
        np.testing.assert_allclose(there.params, here.params, atol=1e-9)
        np.testing.assert_allclose(there.source.values, here.source.values, atol=1e-9)


@pytest.mark.parametrize("name", ["ridge", "gpr", "nearest"])
def test_what_depends_on_distances_alone_is_as_on_all_columns(name, take):
    X, Y = take.source.matrix - take.source.matrix.mean(axis=0), take.params
    labels = take.labels
    labelled = Labelled(X[labels], Y[labels])
    unlabelled = Unlabelled(np.delete(X, labels, axis=0), Y[labels])
    poses = []
    for dense in (False, True):
        method = make_method(Settings(method=name), dense)
        method.fit(labelled, unlabelled)
        poses.append(method.predict(X).Y)
    np.testing.assert_allclose(poses[1], poses[0], atol=1e-4)


def test_hidden_markers_are_filled_and_seen_ones_kept(trained, take):
    gappy = hidden(take)
    found = trained("auto").method.predict(trained("auto").source_units.apply(gappy.source.matrix))
    source = trained("auto").source_units.undo(found.X)
    seen = ~np.isnan(gappy.source.matrix)
    np.testing.assert_allclose(source[seen], gappy.source.matrix[seen], atol=1e-9)
    assert rms((source - take.source.matrix)[~seen]) < 1e-3
    assert found.std[6].mean() >= found.std[30].mean()


def test_methods_are_given_lengths_as_if_fewer_columns_had_shown_them(trained, take):
    model = trained("nearest")
    X = model.source_units.apply(take.source.matrix)
    S, X = model.method.scores(X), X - model.method.directions_.mean
    expected = np.linalg.norm(X, axis=1) * np.sqrt(DENSE / (3 * MARKERS))
    np.testing.assert_allclose(np.linalg.norm(S, axis=1), expected, rtol=1e-3)


def test_what_a_method_makes_of_the_source_reaches_the_frames(trained, take):
    model = trained("ssgplvm")
    noise = 0.1 * np.random.default_rng(0).normal(size=take.source.matrix.shape)
    X = model.source_units.apply(take.source.matrix)
    found = model.method.predict(X + noise).X
    assert rms(found - X) < 0.5 * rms(noise)


def test_one_by_one_as_all_at_once(trained, take):
    gappy = hidden(take)
    for name in ("auto", "nearest"):
        offline = trained(name).retarget(gappy, options=AS_IT_IS)
        online = trained(name).retarget(gappy, "online", options=AS_IT_IS)
        np.testing.assert_allclose(online.params, offline.params, atol=1e-8)
        np.testing.assert_allclose(online.source.values, offline.source.values, atol=1e-8)


def test_a_shared_model_begins_at_a_trained_one(trained, take, truth, pose_few):
    start = trained("ssgplvm")
    assert isinstance(start.method, DenseStepwise)
    more = replace(take, params=np.where(np.arange(60)[:, None] == 31, truth.params, take.params))
    anew = facert.train(more, start.settings, start=start)
    before, after = start.method.directions_.basis, anew.method.directions_.basis
    assert np.array_equal(before, after)
    assert anew.figures["iterations"] <= facert.train(more, start.settings).figures["iterations"]
    assert rms(anew.retarget(take).params - truth.params) < 0.25


def test_the_model_file_is_linear_in_markers(trained, take, tmp_path):
    trained("ridge").save(tmp_path / "small.safetensors")
    twice = replace(
        take,
        source=Source(
            np.concatenate([take.source.values, take.source.values + 1.0], axis=1),
            (*take.source.names, *(f"q{name}" for name in take.source.names)),
        ),
    )
    model = facert.train(twice, Settings(method="ridge", **QUICK))
    model.save(tmp_path / "large.safetensors")
    sizes = [(tmp_path / f"{name}.safetensors").stat().st_size for name in ("small", "large")]
    assert sizes[1] < 2.05 * sizes[0]


def test_regions_that_are_dense_see_their_own_directions(take, truth):
    every = tuple(take.source.names)
    controls = tuple(take.controls.names)
    regions = {
        "one": {"markers": every[:129], "controls": controls[:2]},
        "other": {"markers": every[70:], "controls": controls[2:]},
    }
    settings = Settings(method="gpr", regions=Regions.of(regions), **QUICK)
    model = facert.train(take, settings)
    kinds = [isinstance(part.method, Dense) for part in model.method.parts_]
    assert kinds == [3 * 129 > DENSE, 3 * 60 > DENSE]
    assert rms(model.retarget(take).params - truth.params) < 0.25


@pytest.mark.parametrize(
    "damage",
    [
        {"directions.variances": -np.ones(RANK)},
        {"directions.noise": np.zeros(1)},
        {"directions.basis": np.ones((3 * MARKERS, 3))},
        {"directions.basis": np.ones((7, RANK))},
        {"directions.more": np.ones(3)},
        {"directions.basis": np.ones((3 * MARKERS, RANK + 1))},
    ],
)
def test_a_damaged_file_is_refused(damage, trained):
    model = trained("ridge").method
    again = make_method(model.settings, dense=True)
    with pytest.raises(InputError):
        again.load({**model.save(), **damage})

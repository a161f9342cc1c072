"""Honest takes at the edge: a sound result or one clear error, whatever the method."""

from tempfile import TemporaryDirectory

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

import facert
from facert import Controls, InputError, Settings, Source, Take
from facert.methods.registry import REGISTRY

QUICK = {"latent_dim": 2, "neighbours": 3, "max_iterations": 4, "unlabelled": 12}
SLOW = ("auto", "ssgplvm", "svr")
"""Methods that try many models, drawn less often."""
UNITS = (1e-320, 1e-200, 1e-90, 1e-12, 1e-9, 1.0, 1e6, 1e9, 1e90, 1e160, 1e300)
ENDS = (-np.inf, -1e308, -1.0, 0.0, 0.2, 0.4, 1e308, np.inf)


def still_frames(parts, rows):
    parts["X"][rows] = parts["X"][rows[0]]


def still_names(parts, rows):
    parts["X"][:, rows % parts["X"].shape[1]] = 0.7


def hidden_frames(parts, rows):
    parts["X"][rows] = np.nan


def hidden_names(parts, rows):
    parts["X"][:, rows[:1] % parts["X"].shape[1]] = np.nan


def hidden_but_once(parts, rows):
    name = rows[0] % parts["X"].shape[1]
    seen = parts["X"][rows[-1], name].copy()
    parts["X"][:, name] = np.nan
    parts["X"][rows[-1], name] = seen


def hidden_labels(parts, rows):
    parts["X"][parts["labels"], rows[0] % parts["X"].shape[1]] = np.nan


def one_direction(parts, rows):
    flat = parts["X"].reshape(len(parts["X"]), -1)
    parts["X"] = np.outer(flat[:, 0], flat[rows[0]]).reshape(parts["X"].shape)


def all_names_alike(parts, rows):
    parts["X"][:] = parts["X"][:, :1]


def far_from_the_origin(parts, rows):
    parts["X"] += 10.0 ** len(rows)


def one_name(parts, rows):
    parts["X"] = parts["X"][:, :1]


def few_frames(parts, rows):
    parts["X"], parts["Y"] = parts["X"][: len(rows)], parts["Y"][: len(rows)]
    parts["labels"] = np.arange(len(rows))


def few_labels(parts, rows):
    parts["labels"] = parts["labels"][: len(rows) % 4 + 1]


def same_poses(parts, rows):
    parts["Y"][rows] = parts["Y"][rows[0]]


def still_controls(parts, rows):
    parts["Y"][:, rows % parts["Y"].shape[1]] = 0.5


def poses_of_rank_one(parts, rows):
    parts["Y"] = np.outer(parts["Y"][:, 0], np.arange(1.0, 1.0 + parts["Y"].shape[1]))


def poses_that_hardly_differ(parts, rows):
    parts["Y"] = 0.5 + 10.0 ** -len(rows) * parts["Y"]


def one_control(parts, rows):
    parts["Y"], parts["limits"] = parts["Y"][:, :1], parts["limits"][:1]


def no_animation(parts, rows):
    parts["animation"] = 0


TWISTS = (
    *(still_frames, still_names, hidden_frames, hidden_names, hidden_but_once, hidden_labels),
    *(one_direction, all_names_alike, far_from_the_origin, one_name, few_frames, few_labels),
    *(same_poses, still_controls, poses_of_rank_one, poses_that_hardly_differ, one_control),
    no_animation,
)


@st.composite
def takes(draw):
    """A take of 24 frames, 8 of them posed, with some twists, in some units."""
    rng = np.random.default_rng(draw(st.integers(0, 3)))
    walk = rng.normal(size=(24, 2)).cumsum(axis=0)
    walk = np.stack([*walk.T, walk[:, 0] * walk[:, 1]], axis=1) / np.abs(walk).max()
    shape = draw(st.sampled_from([(24, 3, 3), (24, 4)]))
    parts = {
        "X": (walk @ rng.normal(size=(3, int(np.prod(shape[1:]))))).reshape(shape),
        "Y": walk @ rng.normal(size=(3, 3)),
        "labels": np.arange(0, 24, 3),
        "limits": np.sort(draw(st.lists(st.tuples(*[st.sampled_from(ENDS)] * 2), min_size=3,
                                        max_size=3)), axis=1),
        "animation": 6,
    }  # fmt: skip
    for twist in draw(st.lists(st.sampled_from(TWISTS), max_size=3, unique=True)):
        rows = rng.permutation(len(parts["X"]))
        twist(parts, rows[: draw(st.integers(1, len(rows)))])
    unit = st.just(1.0) | st.sampled_from(UNITS)
    X, Y = draw(unit) * parts["X"], draw(unit) * parts["Y"]
    return lambda: _take(X, Y, parts)


def _take(X, Y, parts):
    posed = np.isin(np.arange(len(X)), parts["labels"])
    return Take(
        np.arange(len(X)) / 30.0,
        Source(X, [f"m{i}" for i in range(X.shape[1])]),
        Controls([f"c{i}" for i in range(Y.shape[1])], parts["limits"]),
        np.where(posed[:, None], Y, np.nan),
        animation=Y[: parts["animation"]] if parts["animation"] else None,
    )


def require_said(message):
    assert ": expected " in message
    assert ", found " in message


def check(make, method):
    """Train, save, load and map: sound poses, the same of both, or an error that says it all."""
    try:
        take = make()
        retargeter = facert.train(take, Settings(method=method, **QUICK))
    except InputError as refused:
        require_said(str(refused))
        return
    with TemporaryDirectory() as folder:
        retargeter.save(f"{folder}/model.safetensors")
        loaded = facert.load(f"{folder}/model.safetensors")
    for mode in ("offline", "online"):
        poses = retargeter.retarget(take, mode)
        assert np.isfinite(poses.params).all()
        assert poses.std is None or np.isfinite(poses.std).all()
        assert not np.isinf(poses.source.values).any()
        np.testing.assert_array_equal(loaded.retarget(take, mode).params, poses.params)


@given(takes(), st.sampled_from([name for name in REGISTRY if name not in SLOW]))
@settings(max_examples=20)
def test_a_take_at_the_edge_gives_sound_poses_or_one_error(make, method):
    check(make, method)


@given(takes(), st.sampled_from(SLOW))
@settings(max_examples=4)
def test_so_do_methods_that_try_many_models(make, method):
    check(make, method)

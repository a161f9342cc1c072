"""Whatever is learned is saved, loads, and gives the same poses to the last bit."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import facert
from facert import InputError, Settings, Take
from facert.data.take import Controls, Source
from facert.errors import NumericalError
from facert.methods.registry import REGISTRY

NAMES = (
    "a" * 4096,
    "Jaw open",
    "jaw open",
    "größe 顔 😀",
    "'\"`[b]$\\frac{$",
    "=1+1",
    "-inf",
    "{}",
)
LIMITS = [[-np.inf, np.inf], [0.0, np.inf], [-np.inf, 1e300], [-1e-300, 5.0]]
QUICK = {"unlabelled": 4, "latent_dim": 2, "neighbours": 3, "max_iterations": 5}
REGIONS = {"": {"markers": [NAMES[0]], "controls": NAMES[4:6]}, "b\n]": {
    "markers": NAMES[:2], "controls": NAMES[5:]}}  # fmt: skip


def odd_take(scale: float, controls: int, markers: int, frames: int = 24) -> Take:
    """Odd names, limits without an end, units far off, a control that never moves."""
    t = np.linspace(0.0, 5.0, frames)
    walk = np.stack([np.sin(t), np.cos(2.0 * t), np.sin(3.0 * t)], axis=1)
    rng = np.random.default_rng(0)
    points = (walk @ rng.normal(size=(3, 3 * markers))).reshape(frames, markers, 3)
    params = 0.5 + 0.4 * np.tanh(walk @ rng.normal(size=(3, controls)))
    if controls > 1:
        params[:, -1] = 0.25
    params[::2] = np.nan
    limits = np.array(LIMITS[:controls])
    return Take(
        time=t,
        source=Source(points * scale, NAMES[:markers]),
        controls=Controls(NAMES[-controls:], limits),
        params=params,
        units="cm",
    )


@pytest.fixture(name="odd", scope="module")
def _odd() -> Take:
    return odd_take(1e12, 4, 4)


@pytest.fixture(name="least", scope="module")
def _least() -> Take:
    return odd_take(1e-12, 1, 1)


def save_and_load(take: Take, path: Path, **settings: object) -> None:
    model = facert.train(take, Settings(**QUICK).with_changes(settings))
    model = replace(model, takes=("\udcff.h5", "a\n.h5"), figures={"a\ud800": np.nan})
    model.save(path)
    loaded = facert.load(path)
    for mode in ("offline", "online"):
        before, after = model.retarget(take, mode), loaded.retarget(take, mode)
        np.testing.assert_array_equal(after.params, before.params)
        np.testing.assert_array_equal(after.source.values, before.source.values)
    np.testing.assert_array_equal(loaded.controls.limits, model.controls.limits)
    assert loaded.controls.names == model.controls.names


@pytest.mark.parametrize("method", REGISTRY)
@pytest.mark.parametrize("limits", ["declared", "auto"])
def test_a_model_of_odd_takes_loads_again(odd, least, tmp_path, method, limits):
    take = odd if limits == "declared" else least
    save_and_load(take, tmp_path / "model.safetensors", method=method, limits=limits)


@pytest.mark.parametrize("method", ["ssgpr", "ssgplvm"])
def test_a_model_with_regions_of_odd_names_loads_again(odd, tmp_path, method):
    path = tmp_path / "model.safetensors"
    save_and_load(odd, path, method=method, limits="declared", regions=REGIONS)


def test_a_model_of_several_takes_loads_again(odd, tmp_path):
    settings = Settings(method="ridge", limits="none")
    facert.train([odd, replace(odd, time=odd.time + 1.0)], settings).save(
        tmp_path / "m.safetensors"
    )
    assert facert.load(tmp_path / "m.safetensors").bounds is None


@pytest.mark.parametrize(
    ("changes", "error", "message"),
    [
        ({"units": "a" * 2**25}, InputError, "the header: .*Check names, units and limits"),
        ({"neutral": np.zeros(3)}, InputError, "source.neutral: expected 15 numbers"),
        ({"poses": np.full((1, 4), np.nan)}, InputError, "target.poses: expected finite"),
    ],
)
def test_what_would_not_load_is_not_saved_and_the_old_file_stays(
    make_take, tmp_path, changes, error, message
):
    path = tmp_path / "model.safetensors"
    model = facert.train(make_take(), Settings(method="ridge"))
    model.save(path)
    before = path.read_bytes()
    with pytest.raises(error, match=message) as caught:
        replace(model, **changes).save(path, overwrite=True)
    assert caught.value.where == str(path)
    assert path.read_bytes() == before
    assert [*tmp_path.iterdir()] == [path]


def test_a_model_without_finite_poses_is_not_saved(make_take, tmp_path):
    model = facert.train(make_take(), Settings(method="ridge"))
    weights = np.full_like(model.method.map_.weights, 1e308)
    model.method.map_ = replace(model.method.map_, weights=weights)
    with pytest.raises(NumericalError, match="no finite poses"):
        model.save(tmp_path / "model.safetensors")
    with pytest.raises(NumericalError, match="too large or small"):
        model.retarget(make_take())
    assert not [*tmp_path.iterdir()]

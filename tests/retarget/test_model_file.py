"""A retargeter comes back from its file as it was; a file that does not fit together is refused."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from safetensors.numpy import load, save

import facert
from facert import InputError, Retargeter, Settings, Take

QUICK = {"unlabelled": 30, "limits": "declared"}


@pytest.fixture(name="take", scope="module")
def _take(make_take) -> Take:
    return make_take(frames=90)


@pytest.fixture(name="retargeter", scope="module")
def _retargeter(take: Take) -> Retargeter:
    return facert.train(take, Settings(**QUICK))


@pytest.fixture(name="shared", scope="module")
def _shared(take: Take) -> Retargeter:
    small = {"latent_dim": 3, "neighbours": 5, "max_iterations": 20}
    return facert.train(take, Settings(method="ssgplvm", **small, **QUICK))


@pytest.fixture(name="model")
def _model(retargeter: Retargeter, tmp_path: Path) -> Path:
    retargeter.save(tmp_path / "model.safetensors")
    return tmp_path / "model.safetensors"


@pytest.fixture(name="shared_model")
def _shared_model(shared: Retargeter, tmp_path: Path) -> Path:
    shared.save(tmp_path / "model.safetensors")
    return tmp_path / "model.safetensors"


def same_poses(a: Take, b: Take) -> None:
    np.testing.assert_allclose(a.params, b.params, atol=1e-10)
    np.testing.assert_allclose(a.std, b.std, atol=1e-10)
    np.testing.assert_allclose(a.source.values, b.source.values, atol=1e-10)


def test_a_saved_and_loaded_retargeter_predicts_the_same(retargeter, model, take):
    loaded = facert.load(model)
    for mode in ("offline", "online"):
        same_poses(loaded.retarget(take, mode), retargeter.retarget(take, mode))
    assert loaded.settings == retargeter.settings
    assert loaded.facts == json.loads(json.dumps(retargeter.facts))


def tampered(model, **changes):
    """The model file with some arrays (or, as None, none) and metadata replaced."""
    content = model.read_bytes()
    arrays = load(content)
    length = int.from_bytes(content[:8], "little")
    metadata = json.loads(json.loads(content[8 : 8 + length])["__metadata__"]["facert"])
    for name, value in changes.items():
        home = arrays if name in arrays or isinstance(value, np.ndarray) else metadata
        if value is None:
            del home[name]
        else:
            home[name] = value
    model.write_bytes(save(arrays, {"facert": json.dumps(metadata)}))
    return model


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"source.mean": None}, "source.mean"),
        ({"source.mean": np.zeros(3)}, "source.mean: expected 15 numbers"),
        ({"source.mean": np.zeros((2, 15))}, "source.mean"),
        ({"source.scale": np.zeros(1)}, "source.scale"),
        ({"target.scale": -np.ones(1)}, "target.scale"),
        ({"target.scale": np.ones(2)}, "target.scale: expected 1 numbers"),
        ({"target.limits": np.zeros((3, 2))}, "target.limits: expected 2 columns"),
        ({"method.source.mean": np.zeros(9)}, "source.covariance: expected 9 for x"),
        ({"method.source.response": None}, "source.response"),
        ({"method.map.weights": np.ones(3)}, "map.weights: expected 4 for 4"),
        ({"method.map.plain.process.X": None}, "map.plain.process.X"),
        ({"method.map.factors.limits": np.zeros((3, 4))}, "map.factors.limits: expected 2 for 2"),
        ({"source.neutral": np.zeros(4)}, "source.neutral: expected 15 numbers"),
        ({"motion.rest": None}, "rest"),
        ({"motion.rest": np.zeros(15)}, "motion: expected numbers above 0"),
        ({"motion_scale": 3.0}, "motion: expected the unit of the source"),
        ({"labels": "many"}, "the metadata"),
        ({"labels": float("inf")}, "the metadata"),
        ({"labels": -1}, "the metadata"),
        ({"labels": 2.5}, "the metadata"),
        ({"source_names": ["a"] * 5}, "names"),
        ({"source_names": None}, "the metadata"),
        ({"source_kind": "smells"}, "source_kind"),
        ({"settings": {"latent_dims": 3}}, "latent_dims"),
        ({"settings": {"method": "magic"}}, "method: expected one of"),
        ({"settings": 5}, "the metadata"),
    ],
)
def test_a_model_file_whose_parts_do_not_fit_is_refused(model, changes, message):
    with pytest.raises(InputError, match=message) as caught:
        facert.load(tampered(model, **changes))
    assert caught.value.where == str(model)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"method.source.latents": None}, "source.latents"),
        ({"method.source.latents": np.zeros((5, 3))}, "source.observations"),
        ({"method.target.latents": np.zeros((32, 2))}, "target.latents"),
        ({"method.target.observations": np.zeros((32, 9))}, "observations: expected 4 columns"),
        ({"method.source.kernel": np.array([1.0, -1.0, 1.0])}, "source.kernel"),
    ],
)
def test_a_shared_model_whose_parts_do_not_fit_is_refused(shared_model, changes, message):
    with pytest.raises(InputError, match=message) as caught:
        facert.load(tampered(shared_model, **changes))
    assert caught.value.where == str(shared_model)


MATERN = {"source_kernel": "matern-5/2", "target_kernel": "matern-5/2"}


@pytest.mark.parametrize("likelihood", ["exact", "vfe"])
@pytest.mark.parametrize("kernels", [{"source_kernel": "matern-5/2"}, MATERN])
def test_a_model_with_another_kernel_predicts_the_same_from_its_file(
    take, tmp_path, likelihood, kernels
):
    small = {"latent_dim": 3, "neighbours": 5, "max_iterations": 20, "inducing": 15}
    made = facert.train(
        take, Settings(method="ssgplvm", likelihood=likelihood, **kernels, **small, **QUICK)
    )
    made.save(tmp_path / "model.safetensors")
    loaded = facert.load(tmp_path / "model.safetensors")
    for mode in ("offline", "online"):
        same_poses(loaded.retarget(take, mode), made.retarget(take, mode))
    assert loaded.settings == made.settings


def test_a_file_of_an_unknown_kernel_is_refused(shared, shared_model):
    settings = {**shared.settings.as_dict(), "target_kernel": "cubic"}
    expected = "target_kernel: expected one of squared-exponential, .*, found 'cubic'. Install"
    with pytest.raises(InputError, match=expected):
        facert.load(tampered(shared_model, settings=settings))


def test_a_file_that_names_no_kernels_has_the_papers(shared, shared_model, take):
    settings = shared.settings.as_dict()
    del settings["source_kernel"], settings["target_kernel"]
    loaded = facert.load(tampered(shared_model, settings=settings))
    same_poses(loaded.retarget(take), shared.retarget(take))


def test_a_file_of_an_earlier_release_has_its_labels_counted_in_the_figures(model, retargeter):
    loaded = facert.load(tampered(model, labels=None, motion_scale=None))
    assert loaded.labels == retargeter.labels == len(retargeter.labelled)


@pytest.mark.parametrize("method", ["ridge", "ssgplvm"])
def test_an_unknown_kernel_is_refused_whatever_the_method(take, method):
    with pytest.raises(InputError, match=r"target_kernel: expected one of .*, found 'cubic'"):
        facert.train(take, Settings(method=method, target_kernel="cubic"))

from copy import copy
from functools import partial

import numpy as np
import pytest
import torch

from facert.data.arrays import rms
from facert.errors import InputError
from facert.methods import shared_gplvm
from facert.methods.base import Labelled, Unlabelled
from facert.methods.registry import make_method
from facert.models.gplvm import staging
from facert.models.gplvm.source_mapping import SourceMapping
from facert.models.gplvm.target_mapping import map_to_target
from facert.models.kernels import KERNELS
from facert.models.optim.lbfgs import LBFGS
from facert.models.optim.monitor import Monitor
from facert.models.optim.scg import SCG
from facert.settings import Settings

QUICK = {"latent_dim": 3, "neighbours": 5, "max_iterations": 40}


def make_data(labelled=10, alone=15, seed=0):
    rng = np.random.default_rng(seed)
    latent = rng.normal(size=(labelled + 2 * alone, 2))
    X = np.tanh(latent @ rng.normal(size=(2, 9)))
    Y = np.sin(latent @ rng.normal(size=(2, 4)))
    source_only, target_only = slice(labelled, labelled + alone), slice(labelled + alone, None)
    return Labelled(X[:labelled], Y[:labelled]), Unlabelled(X[source_only], Y[target_only])


def fitted(method="ssgplvm", data=None, **options):
    labelled, unlabelled = data or make_data()
    made = make_method(Settings(method=method, **{**QUICK, **options}))
    made.fit(labelled, unlabelled)
    return made


@pytest.fixture(scope="module")
def method():
    return fitted()


def same(a, b):
    for name in ("Y", "std", "X"):
        np.testing.assert_allclose(getattr(a, name), getattr(b, name), atol=1e-10)


def test_the_semi_supervised_model_has_a_latent_for_every_row_it_was_given(method):
    assert method.source_.Z.shape == (25, 3)
    assert method.target_.Z.shape == (25, 3)
    np.testing.assert_array_equal(method.source_.Z[:10], method.target_.Z[:10])


def test_the_supervised_model_does_not_look_at_unlabelled_data():
    labelled, unlabelled = make_data()
    other = Unlabelled(unlabelled.X[::-1] ** 2, unlabelled.Y[:3] + 5.0)
    a, b = (fitted("sgplvm", (labelled, u)) for u in (unlabelled, other))
    same(a.predict(labelled.X), b.predict(labelled.X))
    assert len(a.source_.Z) == len(a.target_.Z) == 10


@pytest.mark.parametrize("likelihood", ["vfe", "fitc"])
def test_through_inducing_latents_the_model_predicts_nearly_the_same(method, likelihood):
    sparse = fitted(likelihood=likelihood, inducing=20)
    frames = make_data()[1].X
    exact, other = method.predict(frames), sparse.predict(frames)
    assert rms(other.Y - exact.Y) < 0.15 * exact.Y.std()
    assert rms(other.X - exact.X) < 0.15 * exact.X.std()


def test_a_small_set_is_learned_exactly_and_a_large_one_through_inducing_latents():
    small, large = fitted(), fitted(data=make_data(alone=110), inducing=15, max_iterations=15)
    assert small.save()["source.observations"].shape == (25, 9)
    shapes = {name: array.shape for name, array in large.save().items()}
    assert shapes["source.latents"] == shapes["target.latents"] == (15, 3)
    assert shapes["source.whitener"] == (15, 15)
    assert shapes["target.weights"] == (15, 4)
    assert not any("observations" in name for name in shapes)


def test_a_large_set_of_labels_needs_no_others(monkeypatch):
    monkeypatch.setattr(staging, "CORE_LABELS", 40)
    labelled, unlabelled = make_data(labelled=90, alone=0)
    made = fitted("sgplvm", (labelled, unlabelled), inducing=30)
    assert made.source_.Z.shape == (30, 3)
    assert np.abs(made.predict(labelled.X).Y - labelled.Y).mean() < 0.2 * labelled.Y.std()


def test_a_sparse_model_is_the_same_after_saving_and_loading():
    made = fitted(likelihood="vfe", inducing=12)
    again = make_method(made.settings)
    again.load(made.save())
    same(again.predict(make_data()[1].X), made.predict(make_data()[1].X))


@pytest.mark.parametrize(
    ("name", "damage", "said"),
    [
        ("source.whitener", lambda a: a[:-1], "expected 12 for m"),
        ("target.weights", lambda a: a[:0], "expected an array of 2 dimensions"),
        ("source.kernel", lambda a: -a, "expected three positive numbers"),
    ],
)
def test_a_damaged_sparse_model_is_refused(name, damage, said):
    made = fitted(likelihood="vfe", inducing=12, max_iterations=2)
    arrays = made.save()
    arrays[name] = damage(arrays[name])
    with pytest.raises(InputError, match=f"{name}: {said}"):
        make_method(made.settings).load(arrays)


MATERN = {"source_kernel": "matern-5/2", "target_kernel": "matern-5/2"}


@pytest.mark.parametrize("likelihood", ["exact", "vfe"])
@pytest.mark.parametrize("kernels", [{"source_kernel": "matern-5/2"}, MATERN])
def test_another_kernel_learns_as_well(method, likelihood, kernels):
    made = fitted(likelihood=likelihood, inducing=20, **kernels)
    labelled, unlabelled = make_data()
    prediction, usual = made.predict(unlabelled.X), method.predict(unlabelled.X)
    assert rms(made.predict(labelled.X).Y - labelled.Y) < 0.4 * labelled.Y.std()
    assert rms(prediction.Y - usual.Y) < 0.5 * usual.Y.std()
    assert rms(prediction.X - unlabelled.X) < 0.2 * unlabelled.X.std()


@pytest.mark.parametrize("likelihood", ["exact", "vfe"])
@pytest.mark.parametrize("kernel", KERNELS)
def test_batch_stream_and_device_map_alike(kernel, likelihood):
    """Without the temporal term a stream maps each frame on its own."""
    options = {"likelihood": likelihood, "inducing": 20, "sigma_t": 1e9}
    made = fitted(source_kernel=kernel, target_kernel=kernel, **options)
    frames = make_data()[1].X
    batch, there = made.predict(frames), copy(made)
    there._set_views(made.source_, made.target_)
    device = torch.device("cpu")
    there.mapping_ = SourceMapping(made.source_.on(device))
    there.to_poses_ = partial(map_to_target, made.target_.on(device))
    on_device, stream = there.predict(frames), made.stream()
    for row in range(len(frames)):
        one = stream.step(frames[row : row + 1])
        np.testing.assert_allclose(one.Y, batch.Y[row : row + 1], atol=1e-4)
    for name in ("Y", "std", "X"):
        np.testing.assert_allclose(getattr(on_device, name), getattr(batch, name), atol=1e-8)


@pytest.mark.parametrize(("name", "kind"), [("lbfgs", LBFGS), ("scg", SCG)])
def test_the_optimiser_is_the_one_of_the_settings(name, kind, monkeypatch):
    used, train = [], shared_gplvm.train

    def note(module, optimiser, **options):
        used.append(type(optimiser.inner))
        return train(module, optimiser, **options)

    monkeypatch.setattr(shared_gplvm, "train", note)
    fitted(optimizer=name, max_iterations=2)
    assert used == [kind]


@pytest.mark.parametrize("likelihood", ["exact", "vfe"])
def test_each_view_has_its_own_kernel(likelihood):
    options = {"likelihood": likelihood, "inducing": 9, "max_iterations": 2}
    made = fitted(target_kernel="matern-5/2", **options)
    kernels = type(made.source_.kernel), type(made.target_.kernel)
    assert kernels == (KERNELS["squared-exponential"], KERNELS["matern-5/2"])


def test_a_number_of_huge_variance_is_as_good_as_hidden(method):
    """And one of none is as good as measured."""
    frames = make_data()[1].X[:6]
    hidden, variance = frames.copy(), np.zeros(frames.shape)
    hidden[:, [2, 5]], variance[:, [2, 5]] = np.nan, 1e9
    expected, found = method.predict(hidden), method.predict(frames, variance)
    for name in ("Y", "std"):
        np.testing.assert_allclose(getattr(found, name), getattr(expected, name), atol=1e-5)
    same(method.predict(frames, 0.0 * variance), method.predict(frames))


def test_an_unknown_kernel_is_refused():
    with pytest.raises(InputError, match=r"source_kernel: expected one of .*found 'cubic'"):
        make_method(Settings(method="ssgplvm", source_kernel="cubic"))


def test_three_labels_suffice(caplog):
    labelled, _ = make_data()
    data = Labelled(labelled.X[:3], labelled.Y[:3]), Unlabelled(labelled.X[:0], labelled.Y[:0])
    prediction = fitted("ssgplvm", data).predict(labelled.X)
    assert np.isfinite(prediction.Y).all()
    assert "3 points carry only 2 latent dimensions" in caplog.text


def test_the_first_frame_of_a_stream_is_mapped_on_its_own(method):
    frame = make_data()[1].X[:1]
    same(method.stream().step(frame), method.predict(frame))


def test_streams_do_not_know_of_each_other(method):
    frames = make_data()[1].X[:4]
    first, second = method.stream(), method.stream()
    expected = [first.step(frames[i : i + 1]) for i in range(4)]
    for i in range(4):
        same(second.step(frames[i : i + 1]), expected[i])


def test_the_fingerprint_tells_runs_apart_by_data_and_by_what_shapes_the_model():
    class Listener(Monitor):
        def resume(self, fingerprint):
            self.heard = fingerprint

    def fingerprint(data=None, **options):
        listener = Listener()
        options = {"method": "ssgplvm", **QUICK, **options, "max_iterations": 1}
        made = make_method(Settings(**options))
        made.fit(*(data or make_data()), listener)
        return listener.heard

    assert fingerprint() == fingerprint(sigma_t=9.0)
    others = [
        fingerprint(make_data(seed=1)),
        fingerprint(latent_dim=2),
        fingerprint(neighbours=4),
        fingerprint(checkpoint_every=7),
        fingerprint(sigma_c=0.2),
        fingerprint(optimizer="scg"),
        fingerprint(likelihood="vfe"),
        fingerprint(inducing=7),
        fingerprint(source_kernel="matern-5/2"),
        fingerprint(target_kernel="matern-5/2"),
        fingerprint(method="sgplvm"),
    ]
    assert len({fingerprint(), *others}) == len(others) + 1

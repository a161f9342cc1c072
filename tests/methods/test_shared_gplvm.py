import numpy as np
import pytest

from facert.methods import make_method
from facert.methods.base import Labelled, Unlabelled
from facert.optim.monitor import Monitor
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
        fingerprint(method="sgplvm"),
    ]
    assert len({fingerprint(), *others}) == len(others) + 1

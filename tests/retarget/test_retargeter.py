import warnings
from copy import deepcopy
from dataclasses import replace

import numpy as np
import pytest
from sklearn.exceptions import ConvergenceWarning
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel

import facert
from facert import Controls, InputError, Settings, Source
from facert.data.arrays import rms
from facert.data.normalisation import Normalisation
from facert.preprocess.training_set import choose_training_set
from facert.retarget.options import AS_IT_IS

QUICK = Settings(unlabelled=30, limits="declared")
SHARED = replace(QUICK, method="ssgplvm", latent_dim=3, neighbours=5, max_iterations=60)


@pytest.fixture(scope="module")
def truth(make_take):
    """A take with the pose of every frame."""
    return make_take(frames=90, posed=90)


@pytest.fixture(scope="module")
def take(truth, pose_few):
    """The same with 12 poses."""
    return pose_few(truth, 12)


@pytest.fixture(scope="module")
def retargeter(take):
    return facert.train(take, QUICK)


@pytest.fixture(scope="module")
def shared(take):
    """A shared Gaussian process model: it goes step by step, in training and online."""
    return facert.train(take, SHARED)


def hide(take, share, seed=0):
    """The take with so many of its markers not observed."""
    values = take.source.values.copy()
    values[np.random.default_rng(seed).random(values.shape[:2]) < share] = np.nan
    return replace(take, source=replace(take.source, values=values))


def only(take, rows):
    return replace(
        take,
        time=take.time[: len(rows)],
        source=replace(take.source, values=take.source.values[rows]),
        params=None,
    )


def same_poses(a, b, tolerance=1e-10):
    np.testing.assert_allclose(a.params, b.params, atol=tolerance)
    np.testing.assert_allclose(a.std, b.std, atol=tolerance)
    np.testing.assert_allclose(a.source.values, b.source.values, atol=tolerance)


def test_every_frame_gets_a_pose_close_to_the_truth(retargeter, take, truth):
    result = retargeter.retarget(take)
    assert result.params.shape == result.std.shape == truth.params.shape
    assert result.controls.names == truth.controls.names
    assert rms(result.params - truth.params) < 0.25 * truth.params.std()
    assert (result.std > 0).all()
    assert result.animation is None
    assert result.units == take.units


def test_the_same_seed_trains_the_same_model(retargeter, take):
    same_poses(facert.train(take, QUICK).retarget(take), retargeter.retarget(take), 0.0)


def test_markers_are_matched_by_name(retargeter, take):
    turned = Source(take.source.values[:, ::-1], take.source.names[::-1])
    extra = Source(
        np.concatenate([take.source.values, take.source.values[:, :1]], axis=1),
        [*take.source.names, "tip"],
    )
    for source in (turned, extra):
        same_poses(retargeter.retarget(replace(take, source=source)), retargeter.retarget(take))


@pytest.mark.parametrize(("scale", "shift"), [(0.01, 0.0), (25.4, 100.0)])
def test_neither_unit_nor_origin_of_the_source_matters(retargeter, take, scale, shift):
    moved = replace(take, source=take.source.with_matrix(scale * take.source.matrix + shift))
    expected = retargeter.retarget(take)
    result = facert.train(moved, QUICK).retarget(moved)
    # Rounding differs, and with it the way of the optimiser a little.
    np.testing.assert_allclose(result.params, expected.params, atol=1e-3)
    np.testing.assert_allclose(
        result.source.values, scale * expected.source.values + shift, atol=1e-3 * scale
    )


def test_as_it_is_every_frame_is_mapped_on_its_own(retargeter, take):
    order = np.random.default_rng(0).permutation(len(take))
    expected = retargeter.retarget(take, options=AS_IT_IS)
    permuted = retargeter.retarget(only(take, order), options=AS_IT_IS)
    np.testing.assert_allclose(permuted.params, expected.params[order], atol=1e-7)
    few = retargeter.retarget(only(take, order[:5]), options=AS_IT_IS)
    np.testing.assert_allclose(few.params, expected.params[order[:5]], atol=1e-7)


def test_online_a_frame_depends_on_those_before_and_on_none_after(shared, take):
    whole = shared.retarget(take, "online")
    begun = shared.retarget(only(take, np.arange(20)), "online")
    np.testing.assert_allclose(begun.params, whole.params[:20], atol=1e-10)


def test_without_temporal_pull_online_is_offline(shared, take):
    free = deepcopy(shared)
    free.method.settings = replace(free.settings, sigma_t=1e6)
    online = free.retarget(take, "online", AS_IT_IS)
    offline = shared.retarget(take, options=AS_IT_IS)
    same = np.abs(online.params - offline.params).max(axis=1) < 1e-5
    assert same.mean() > 0.95  # one or the other finds a better optimum from where the last was


def test_the_temporal_pull_smooths_a_noisy_source(shared, take):
    noise = 0.2 * np.random.default_rng(0).normal(size=take.source.matrix.shape)
    noisy = replace(take, source=take.source.with_matrix(take.source.matrix + noise))

    def jitter(mode):
        return np.abs(np.diff(shared.retarget(noisy, mode, AS_IT_IS).params, 2, axis=0)).mean()

    assert jitter("online") < jitter("offline")


def test_missing_markers_widen_the_std_and_come_back(retargeter, take, truth):
    hidden = hide(take, 0.4)
    partial = ~hidden.source.valid.all(axis=1) & hidden.source.valid.any(axis=1)
    clean, result = retargeter.retarget(take), retargeter.retarget(hidden)
    assert (result.std[partial] > clean.std[partial]).mean() > 0.7
    assert result.std[partial].mean() > clean.std[partial].mean()
    assert np.isfinite(result.source.values).all()
    gaps = ~hidden.source.valid & partial[:, None]
    error = rms((result.source.values - truth.source.values)[gaps])
    assert error < 0.4 * truth.source.values.std()


def test_a_take_with_a_third_of_its_markers_missing_still_trains_and_retargets(take, truth):
    hidden = hide(take, 0.3)
    result = facert.train(hidden, QUICK).retarget(hidden)
    assert np.isfinite(result.params).all()
    assert rms(result.params - truth.params) < 0.6 * truth.params.std()


def test_a_frame_without_any_marker_gets_a_pose_with_a_wide_std(retargeter, take):
    values = take.source.values.copy()
    values[5] = np.nan
    result = retargeter.retarget(replace(take, source=replace(take.source, values=values)))
    assert np.isfinite(result.params[5]).all()
    assert (result.std[5] > np.median(result.std, axis=0)).all()


def test_markers_that_no_frame_shows_are_left_out(take, caplog):
    values = take.source.values.copy()
    values[:, 2] = np.nan
    retargeter = facert.train(replace(take, source=replace(take.source, values=values)), QUICK)
    assert retargeter.source_names == ("m0", "m1", "m3", "m4")
    assert "never observed in the take, left out: m2" in caplog.text
    assert retargeter.retarget(take).source.names == retargeter.source_names


def test_weights_serve_as_a_source_like_markers(take, retargeter):
    matrix = take.source.matrix
    weights = Source(matrix, [f"w{i}" for i in range(matrix.shape[1])])
    as_weights = replace(take, source=weights)
    result = facert.train(as_weights, QUICK).retarget(as_weights)
    np.testing.assert_allclose(result.params, retargeter.retarget(take).params, atol=1e-8)


def test_limits_clip(take):
    limits = np.tile([-0.1, 0.1], (4, 1))
    limited = replace(take, controls=Controls(take.controls.names, limits))
    result = facert.train(limited, QUICK).retarget(take)
    assert (np.abs(result.params) <= 0.1).all()
    assert (np.abs(result.params) == 0.1).any()


@pytest.mark.parametrize("settings", [SHARED, QUICK])
@pytest.mark.parametrize(("rule", "clipped"), [("auto", True), ("declared", False)])
def test_without_declared_limits_poses_stay_within_those_that_were_seen(
    take, settings, rule, clipped
):
    far = replace(take, source=take.source.with_matrix(1.5 * take.source.matrix))
    result = facert.train(take, replace(settings, limits=rule)).retarget(far)
    seen = np.vstack([take.params[take.labels], take.animation])
    inside = (result.params >= seen.min(axis=0)) & (result.params <= seen.max(axis=0))
    assert inside.all() == clipped


def test_the_supervised_model_keeps_the_labelled_frames_alone(take):
    supervised = facert.train(take, replace(SHARED, method="sgplvm")).method
    assert len(supervised.source_.Z) == len(supervised.target_.Z) == 12


def test_labels_can_be_drawn_by_seed(take):
    settings = replace(SHARED, labels=6, seed=3)
    retargeter = facert.train(take, settings)
    drawn = choose_training_set(take, settings).Y_labelled
    np.testing.assert_allclose(
        retargeter.target_units.undo(retargeter.method.target_.X[:6]), drawn, atol=1e-12
    )
    assert retargeter.figures["labelled frames"] == 6


def test_how_training_went_is_told(retargeter, shared):
    for figures in (retargeter.figures, shared.figures):
        assert figures["labelled frames"] == 12
        assert figures["unlabelled frames"] == 30
        assert figures["unlabelled poses"] == 20
        assert 0 < figures["training reconstruction"] < 1


def test_how_the_steps_of_training_went_is_told(shared):
    figures = shared.figures
    assert figures["iterations"] > 0
    assert 1 / figures["source theta3"] >= figures["sigma_c"] ** 2
    assert 1 / figures["target theta3"] >= SHARED.target_noise_floor


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"controls": None, "params": None, "animation": None}, "/target: expected poses"),
        ({"source": Source(np.ones((90, 5, 3)), list("abcde"))}, "/source/markers.*that change"),
        ({"params": np.ones((90, 4)), "animation": None}, "/target/params.*that change"),
    ],
)
def test_a_take_that_teaches_nothing_is_refused(take, change, message):
    with pytest.raises(InputError, match=message):
        facert.train(replace(take, **change), QUICK)


@pytest.mark.parametrize(
    ("source", "message"),
    [
        (Source(np.ones((90, 5)), list("abcde")), "/source: expected markers, found weights"),
        (Source(np.ones((90, 5, 3)), list("abcde")), "/source/names"),
    ],
)
def test_a_source_that_the_model_does_not_know_is_refused(retargeter, take, source, message):
    with pytest.raises(InputError, match=message):
        retargeter.retarget(replace(take, source=source))


def test_a_marker_that_the_take_lacks_is_taken_as_hidden(retargeter, take, caplog):
    names, values = take.source.names, take.source.values
    hidden = values.copy()
    hidden[:, 0] = np.nan
    without = retargeter.retarget(replace(take, source=Source(values[:, 1:], names[1:])))

    expected = retargeter.retarget(replace(take, source=Source(hidden, names)))
    np.testing.assert_array_equal(without.params, expected.params)
    assert names[0] in caplog.text


def test_other_units_are_refused(retargeter, take):
    with pytest.raises(InputError, match="units: expected"):
        retargeter.retarget(replace(take, units="furlong"))


def draw(truth, labels, unlabelled, seed):
    """A take with so many random poses and so much animation; and the frames to test on."""
    order = np.random.default_rng(seed).permutation(len(truth))
    posed, animated = order[:labels], order[labels : labels + unlabelled]
    params = np.full_like(truth.params, np.nan)
    params[posed] = truth.params[posed]
    take = replace(truth, params=params, animation=truth.params[animated])
    return take, order[labels + unlabelled :]


def gaussian_process_regression(take, frames):
    """Poses of frames (n, d_x) from the take's labels alone, by scikit-learn."""
    source = Normalisation.of(take.source.matrix, "source")
    target = Normalisation.of(take.params[take.labels], "target")
    kernel = ConstantKernel(1.0) * RBF(3.0, (1e-2, 1e4)) + WhiteKernel(1e-2, (1e-9, 1e2))
    model = GaussianProcessRegressor(kernel, n_restarts_optimizer=3, random_state=0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)
        model.fit(
            source.apply(take.source.matrix[take.labels]), target.apply(take.params[take.labels])
        )
    return target.undo(model.predict(source.apply(frames)))


@pytest.fixture(scope="module")
def real_truth(real_data):
    return facert.read_take(real_data / "tracks" / "utterance_a.npz", target="arkit")


@pytest.mark.real
def test_on_a_real_performance_ten_labels_serve_better_than_with_regression(real_truth):
    take, test = draw(real_truth, labels=10, unlabelled=100, seed=0)
    ours = facert.train(take).retarget(take).params[test]
    theirs = gaussian_process_regression(take, take.source.matrix[test])
    truth = real_truth.params[test]
    assert rms(ours - truth) < 0.85 * rms(theirs - truth)


@pytest.mark.real
def test_on_a_real_performance_hidden_markers_hardly_matter(real_truth):
    take, test = draw(real_truth, labels=10, unlabelled=100, seed=0)
    retargeter = facert.train(take)
    truth = real_truth.params[test]
    clean, hidden = (
        rms(retargeter.retarget(t).params[test] - truth) for t in (take, hide(take, 0.4))
    )
    assert hidden < 1.2 * clean

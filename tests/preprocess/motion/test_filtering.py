import numpy as np
import pytest

from facert.data.normalisation import Normalisation
from facert.preprocess.faults import HELD, FaultDetector
from facert.preprocess.motion import filtering
from facert.preprocess.motion.filtering import MotionFilter, _FactorFilter, _SeriesFilter
from facert.preprocess.motion.motion import Motion
from facert.preprocess.motion.smoothing import smooth_factors, smooth_series

SIGMA = 0.1


@pytest.fixture(scope="module")
def frames(face):
    """Normalised, (400, 60)."""
    X = face.reshape(len(face), -1)
    return Normalisation.of(X, "face").apply(X)


@pytest.fixture(scope="module")
def noisy(frames):
    return frames + SIGMA * np.random.default_rng(0).normal(size=frames.shape)


@pytest.fixture(scope="module")
def motion(noisy):
    return Motion.learned(noisy[:300], SIGMA, 1 / 30)


def filtered(motion, X, sigma=SIGMA):
    stream, found = MotionFilter(motion, sigma), []
    for frame in X:
        seen = ~np.isnan(frame)
        found.append((stream.step(frame, None if seen.all() else seen), stream.variance))
    mean, variance = zip(*found, strict=True)
    return np.array(mean), np.array(variance)


def stepped(part, X, seen):
    """What a part of the filter makes of the last frame."""
    for frame, there in zip(X, seen, strict=True):
        part.look_ahead()
        mean = part.step(frame, there)
    return mean


def rms(values):
    return np.sqrt(np.mean(values**2))


def test_after_its_last_frame_a_filter_knows_what_the_smoother_knows(motion, noisy, monkeypatch):
    monkeypatch.setattr(filtering, "RISE", 1.0)
    monkeypatch.setattr(filtering, "FALL", 1.0)  # nothing surprises
    X = np.where(np.random.default_rng(1).random(noisy.shape) < 0.3, np.nan, noisy)[:40]
    factors, seen = motion.seen_with(SIGMA), ~np.isnan(X)
    shared = _FactorFilter(factors, motion.rates)
    last = stepped(shared, X, seen)
    found = smooth_factors(*factors.information(X), motion.rates)
    np.testing.assert_allclose(last, factors.frames(found.mean)[-1], atol=1e-8)
    np.testing.assert_allclose(shared.variance, factors.variance(found.covariance)[-1], atol=1e-8)

    series = _SeriesFilter(motion.rest, motion.rest_rates, SIGMA**2)
    values = np.where(seen, X, 0.0)
    last = stepped(series, values, seen)
    mean, variance = smooth_series(X, seen, motion.rest, SIGMA**2, motion.rest_rates)
    np.testing.assert_allclose(last, mean[-1], atol=1e-8)
    np.testing.assert_allclose(series.variance, variance[-1], atol=1e-8)


def test_noise_is_halved_in_frames_it_has_not_learned_from(motion, frames, noisy):
    mean, _ = filtered(motion, noisy)
    assert rms((mean - frames)[310:]) < 0.6 * SIGMA


def test_hidden_markers_come_back(motion, frames, noisy):
    hidden = np.zeros(noisy.shape, dtype=bool)
    hidden[310:, 30:36] = True
    mean, variance = filtered(motion, np.where(hidden, np.nan, noisy))
    spread = rms(frames[310:, 30:36] - frames[310:, 30:36].mean(axis=0))
    assert rms((mean - frames)[hidden]) < 0.3 * spread
    assert variance[hidden].mean() > variance[~hidden].mean()


def test_what_is_to_come_changes_nothing(motion, noisy):
    mean, variance = filtered(motion, noisy)
    begun, begun_variance = filtered(motion, noisy[:50])
    np.testing.assert_array_equal(begun, mean[:50])
    np.testing.assert_array_equal(begun_variance, variance[:50])


def test_a_settled_gain_is_the_gain(motion, noisy, monkeypatch):
    quick, _ = filtered(motion, noisy)
    monkeypatch.setattr(filtering, "SETTLED", 0.0)
    exact, _ = filtered(motion, noisy)
    np.testing.assert_allclose(quick, exact, atol=1e-4)


def test_motion_that_was_never_seen_passes(motion, noisy):
    strange = noisy.copy()
    strange[320:, 30:45] += 4.0  # another place for five markers, for good
    mean, _ = filtered(motion, strange)
    assert np.abs(mean - strange)[330:, 30:45].mean() < 0.3


def test_rates_are_for_a_time_not_for_a_frame(motion):
    double, slow = motion.every(2 / 30), motion.rates < 2.0
    np.testing.assert_allclose(double.rates, np.minimum(2 * motion.rates, 4.0))
    np.testing.assert_allclose(double.every(1 / 30).rates[slow], motion.rates[slow])
    assert double.sigma == motion.sigma


def test_zeros_and_held_markers_are_bad_while_others_move():
    rng, watch = np.random.default_rng(0), FaultDetector(6)
    frames = rng.normal(size=(20, 6, 3))
    frames[5:15, 2] = frames[4, 2]
    frames[8, 3] = 0.0
    frames[10, 4] = np.nan
    bad = np.array([watch.step(frame) for frame in frames])
    expected = np.zeros((20, 6), dtype=bool)
    expected[4 + HELD : 15, 2] = expected[8, 3] = True
    np.testing.assert_array_equal(bad, expected)


def test_a_face_at_rest_and_doubled_frames_are_not_held():
    rng, watch = np.random.default_rng(0), FaultDetector(5)
    frames = np.repeat(rng.normal(size=(6, 5, 3)), 6, axis=0)
    assert not np.array([watch.step(frame) for frame in frames]).any()


def test_a_spike_in_one_marker_is_forgotten_in_ten_frames(motion, noisy):
    spiked = noisy.copy()
    spiked[320, 30:33] += 30.0
    plain, _ = filtered(motion, noisy)
    mean, _ = filtered(motion, spiked)
    assert np.abs(mean - plain)[320].max() < 1.0
    assert np.abs(mean - plain)[330:].max() < 0.02


def test_a_long_take_in_parts_is_the_take_as_a_whole(motion, noisy, monkeypatch):
    from facert.preprocess.motion import motion as room

    X = np.where(np.random.default_rng(1).random(noisy.shape) < 0.3, np.nan, noisy)
    whole = motion.smooth(X, SIGMA)
    monkeypatch.setattr(room, "PART", 150)
    monkeypatch.setattr(room, "OVERLAP", 120)
    for one, other in zip(motion.smooth(X, SIGMA), whole, strict=True):
        assert one.shape == other.shape
        np.testing.assert_allclose(one, other, atol=0.01)


@pytest.mark.parametrize(
    ("noise", "forgotten"), [(1.5, False), (0.6, False), (2.5, True), (0.3, True)]
)
def test_at_another_noise_by_more_than_twice_the_filter_begins_at_its_prior(noise, forgotten):
    """It took noise for motion, or motion for noise."""
    filter_ = _SeriesFilter(np.ones(3), np.full(3, 0.3), 0.1)
    stepped(filter_, np.random.default_rng(0).normal(size=(30, 3)), [None] * 30)
    values = filter_._m.copy()
    filter_.set_noise(0.1 * noise)
    np.testing.assert_array_equal(filter_._m[0], values[0])
    assert (filter_._P == filter_._chain.prior).all() == forgotten
    assert (filter_._m[1] == 0.0).all() == forgotten

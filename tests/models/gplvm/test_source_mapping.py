import numpy as np
import pytest
from scipy.optimize import minimize

from facert.models.gp.posterior import Posterior
from facert.models.gplvm.source_mapping import CHUNK, Observation, SourceMapping, _leave_saddles
from facert.models.kernels import KERNELS, SquaredExponential

THETA = {"variance": 1.2, "inverse_width": 0.5, "noise": 0.02}
SIGMA_C, SIGMA_T = 0.1, 0.2
STEP = 1e-5


def make_mapping(seed=0, latent_dim=2, columns=6, kernel=SquaredExponential):
    rng = np.random.default_rng(seed)
    Z = rng.normal(size=(18, latent_dim))
    X = np.sin(Z @ rng.normal(size=(latent_dim, columns)))
    return SourceMapping(Posterior(Z, X, kernel(**THETA)))


def make_frames(mapping, count, missing=0.0, seed=1):
    """Noisy observations near the manifold, with NaN where a dimension was not seen."""
    rng = np.random.default_rng(seed)
    clean = mapping.view.predict(rng.normal(size=(count, mapping.view.Z.shape[1]))).mean
    frames = clean + SIGMA_C * rng.normal(size=clean.shape)
    frames[rng.random(frames.shape) < missing] = np.nan
    return frames


@pytest.fixture
def mapping():
    return make_mapping()


def full_objective(mapping, x, z, frame, previous=None):
    """Minus the logarithm of Eq. (12), over x and z, for one frame."""
    at = mapping.view.predict(z[None])
    seen = ~np.isnan(frame)
    value = ((x - frame)[seen] ** 2).sum() / (2 * SIGMA_C**2)
    if previous is not None:
        value += ((x - previous) ** 2).sum() / (2 * SIGMA_T**2)
    value += ((x - at.mean[0]) ** 2).sum() / (2 * at.variance[0])
    return value + 0.5 * len(x) * np.log(at.variance[0]) + 0.5 * z @ z


@pytest.mark.parametrize("missing", [0.0, 0.4])
@pytest.mark.parametrize("name", KERNELS)
def test_gradient_and_hessian_agree_with_finite_differences(name, missing):
    mapping = make_mapping(kernel=KERNELS[name])
    observed = Observation.of(make_frames(mapping, 5, missing), SIGMA_C)
    z = np.random.default_rng(2).normal(size=(5, 2))
    at = mapping._expand(z, observed)
    np.testing.assert_allclose(at.energy, mapping.energy(z, observed), rtol=1e-12)
    for axis, step in enumerate(STEP * np.eye(2)):
        ahead, behind = (mapping._expand(z + s, observed) for s in (step, -step))
        slope = (ahead.energy - behind.energy) / (2 * STEP)
        curvature = (ahead.gradient - behind.gradient) / (2 * STEP)
        np.testing.assert_allclose(at.gradient[:, axis], slope, rtol=1e-5, atol=1e-6)
        np.testing.assert_allclose(at.hessian[:, axis], curvature, rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize("missing", [0.0, 0.4])
@pytest.mark.parametrize("temporal", [False, True])
def test_eliminating_x_changes_nothing_in_the_minimum_of_equation_12(mapping, missing, temporal):
    (frame,) = make_frames(mapping, 1, missing)
    observed = Observation.of(frame[None], SIGMA_C)
    previous = None
    if temporal:
        (previous,) = make_frames(mapping, 1, seed=9)
        observed = observed.following(previous[None], SIGMA_T)
    mapped = mapping.solve(observed)

    def objective(xz):
        return full_objective(mapping, xz[:6], xz[6:], frame, previous)

    solution = np.r_[mapped.x[0], mapped.z[0]]
    nudged = solution + 0.01 * np.random.default_rng(0).normal(size=8)
    direct = minimize(objective, nudged, method="BFGS", options={"gtol": 1e-6, "maxiter": 2000})
    np.testing.assert_allclose(solution, direct.x, atol=1e-4)
    assert objective(solution) <= direct.fun + 1e-9


def test_the_energy_differs_from_equation_12_by_a_constant_alone(mapping):
    """The constant is that of Eq. (13) and (14): the energy ranks temporal starts fairly."""
    (frame,) = make_frames(mapping, 1)
    observed = Observation.of(frame[None], SIGMA_C)
    z = np.random.default_rng(3).normal(size=(4, 2))
    energies = [mapping.energy(row[None], observed)[0] for row in z]
    full = []
    for row in z:
        x = mapping._look(row[None], observed)[1][0]
        full.append(full_objective(mapping, x, row, frame))
    np.testing.assert_allclose(np.subtract(energies, full), 0.0, atol=1e-10)


def test_a_dimension_that_was_not_seen_does_not_enter_the_data_term(mapping):
    """Whatever stands in its place, and however its noise goes to infinity."""
    frames = make_frames(mapping, 8)
    hidden = frames.copy()
    hidden[:, [1, 4]] = np.nan
    missing = Observation.of(hidden, SIGMA_C)
    nearly = Observation(frames, np.where(np.isnan(hidden), 1e12, SIGMA_C**2))
    np.testing.assert_allclose(mapping.solve(missing).z, mapping.solve(nearly).z, atol=1e-6)


def test_what_was_not_seen_comes_back_as_the_models_mean(mapping):
    frames = make_frames(mapping, 8, missing=0.3)
    mapped = mapping.solve(Observation.of(frames, SIGMA_C))
    mean = mapping.view.predict(mapped.z).mean
    hidden = np.isnan(frames)
    np.testing.assert_allclose(mapped.x[hidden], mean[hidden], rtol=1e-10)


def test_a_frame_without_any_observation_maps_to_the_most_probable_latent(mapping):
    observed = Observation.of(np.full((1, 6), np.nan), SIGMA_C)
    mapped = mapping.solve(observed)
    assert mapped.converged.all()
    assert (mapped.energy <= mapping.energy(mapping.view.Z, _repeat(observed, 18))).all()


def _repeat(observed, count):
    return Observation(np.repeat(observed.mean, count, 0), np.repeat(observed.variance, count, 0))


def test_a_batch_equals_frame_by_frame(mapping):
    frames = make_frames(mapping, CHUNK + 20, missing=0.2)
    batch = mapping.solve(Observation.of(frames, SIGMA_C))
    for row in [0, 1, CHUNK - 1, CHUNK, CHUNK + 19]:
        alone = mapping.solve(Observation.of(frames[row : row + 1], SIGMA_C))
        np.testing.assert_allclose(alone.z[0], batch.z[row], atol=1e-7)
        np.testing.assert_allclose(alone.x[0], batch.x[row], atol=1e-7)
        np.testing.assert_allclose(alone.hessian[0], batch.hessian[row], rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize("name", KERNELS)
def test_frames_end_at_a_stationary_point(name):
    mapping = make_mapping(kernel=KERNELS[name])
    observed = Observation.of(make_frames(mapping, 30, missing=0.3), SIGMA_C)
    mapped = mapping.solve(observed)
    assert mapped.converged.all()
    assert np.abs(mapping._expand(mapped.z, observed).gradient).max() < 1e-3
    assert (np.linalg.eigvalsh(mapped.hessian) > 0).all()


def solve_random_frames(seed):
    mapping = make_mapping(seed, latent_dim=3, columns=9)
    return mapping.solve(Observation.of(make_frames(mapping, 60, missing=0.3), SIGMA_C))


def test_rounding_makes_no_saddle_where_the_energy_is_flat():
    curvatures = np.array([[-1e-17, 1.0], [-1e-2, 1.0], [1e-17, 1.0]])
    step, descent = np.zeros((3, 2)), np.zeros(3)
    hessian = curvatures[:, :, None] * np.eye(2)
    saddle = _leave_saddles(hessian, step, descent, np.ones(3, dtype=bool))
    np.testing.assert_array_equal(saddle, [False, True, False])
    np.testing.assert_allclose(np.abs(step), [[0.0, 0.0], [1.0, 0.0], [0.0, 0.0]], atol=1e-12)


@pytest.mark.parametrize("seed", range(6))
def test_all_frames_converge(seed):
    assert solve_random_frames(seed).converged.all()


def test_every_frame_ends_at_a_minimum():
    for seed in range(60):
        assert (np.linalg.eigvalsh(solve_random_frames(seed).hessian) > 0).all()


@pytest.mark.parametrize("seed", range(4))
def test_lbfgs_from_the_same_start_finds_nothing_better(seed):
    mapping = make_mapping(seed)
    frames = make_frames(mapping, 12, missing=0.3)
    observed = Observation.of(frames, SIGMA_C)
    ours = mapping.solve(observed)
    for row, start in enumerate(mapping.start(observed)):
        one = observed[row : row + 1]

        def energy(z, one=one):
            at = mapping._expand(z[None], one)
            return at.energy[0], at.gradient[0]

        theirs = minimize(energy, start, jac=True, method="L-BFGS-B")
        assert ours.energy[row] <= theirs.fun + 1e-6


def test_a_better_start_is_taken_and_a_worse_one_is_not(mapping):
    observed = Observation.of(make_frames(mapping, 10, missing=0.3), SIGMA_C)
    plain = mapping.solve(observed)
    worse = mapping.solve(observed, np.full((10, 2), 5.0))
    again = mapping.solve(observed, plain.z)
    np.testing.assert_allclose(worse.z, plain.z, atol=1e-9)
    np.testing.assert_allclose(again.energy, plain.energy, atol=1e-7)


def test_newtons_method_begins_at_the_start_of_least_energy(mapping):
    observed = Observation.of(make_frames(mapping, 10, missing=0.3), SIGMA_C)
    solved, latents = mapping.solve(observed).z, mapping.start(observed)
    lower = mapping.energy(solved, observed) < mapping.energy(latents, observed)
    assert lower.all()
    for starts in ([solved], [np.full((10, 2), 5.0), solved]):
        np.testing.assert_array_equal(mapping._best_start(observed, starts), solved)
    np.testing.assert_array_equal(mapping._best_start(observed, []), latents)
    np.testing.assert_array_equal(mapping._best_start(observed, [np.full((10, 2), 5.0)]), latents)


def test_the_pull_of_the_previous_frame_goes_from_nothing_to_everything(mapping):
    frames, previous = make_frames(mapping, 5), make_frames(mapping, 5, seed=7)
    observed = Observation.of(frames, SIGMA_C)
    alone = mapping.solve(observed).x
    free = mapping.solve(observed.following(previous, 1e6)).x
    bound = mapping.solve(observed.following(previous, 1e-6)).x
    np.testing.assert_allclose(free, alone, atol=1e-6)
    np.testing.assert_allclose(bound, previous, atol=1e-6)
    distances = [
        np.linalg.norm(mapping.solve(observed.following(previous, sigma_t)).x - previous)
        for sigma_t in (1.0, 0.3, 0.1, 0.03)
    ]
    assert (np.diff(distances) < 0).all()


def test_the_previous_frame_stands_in_for_what_was_not_seen(mapping):
    previous = make_frames(mapping, 3)
    nothing = Observation.of(np.full_like(previous, np.nan), SIGMA_C)
    observed = nothing.following(previous, SIGMA_T)
    np.testing.assert_allclose(observed.mean, previous)
    np.testing.assert_allclose(observed.variance, SIGMA_T**2)


def test_observations_and_the_previous_frame_are_weighed_by_their_precisions():
    observed = Observation.of(np.array([[1.0]]), 0.1).following(np.array([[0.0]]), 0.2)
    assert observed.mean[0, 0] == pytest.approx(0.8)
    assert observed.variance[0, 0] == pytest.approx(1 / (100 + 25))


def test_what_was_filled_in_is_as_uncertain_as_it_is_said_to_be():
    """Beside the noise of a measurement, and what was not seen stays unknown."""
    frame, filled = np.array([[1.0, 2.0, np.nan]]), np.array([[0.0, 0.5, np.nan]])
    observed = Observation.of(frame, 0.1, filled)
    np.testing.assert_allclose(observed.variance, [[0.01, 0.51, np.inf]])

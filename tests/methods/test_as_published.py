"""The shared models keep to the paper's equations from the start of training to a stream.

Everything is compared with the equations of Bouaziz and Pauly (2014), written out here once more.
"""

from __future__ import annotations

from copy import copy

import numpy as np
import pytest
import torch
from sklearn.manifold._locally_linear import barycenter_kneighbors_graph

import facert
from facert.methods import shared_gplvm
from facert.methods.base import Labelled, Unlabelled
from facert.methods.registry import make_method
from facert.settings import Settings

LABELLED, ALONE, LATENT, NEIGHBOURS = 9, 14, 2, 5


@pytest.fixture(scope="module")
def data():
    """Two noisy views of points in the plane."""
    rng = np.random.default_rng(0)
    latent = rng.normal(size=(LABELLED + 2 * ALONE, 2))
    X, Y = (np.tanh(latent @ rng.normal(size=(2, d))) for d in (9, 5))
    X, Y = (U + 0.1 * rng.normal(size=U.shape) for U in (X, Y))
    frames, poses = slice(LABELLED, LABELLED + ALONE), slice(LABELLED + ALONE, None)
    return Labelled(X[:LABELLED], Y[:LABELLED]), Unlabelled(X[frames], Y[poses])


@pytest.fixture(scope="module", params=["ssgplvm", "sgplvm"])
def trained(request, data):
    """A method after some iterations, and the report of its training."""
    return fitted(data, request.param)


@pytest.fixture(scope="module")
def method(trained):
    return trained[0]


def fitted(data, method, iterations=25):
    options = {"latent_dim": LATENT, "neighbours": NEIGHBOURS, "max_iterations": iterations}
    made = make_method(Settings(method=method, **options))
    return made, made.fit(*data)


def views(data, method):
    """X and Y that a method learns from, labelled rows first."""
    labelled, unlabelled = data
    if method.supervised:
        return labelled.X, labelled.Y
    return np.vstack([labelled.X, unlabelled.X]), np.vstack([labelled.Y, unlabelled.Y])


def constraints(X, Y):
    """M, Eq. (6)."""

    def residuals(U):
        C = barycenter_kneighbors_graph(U, n_neighbors=NEIGHBOURS, reg=1e-3).toarray()
        return np.eye(len(U)) - C

    R_X, R_Y = residuals(X), residuals(Y)
    left = np.vstack([R_X[:, :LABELLED], R_Y[:, :LABELLED]])
    of_X = np.vstack([R_X[:, LABELLED:], np.zeros((len(Y), len(X) - LABELLED))])
    of_Y = np.vstack([np.zeros((len(X), len(Y) - LABELLED)), R_Y[:, LABELLED:]])
    return np.hstack([left, of_X, of_Y])


def eye(size):
    return torch.eye(size, dtype=torch.float64)


def minus_log_likelihood(Z, U, log_kernel, floor):
    """Minus the logarithm of Eq. (1) or (2)."""
    theta1, theta2, excess = log_kernel.exp()
    squared = (Z[:, None] - Z).square().sum(-1)
    K = theta1 * torch.exp(-theta2 / 2 * squared) + (floor + excess) * eye(len(Z))  # (3)
    U = torch.from_numpy(U)
    data = torch.trace(torch.linalg.solve(K, U @ U.T))
    return 0.5 * (U.shape[1] * torch.logdet(2 * np.pi * K) + data)


def test_what_is_minimised_is_equation_4_with_the_prior_of_equation_5(data, trained):
    """Its value where training ends, and the length of its gradient there."""
    method, report = trained
    X, Y = views(data, method)
    Z = np.vstack([method.source_.Z, method.target_.Z[LABELLED:]])
    M = np.zeros((1, len(Z))) if method.supervised else constraints(X, Y)
    Z, L = torch.from_numpy(Z).requires_grad_(), torch.from_numpy(M.T @ M + np.eye(len(Z)))
    floors = method.settings.source_noise_floor, method.settings.target_noise_floor
    logs = [
        torch.from_numpy(view.kernel.to_log(floor)).requires_grad_()
        for view, floor in zip((method.source_, method.target_), floors, strict=True)
    ]
    latents = Z[: len(X)], torch.vstack([Z[:LABELLED], Z[len(X) :]])
    prior = 0.5 * torch.trace(Z.T @ L @ Z) - 0.5 * LATENT * torch.logdet(L / (2 * np.pi))  # (5)
    energy = prior + sum(map(minus_log_likelihood, latents, (X, Y), logs, floors))
    gradient = torch.autograd.grad(energy, (Z, *logs))
    length = torch.cat([part.ravel() for part in gradient]).norm().item()
    assert report.result.value == pytest.approx(energy.item(), rel=1e-9)
    assert report.result.gradient_norm == pytest.approx(length, rel=1e-6)
    local = torch.trace(Z.T @ (L - eye(len(Z))) @ Z)  # of the reconstruction alone
    assert method.supervised or local > 0.01


@pytest.fixture
def begun(data, monkeypatch):
    """The latent coordinates at which a method begins to train, and the tolerance."""

    def of(method):
        found = []

        def note(module, *given, **options):
            found.append((module.Z.detach().numpy().copy(), options["tolerance"]))
            return train(module, *given, **options)

        train = shared_gplvm.train
        monkeypatch.setattr(shared_gplvm, "train", note)
        return fitted(data, method, iterations=1)[0], *found[0]

    return of


def test_the_supervised_model_begins_at_the_principal_components_of_both_views(data, begun):
    method, Z, _ = begun("sgplvm")
    joined = np.hstack(views(data, method))
    joined -= joined.mean(axis=0)
    variances, axes = np.linalg.eigh(joined.T @ joined / len(joined))
    components = joined @ axes[:, : -LATENT - 1 : -1] / np.sqrt(variances[-1])
    np.testing.assert_allclose(np.abs(Z), np.abs(components), atol=1e-9)
    np.testing.assert_allclose(Z @ Z.T, components @ components.T, atol=1e-9)


def test_the_semi_supervised_model_begins_at_the_alignment_of_both_views(data, begun):
    """Ham, Lee and Saul (2005): the eigenvectors of MᵀM after the constant one."""
    method, Z, tolerance = begun("ssgplvm")
    assert tolerance == method.settings.tolerance
    M = constraints(*views(data, method))
    values, vectors = np.linalg.eigh(M.T @ M)
    assert values[0] < 1e-9 < values[1]
    expected = vectors[:, 1 : LATENT + 1] * np.sqrt(len(Z))
    np.testing.assert_allclose(np.abs(Z), np.abs(expected), atol=1e-6)


def equation_12(view, x, z, frame, before, sigmas):
    """Minus its logarithm for a frame and the x* of the one before."""
    Z, X = torch.from_numpy(view.Z), torch.from_numpy(view.X)
    theta1, theta2, theta3 = view.kernel.theta
    k = theta1 * torch.exp(-theta2 / 2 * (z - Z).square().sum(1))
    K = theta1 * torch.exp(-theta2 / 2 * (Z[:, None] - Z).square().sum(-1))
    solved = torch.linalg.solve(K + eye(len(Z)) / theta3, k)
    mean, variance = X.T @ solved, theta1 + 1 / theta3 - k @ solved  # (16), (17)
    seen = torch.from_numpy(~np.isnan(frame))
    (sigma_c, sigma_t), frame = sigmas, torch.from_numpy(frame)
    energy = (x - frame)[seen].square().sum() / (2 * sigma_c**2)  # (13)
    energy += (x - before).square().sum() / (2 * sigma_t**2)  # (14)
    energy += (x - mean).square().sum() / (2 * variance) + len(x) * variance.log() / 2  # (15)
    return energy + 0.5 * z @ z


def test_a_frame_of_a_stream_minimises_equation_12_with_the_pull_of_the_frame_before(method):
    """It is flat at x* and z*, hidden dimensions included."""
    changed, rng = copy(method), np.random.default_rng(1)
    sigmas = method.settings.sigma_c, 2.0 * method.settings.sigma_c
    changed.settings = method.settings.with_changes({"sigma_t": sigmas[1]})
    frames = method.source_.X[:5] + 0.2 * rng.normal(size=(5, method.source_.columns))
    frames[1:, 2] = np.nan
    stream = changed.stream()
    before = torch.from_numpy(stream.step(frames[:1]).X[0])
    for frame in frames[1:]:
        x = torch.from_numpy(stream.step(frame[None]).X[0]).requires_grad_()
        z = torch.from_numpy(stream.previous.z[0]).requires_grad_()
        energy = equation_12(method.source_, x, z, frame, before, sigmas)
        dx, dz = torch.autograd.grad(energy, (x, z))
        assert (x - before).abs().max() > 0.1
        assert dx.abs().max() < 1e-8
        assert dz.abs().max() < 0.02
        before = x.detach()


@pytest.mark.parametrize(("name", "alone"), [("ssgplvm", 100), ("sgplvm", 0)])
def test_by_default_a_hundred_frames_and_a_hundred_poses_are_learned_from_beside_the_labels(
    make_take, name, alone
):
    """As in the paper's evaluation: "100 unlabelled data points for both observation spaces"."""
    take = make_take(frames=180, posed=6, animation=140)
    settings = Settings(method=name, max_iterations=1, smooth=False, latent_dim=2)
    trained = facert.train(take, settings).method
    assert len(trained.source_.X) == len(trained.target_.X) == 6 + alone

"""The shared GPLVM as a retargeting method: semi-supervised (the paper's) and supervised."""

from __future__ import annotations

import hashlib
import logging
import math
from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from scipy.sparse import csr_array

from facert.data import FloatArray
from facert.errors import InputError
from facert.gp.kernel import Kernel
from facert.gp.posterior import Posterior
from facert.gplvm.alignment import align, principal_components
from facert.gplvm.lle import constraint_matrix
from facert.gplvm.module import SharedGPLVM
from facert.gplvm.noise import with_noise
from facert.gplvm.source_mapping import Mapped, Observation, SourceMapping
from facert.gplvm.target_mapping import map_to_target
from facert.gplvm.training import train
from facert.methods.base import Labelled, Prediction, Report, Stream, Unlabelled
from facert.methods.device import find_device
from facert.optim.base import Optimiser
from facert.optim.lbfgs import LBFGS
from facert.optim.monitor import Monitor
from facert.optim.scg import SCG
from facert.settings import OptimiserName, Settings
from facert.threads import threads_for

log = logging.getLogger(__name__)

OPTIMISERS: dict[OptimiserName, type[LBFGS] | type[SCG]] = {"lbfgs": LBFGS, "scg": SCG}


class SemiSupervisedSGPLVM:
    """Bouaziz and Pauly (2014): labelled frames, the rest of the take, and old animation.

    Parameters
    ----------
    settings : Settings
        Latent dimension, neighbours, noise, optimiser, device. `fit` fills in the noise of the
        source where it is left open.
    """

    most_unlabelled: ClassVar[int | None] = 100  # more have not been seen to help
    stepwise: ClassVar[bool] = True

    def __init__(self, settings: Settings) -> None:
        self.settings = self._given = settings

    @property
    def dimensions(self) -> tuple[int, int]:
        """d_x and d_y of what it was trained on."""
        return self.source_.X.shape[1], self.target_.X.shape[1]

    def fit(
        self, labelled: Labelled, unlabelled: Unlabelled, monitor: Monitor | None = None
    ) -> Report:
        """Train the model, Eq. (4), from the alignment of both views.

        Parameters
        ----------
        labelled, unlabelled : Labelled, Unlabelled
            Normalised and complete.
        monitor : Monitor, optional
            Watches the iterations and keeps checkpoints.
        """
        X, Y = np.vstack([labelled.X, unlabelled.X]), np.vstack([labelled.Y, unlabelled.Y])
        count = len(labelled.X)
        self.settings = with_noise(self._given, X)
        with threads_for(len(X) + len(Y) - count):
            module = self._initial_module(X, Y, count)
            result = train(
                module.to(find_device(self.settings.device)),
                self._optimiser(),
                tolerance=self.settings.tolerance,
                max_iterations=self.settings.max_iterations,
                checkpoint_every=self.settings.checkpoint_every,
                fingerprint=_fingerprint(X, Y, self.settings),
                monitor=monitor or Monitor(),
            )
            self._set_views(
                Posterior(module.latents_x, X, module.kernel_x),
                Posterior(module.latents_y, Y, module.kernel_y),
            )
        return Report(result, self._figures(labelled))

    def predict(self, frames: FloatArray) -> Prediction:
        """Map frames (T, d_x), each on its own; NaN: not observed."""
        with threads_for(len(self.source_.Z)):
            return self._to_target(self.mapping_.solve(self._observed(frames)))

    def stream(self) -> Stream:
        """Begin to map frames one after the other, with the temporal term of Eq. (14)."""
        return _SharedStream(self)

    def save(self) -> dict[str, FloatArray]:
        """Both trained views: latent coordinates, observations, kernel parameters."""
        arrays: dict[str, FloatArray] = {}
        for view, posterior in (("source", self.source_), ("target", self.target_)):
            kernel = posterior.kernel
            arrays[f"{view}.latents"] = posterior.Z
            arrays[f"{view}.observations"] = posterior.X
            arrays[f"{view}.kernel"] = np.array(
                [kernel.variance, kernel.inverse_width, kernel.noise]
            )
        return arrays

    def load(self, arrays: Mapping[str, FloatArray]) -> None:
        """Take over what `save` returned.

        Raises
        ------
        InputError
            When an array is absent or the shapes do not fit together.
        """
        if self.settings.sigma_c is None:
            raise InputError("settings", "a number as sigma_c", "none", _DAMAGED)
        views = [_view(arrays, name) for name in ("source", "target")]
        if views[0].Z.shape[1] != views[1].Z.shape[1]:
            dimensions = [view.Z.shape[1] for view in views]
            raise InputError(
                "target.latents", f"{dimensions[0]} dimensions", f"{dimensions[1]}", _DAMAGED
            )
        self._set_views(*views)

    def _set_views(self, source: Posterior, target: Posterior) -> None:
        self.source_, self.target_ = source, target
        self.mapping_ = SourceMapping(source)

    def _observed(self, frames: FloatArray) -> Observation:
        assert self.settings.sigma_c is not None  # filled in by fit, checked by load
        return Observation.of(frames, self.settings.sigma_c)

    def _to_target(self, mapped: Mapped) -> Prediction:
        if not mapped.converged.all():
            log.warning("%d frames did not converge", int((~mapped.converged).sum()))
        mean, std = map_to_target(self.target_, mapped)
        return Prediction(mean, std, mapped.x)

    def _initial_module(self, X: FloatArray, Y: FloatArray, labelled: int) -> SharedGPLVM:
        points = len(X) + len(Y) - labelled
        latent_dim = min(self.settings.latent_dim, points - 1)
        if latent_dim < self.settings.latent_dim:
            log.warning("%d points carry only %d latent dimensions", points, latent_dim)
        M, Z = self._prior_and_start(X, Y, labelled, latent_dim)
        floor_x, floor_y = self.settings.source_noise_floor, self.settings.target_noise_floor
        assert floor_x is not None  # filled in before
        return SharedGPLVM(X, Y, labelled, M, Z, floor_x, floor_y)

    def _prior_and_start(
        self, X: FloatArray, Y: FloatArray, labelled: int, latent_dim: int
    ) -> tuple[csr_array | None, FloatArray]:
        """Constraints of the latent prior, Eq. (6), and latents that satisfy them best."""
        M = constraint_matrix(X, Y, labelled, self.settings.neighbours)
        return M, align(M, latent_dim)

    def _optimiser(self) -> Optimiser:
        return OPTIMISERS[self.settings.optimizer]()

    def _figures(self, labelled: Labelled) -> dict[str, float]:
        figures: dict[str, float] = {
            "unlabelled frames": len(self.source_.X) - len(labelled.X),
            "unlabelled poses": len(self.target_.X) - len(labelled.X),
            "sigma_c": self.settings.sigma_c or math.nan,
        }
        for view, posterior in (("source", self.source_), ("target", self.target_)):
            for index, value in enumerate(posterior.kernel.theta, start=1):
                figures[f"{view} theta{index}"] = value
        residual = self.predict(labelled.X).Y - labelled.Y
        figures["training reconstruction"] = float(np.sqrt(np.mean(residual**2)))
        return figures


class SupervisedSGPLVM(SemiSupervisedSGPLVM):
    """Ek (2009): the labelled frames alone, with P(Z) = N(0, I), begun at principal components."""

    def fit(
        self, labelled: Labelled, unlabelled: Unlabelled, monitor: Monitor | None = None
    ) -> Report:
        """Train on the labelled frames; the unlabelled data is not used."""
        nothing = Unlabelled(unlabelled.X[:0], unlabelled.Y[:0])
        return super().fit(labelled, nothing, monitor)

    def _prior_and_start(
        self,
        X: FloatArray,
        Y: FloatArray,
        labelled: int,  # noqa: ARG002  all rows are
        latent_dim: int,
    ) -> tuple[csr_array | None, FloatArray]:
        return None, principal_components(np.hstack([X, Y]), latent_dim)


class _SharedStream:
    def __init__(self, method: SemiSupervisedSGPLVM) -> None:
        self.method = method
        self.previous: Mapped | None = None

    def step(self, frame: FloatArray) -> Prediction:
        """Map one more frame (1, d_x)."""
        observed = self.method._observed(frame)
        starts = []
        if self.previous is not None:
            observed = observed.following(self.previous.x, self.method.settings.sigma_t)
            starts.append(self.previous.z)
        self.previous = self.method.mapping_.solve(observed, *starts)
        return self.method._to_target(self.previous)


def _fingerprint(X: FloatArray, Y: FloatArray, settings: Settings) -> str:
    """What a checkpoint must agree with; rounded, so that another machine agrees as well."""
    digest = hashlib.sha256()
    for array in (X, Y):
        digest.update((np.round(array, 6) + 0.0).tobytes())  # no -0.0
    shaping = (
        settings.method,
        settings.latent_dim,
        settings.neighbours,
        round(settings.source_noise_floor or 0.0, 6),
        settings.target_noise_floor,
        settings.optimizer,
        settings.checkpoint_every,
        X.shape,
        Y.shape,
    )
    digest.update(repr(shaping).encode())
    return digest.hexdigest()


def _view(arrays: Mapping[str, FloatArray], name: str) -> Posterior:
    def array(part: str, ndim: int) -> FloatArray:
        key = f"{name}.{part}"
        value = arrays.get(key)
        if value is None or value.ndim != ndim or not value.size:
            found = "nothing" if value is None else f"shape {value.shape}"
            raise InputError(key, f"an array of {ndim} dimensions", found, _DAMAGED)
        return value

    Z, X, theta = array("latents", 2), array("observations", 2), array("kernel", 1)
    if len(Z) != len(X):
        raise InputError(f"{name}.latents", f"{len(X)} rows", f"{len(Z)}", _DAMAGED)
    if theta.shape != (3,) or not (theta > 0).all():
        raise InputError(f"{name}.kernel", "three positive numbers", f"{theta}", _DAMAGED)
    return Posterior(Z, X, Kernel(*theta.tolist()))


_DAMAGED = "The model file is damaged: train it again."

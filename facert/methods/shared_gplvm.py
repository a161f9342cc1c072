"""The shared GPLVM as a retargeting method: semi-supervised (the paper's) and supervised.

Small sets are trained exactly, as in the paper. Of large ones a core is, and the others are then
joined to it (`facert.models.gplvm.staging`) in a model with inducing latents, in which they weigh
no more than a hundred rows of each view (`facert.models.gplvm.sparse_view`): as every row counts
alike in the exact model, hundreds without a partner overrule the labels, and the error rises.
"""

from __future__ import annotations

import hashlib
import logging
import math
from collections.abc import Iterator, Mapping
from copy import copy
from dataclasses import dataclass, replace
from functools import partial
from typing import ClassVar, Literal, Self

import numpy as np

from facert.data.array_group import DAMAGED, Shaped, require_known_arrays
from facert.data.arrays import FloatArray, rms
from facert.data.memory import FLOAT, require_memory
from facert.data.normalisation import Normalisation
from facert.errors import InputError
from facert.methods.base import (
    Labelled,
    Method,
    Prediction,
    Stream,
    TrainingReport,
    Unlabelled,
    stacked,
)
from facert.methods.noise import with_noise
from facert.methods.views import view_arrays, view_from, view_sizes
from facert.models.device import find_device
from facert.models.gp.posterior import Predictor
from facert.models.gp.sparse import ApproximationName
from facert.models.gplvm.fitting import train
from facert.models.gplvm.frame_mapping import FrameMapping
from facert.models.gplvm.initial_latents import align, principal_components
from facert.models.gplvm.lle import constraint_matrix, view_rows
from facert.models.gplvm.module import GaussianView, SharedGPLVM
from facert.models.gplvm.scale_free import ScaleFree
from facert.models.gplvm.source_mapping import CHUNK, Mapped, Observation, SourceMapping
from facert.models.gplvm.sparse_view import SparseView, inducing_rows, row_weights
from facert.models.gplvm.staging import Core, TrainedViews
from facert.models.gplvm.target_mapping import map_to_target
from facert.models.kernels import kernel_class
from facert.models.optim.conditioned import Conditioned
from facert.models.optim.lbfgs import LBFGS
from facert.models.optim.monitor import Monitor
from facert.models.optim.optimiser import Result
from facert.models.optim.scg import SCG
from facert.models.threads import threads_for
from facert.settings import OptimiserName, Settings

log = logging.getLogger(__name__)

SOONER = 10_000.0
"""The tolerance of a search that begins at a trained model is so much larger. After another label
the error on other frames no longer changes then, while the objective still creeps (see
`experiments.another_label`)."""
JOINED = 100.0
"""The same of the search for all rows of a large set, which begins at its trained core."""
OPTIMISERS: dict[OptimiserName, type[LBFGS] | type[SCG]] = {"lbfgs": LBFGS, "scg": SCG}


ChosenLikelihood = Literal["exact", ApproximationName]


@dataclass(frozen=True)
class _Run:
    """What identifies a training run, and who watches it."""

    fingerprint: str
    monitor: Monitor


class SemiSupervisedSGPLVM:
    """Bouaziz and Pauly (2014): labelled frames, the rest of the take, and old animation.

    Parameters
    ----------
    settings : Settings
        Latent dimension, neighbours, noise, likelihood, optimiser, device. `fit` fills in the noise
        of the source where it is left open.
    """

    most_unlabelled: ClassVar[int | None] = 100  # more do no harm, help little and take time
    stepwise: ClassVar[bool] = True
    supervised: ClassVar[bool] = False
    """Whether the labelled frames alone are used, and P(Z) is standard normal."""

    def __init__(self, settings: Settings) -> None:
        self.settings = self._given = settings
        self._kernels = (
            kernel_class(settings.source_kernel, "source_kernel"),
            kernel_class(settings.target_kernel, "target_kernel"),
        )
        self._begin: TrainedViews | None = None

    @property
    def dimensions(self) -> tuple[int, int]:
        """d_x and d_y of the training data."""
        return self.source_.columns, self.target_.columns

    def begin_at(self, other: Method, source: Normalisation, target: Normalisation) -> None:
        """Let `fit` begin at latents and kernels of a trained model; see `WarmStart.begin_at`."""
        assert isinstance(other, SemiSupervisedSGPLVM)
        self._begin = TrainedViews(other.source_, other.target_, source, target)

    def fit(
        self, labelled: Labelled, unlabelled: Unlabelled, monitor: Monitor | None = None
    ) -> TrainingReport:
        """Train the model, Eq. (4), from the alignment of both views or from another model.

        Parameters
        ----------
        labelled, unlabelled : Labelled, Unlabelled
            Normalised and complete.
        monitor : Monitor, optional
            Follows the iterations and keeps checkpoints.
        """
        if self.supervised:
            unlabelled = Unlabelled(unlabelled.X[:0], unlabelled.Y[:0])
        X, Y = stacked(labelled, unlabelled)
        count = len(labelled.X)
        self.settings = with_noise(self._given, X)
        device = find_device(self.settings.device)
        likelihood = self._likelihood(X, Y, count)
        sparse = likelihood != "exact"
        with threads_for(self.settings.inducing if sparse else len(X) + len(Y) - count):
            run = _Run(_fingerprint(X, Y, self.settings), monitor or Monitor())
            module = self._module(X, Y, count, likelihood, run).to(device)
            result = self._train(module, run)
            self._set_views(*module.posteriors())
        residual = self.predict(labelled.X).Y - labelled.Y
        errors = {"training reconstruction": rms(residual)}
        return TrainingReport(result, self._figures(unlabelled), errors)

    def predict(self, frames: FloatArray, input_variance: FloatArray | None = None) -> Prediction:
        """Map frames (T, d_x), each on its own; NaN: not observed. See `Method.predict`."""
        with threads_for(len(self.source_.Z)):
            return self._to_target(self.mapping_.solve(self._observed(frames, input_variance)))

    def on(self, device: str) -> Self:
        """A copy that maps batches on a device; see `Method.on`."""
        found = find_device(device)
        if found.type == "cpu":
            return self
        there = copy(self)
        there.mapping_ = SourceMapping(self.source_.on(found))
        there.to_poses_ = partial(map_to_target, self.target_.on(found))
        return there

    def unclipped(self) -> Self:
        """Return the method itself, which has no limits; see `Method.unclipped`."""
        return self

    def stream(self) -> Stream:
        """Begin to map frames one after the other, with the temporal term of Eq. (14)."""
        return _SharedStream(self)

    def save(self) -> dict[str, FloatArray]:
        """The arrays of both trained views, see `facert.methods.views`."""
        return view_arrays(self.source_, "source") | view_arrays(self.target_, "target")

    def check(self, arrays: Mapping[str, Shaped]) -> tuple[int, int]:
        """Dimensions d_x and d_y of arrays that `load` could take over; see `Method.check`."""
        require_known_arrays(
            arrays, [name for name in arrays if name.startswith(("source.", "target."))]
        )
        source, target = (view_sizes(arrays, view) for view in ("source", "target"))
        if target["q"] != source["q"]:
            expected, found = f"{source['q']} dimensions", f"{target['q']}"
            raise InputError("target.latents", expected, found, DAMAGED)
        steps = CHUNK * source["q"] * sum(source.values())  # of Newton's method on a batch
        require_memory(FLOAT * steps, "source.latents")
        return source["d"], target["d"]

    def load(self, arrays: Mapping[str, FloatArray]) -> None:
        """Take over what `save` returned.

        Raises
        ------
        InputError
            When an array is absent or the shapes do not fit together.
        """
        self.check(arrays)
        if self.settings.sigma_c is None or self.settings.sigma_t is None:
            raise InputError("settings", "numbers as sigma_c and sigma_t", "none", DAMAGED)
        source, target = map(view_from, (arrays, arrays), ("source", "target"), self._kernels)
        self._set_views(source, target)

    def _set_views(self, source: Predictor, target: Predictor) -> None:
        self.source_, self.target_ = source, target
        self.frame_mapping_ = FrameMapping(source)
        self.mapping_: SourceMapping = self.frame_mapping_
        self.to_poses_ = partial(map_to_target, target)

    def _observed(self, frames: FloatArray, input_variance: FloatArray | None) -> Observation:
        assert self.settings.sigma_c is not None  # filled in by fit, checked by load
        return Observation.of(frames, self.settings.sigma_c, input_variance)

    def _to_target(self, mapped: Mapped) -> Prediction:
        if not mapped.converged.all():
            log.warning("%d frames did not converge", int((~mapped.converged).sum()))
        mean, std = self.to_poses_(mapped)
        return Prediction(mean, std, mapped.x)

    def _module(
        self, X: FloatArray, Y: FloatArray, labelled: int, likelihood: ChosenLikelihood, run: _Run
    ) -> SharedGPLVM:
        """Build the model to be trained, at its initial parameters.

        They are those of the model to begin at. Without one, a small model begins at the alignment
        of both views, and a large one at a small one.
        """
        latent_dim = self._latent_dim(len(X) + len(Y) - labelled)
        if self._begin is not None and self._begin.latent_dim != latent_dim:
            log.info("more data carries more latent dimensions: training begins anew")
            self._begin = None
        begin = self._begin
        if begin is None and likelihood != "exact":
            begin = self._trained_core(X, Y, labelled, run)
        M = None
        if not self.supervised:
            M = constraint_matrix(X, Y, labelled, self.settings.neighbours)  # Eq. (6)
        if begin is not None:
            Z = begin.latents(X, Y, labelled)
        elif M is not None:
            Z = align(M, latent_dim)
        else:
            Z = principal_components(np.hstack([X, Y]), latent_dim)
        source, target = self._views(X, Y, labelled, Z, likelihood)
        if begin is not None:
            source.begin_with(begin.kernels[0])
            target.begin_with(begin.kernels[1])
        return SharedGPLVM(source, target, M, Z)

    def _views(
        self, X: FloatArray, Y: FloatArray, labelled: int, Z: FloatArray, chosen: ChosenLikelihood
    ) -> Iterator[GaussianView]:
        """The source view and the target view."""
        assert self.settings.source_noise_floor is not None  # filled in before
        floors = self.settings.source_noise_floor, self.settings.target_noise_floor
        rows = view_rows(labelled, len(X) - labelled, len(Y) - labelled)
        for view in zip((X, Y), rows, floors, self._kernels, strict=True):
            if chosen == "exact":
                yield GaussianView(*view)
            else:
                inducing = Z[view[1][inducing_rows(len(view[1]), labelled, self.settings.inducing)]]
                yield SparseView(*view, inducing, row_weights(len(view[1]), labelled), chosen)

    def _trained_core(self, X: FloatArray, Y: FloatArray, labelled: int, run: _Run) -> TrainedViews:
        core = Core.of(X, Y, labelled)
        X, Y = X[core.rows_x], Y[core.rows_y]
        small = self._module(X, Y, core.labelled, "exact", run)
        small = small.to(find_device(self.settings.device))
        phase = replace(run, fingerprint=f"{run.fingerprint}:core")
        if self._train(small, phase).status == "interrupted":  # there is no model to keep
            raise KeyboardInterrupt
        return TrainedViews.at(*small.posteriors())

    def _likelihood(self, X: FloatArray, Y: FloatArray, labelled: int) -> ChosenLikelihood:
        """The likelihood that is set; ``"auto"`` is exact while the data is no more than a core."""
        if self.settings.likelihood != "auto":
            return self.settings.likelihood
        return "exact" if Core.of(X, Y, labelled).is_all_of(X, Y) else "vfe"

    def _latent_dim(self, points: int) -> int:
        latent_dim = min(self.settings.latent_dim, points - 1)
        if latent_dim < self.settings.latent_dim:
            log.warning("%d points carry only %d latent dimensions", points, latent_dim)
        return latent_dim

    def _train(self, module: SharedGPLVM, run: _Run) -> Result:
        result = train(
            ScaleFree(module),
            Conditioned(OPTIMISERS[self.settings.optimizer]()),
            tolerance=self.settings.tolerance * self._patience(module),
            max_iterations=self.settings.max_iterations,
            checkpoint_every=self.settings.checkpoint_every,
            checkpoint_seconds=self.settings.checkpoint_seconds,
            fingerprint=run.fingerprint,
            monitor=run.monitor,
            magnitude=float(module.entries),
        )
        module.rescale()
        return replace(result, gradient_norm=module.gradient_norm())

    def _patience(self, module: SharedGPLVM) -> float:
        """How many times the tolerance a search ends at."""
        if self._begin is not None:
            return SOONER
        return JOINED if isinstance(module.source, SparseView) else 1.0

    def _figures(self, unlabelled: Unlabelled) -> dict[str, float]:
        figures = {**unlabelled.counts, "sigma_c": self.settings.sigma_c or math.nan}
        for view, posterior in (("source", self.source_), ("target", self.target_)):
            for index, value in enumerate(posterior.kernel.theta, start=1):
                figures[f"{view} theta{index}"] = value
        return figures


class SupervisedSGPLVM(SemiSupervisedSGPLVM):
    """Ek (2009): the labelled frames alone, with P(Z) = N(0, I), begun at principal components."""

    supervised = True


class _SharedStream:
    def __init__(self, method: SemiSupervisedSGPLVM) -> None:
        self.method = method
        self.previous: Mapped | None = None

    def step(self, frame: FloatArray, input_variance: FloatArray | None = None) -> Prediction:
        """Map one more frame (1, d_x)."""
        observed = self.method._observed(frame, input_variance)
        mapping = self.method.frame_mapping_
        if self.previous is None:
            self.previous = mapping.solve(observed)
        else:
            sigma_t = self.method.settings.sigma_t
            assert sigma_t is not None  # filled in by fit, checked by load
            observed = observed.following(self.previous.x, sigma_t)
            self.previous = mapping.follow(observed, self.previous.z, self.previous.linearised)
        return self.method._to_target(self.previous)


def _fingerprint(X: FloatArray, Y: FloatArray, settings: Settings) -> str:
    """A digest that a checkpoint must agree with; rounded, so that other machines agree as well."""
    digest = hashlib.sha256()
    for array in (X, Y):
        digest.update((np.round(array, 6) + 0.0).tobytes())  # no -0.0
    shaping = (
        settings.method,
        settings.latent_dim,
        settings.source_kernel,
        settings.target_kernel,
        settings.neighbours,
        round(settings.source_noise_floor or 0.0, 6),
        settings.target_noise_floor,
        settings.optimizer,
        settings.likelihood,
        settings.inducing,
        settings.checkpoint_every,
        X.shape,
        Y.shape,
    )
    digest.update(repr(shaping).encode())
    return digest.hexdigest()

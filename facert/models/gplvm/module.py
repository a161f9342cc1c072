"""The shared Gaussian process latent variable model as a torch module, Eqs. (1) to (6)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import torch
from scipy import sparse
from torch import Tensor, nn

from facert.data.arrays import FloatArray, IntArray
from facert.models.closed_form import closed_form
from facert.models.gp.curvature import likelihood_hessian
from facert.models.gp.likelihood import compact_factor, negative_log_likelihood
from facert.models.gp.posterior import Posterior, Predictor
from facert.models.gplvm.prior import latent_precision, product
from facert.models.kernels import Kernel, SquaredExponential, initial_log_kernel


class GaussianView(nn.Module):
    """The source or the target as a Gaussian process over the latent coordinates, Eq. (1) or (2).

    Its trainable tensor is ``log_kernel``: (log θ1, log θ2, log of the noise above the floor).

    Parameters
    ----------
    observations : array, shape (n, d)
        Normalised.
    rows : array of int, shape (n,)
        The latent coordinates that belong to them.
    noise_floor : float
        Least noise variance, in units of the normalised observations.
    kernel : subclass of Kernel
    """

    factor: Tensor
    rows: Tensor

    def __init__(
        self,
        observations: FloatArray,
        rows: IntArray,
        noise_floor: float,
        kernel: type[Kernel] = SquaredExponential,
    ) -> None:
        super().__init__()
        self.observations, self.noise_floor, self.kernel_type = observations, noise_floor, kernel
        self.columns = observations.shape[1]
        self.log_kernel = nn.Parameter(torch.from_numpy(initial_log_kernel()))
        self.register_buffer("factor", compact_factor(torch.from_numpy(np.array(observations))))
        self.register_buffer("rows", torch.from_numpy(rows))

    def value_and_gradient(self, Z: Tensor) -> tuple[Tensor, ...]:
        """Minus the log-likelihood, with its gradient in Z (n, q) and in the view's parameters."""
        return negative_log_likelihood(
            Z,
            self.log_kernel.detach(),
            self.factor,
            self.columns,
            self.noise_floor,
            self.kernel_type,
        )

    def begin_with(self, kernel: Kernel) -> None:
        """Take over the parameters of a trained kernel, in the units of this view."""
        with torch.no_grad():
            self.log_kernel.copy_(torch.from_numpy(kernel.to_log(self.noise_floor)))

    def follow_scale(self, scale: float) -> None:
        """Stay the same process while the latents are divided by `scale`."""
        with torch.no_grad():
            self.log_kernel[1] += 2.0 * math.log(scale)

    def hessian(self, Z: FloatArray) -> FloatArray:
        """Second derivatives of minus the log-likelihood in Z (n, q) and the log-kernel."""
        return likelihood_hessian(
            Z,
            self.log_kernel.detach().cpu().numpy(),
            self.factor.cpu().numpy(),
            self.columns,
            self.noise_floor,
            self.kernel_type,
        )

    @property
    def kernel(self) -> Kernel:
        """The kernel with its present parameters."""
        return self.kernel_type.from_log(self.log_kernel.detach().cpu().numpy(), self.noise_floor)

    def posterior(self, latents: FloatArray) -> Predictor:
        """The process given its observations, at its latent coordinates (n, q)."""
        return Posterior(latents, self.observations, self.kernel)


class SharedGPLVM(nn.Module):
    """Latent coordinates that a source view and a target view share.

    Rows are ordered labelled (l), source only (m), target only (n). The trainable tensors are the
    latent coordinates ``Z`` (l + m + n, q) and those of both views.

    Parameters
    ----------
    source, target : GaussianView
        Views of the rows that `facert.models.gplvm.lle.view_rows` gives.
    M : csr_array, shape (constraints, l + m + n), or None
        Reconstruction constraints of the latent prior, Eq. (6). None leaves P(Z) = N(0, I), the
        supervised model of Ek (2009).
    Z : array, shape (l + m + n, q)
        Initial latent coordinates.
    """

    precision: Tensor

    def __init__(
        self, source: GaussianView, target: GaussianView, M: sparse.csr_array | None, Z: FloatArray
    ) -> None:
        super().__init__()
        self.Z = nn.Parameter(torch.from_numpy(np.array(Z, dtype=np.float64, order="C")))
        self.source, self.target = source, target
        self.entries = source.observations.size + target.observations.size
        precision, self._prior_constant = latent_precision(M, *self.Z.shape)
        self.register_buffer("precision", precision)

    def forward(self) -> Tensor:
        """-log P(X|Z) P(Y|Z) P(Z), the objective of training, Eq. (4)."""
        return closed_form(lambda *_: self.value_and_gradient(), *self.parameters())

    def value_and_gradient(self) -> list[Tensor]:
        """The objective, Eq. (4), and its gradient in each parameter."""
        Z = self.Z.detach()
        dZ = product(self.precision, Z)
        return self._with_views(0.5 * torch.dot(Z.view(-1), dZ.view(-1)), dZ)

    def scale_free(self) -> list[Tensor]:
        """Value and gradient of the objective whose prior sees latents of mean square 1.

        See `facert.models.gplvm.scale_free`.
        """
        Z = self.Z.detach()
        square = Z.square().mean()
        dZ = product(self.precision, Z) / square
        twice = torch.dot(Z.view(-1), dZ.view(-1))
        return self._with_views(0.5 * twice, dZ - twice / (square * Z.numel()) * Z)

    def _with_views(self, exponent: Tensor, dZ: Tensor) -> list[Tensor]:
        """The prior's exponent and its gradient, with its constant and the views added."""
        Z = self.Z.detach()
        value, gradient = exponent + self._prior_constant, [dZ]
        # On the CPU NumPy takes and adds rows in half the time.
        on_cpu = Z.device.type == "cpu"
        places: Any = Z.numpy() if on_cpu else Z
        slopes: Any = dZ.numpy() if on_cpu else dZ
        for view in (self.source, self.target):
            rows = view.rows.numpy() if on_cpu else view.rows
            term, own, *others = view.value_and_gradient(torch.as_tensor(places[rows]))
            value += term
            slopes[rows] += own.numpy() if on_cpu else own
            gradient += others
        return [value, *gradient]

    def gradient_norm(self) -> float:
        """Length of the gradient of the objective, Eq. (4)."""
        _, *gradient = self.value_and_gradient()
        return math.hypot(*(float(part.norm()) for part in gradient))

    def rescale(self) -> None:
        """Bring the latents to mean square 1, and the kernels' widths with them."""
        with torch.no_grad():
            scale = self.Z.square().mean().sqrt().item()
            self.Z.div_(scale)
            for view in (self.source, self.target):
                view.follow_scale(scale)

    def latents(self, view: GaussianView) -> FloatArray:
        """Latent coordinates of a view's rows."""
        return self.Z.detach()[view.rows].cpu().numpy()

    def posteriors(self) -> tuple[Predictor, Predictor]:
        """The posteriors of both views, for source and for target mapping."""
        source, target = (view.posterior(self.latents(view)) for view in (self.source, self.target))
        return source, target

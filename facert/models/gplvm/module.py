"""The shared Gaussian process latent variable model as a torch module, Eqs. (1) to (6)."""

from __future__ import annotations

import numpy as np
import torch
from scipy import sparse
from torch import Tensor, nn

from facert.data.arrays import FloatArray
from facert.models.gp.likelihood import compact_factor, negative_log_likelihood
from facert.models.gp.posterior import Posterior, Predictor
from facert.models.gplvm.energy import View, energy
from facert.models.gplvm.prior import half_square, latent_precision
from facert.models.kernels import Kernel, SquaredExponential, initial_log_kernel


class SharedGPLVM(nn.Module):
    """Latent coordinates shared by a source view X and a target view Y.

    Rows are ordered labelled (l), source only (m), target only (n). The trainable tensors are the
    latent coordinates ``Z`` (l + m + n, q) and the log-kernel parameters of both views,
    ``log_kernel_x`` and ``log_kernel_y``: (log θ1, log θ2, log of the noise above the floor).

    Parameters
    ----------
    X : array, shape (l + m, d_x)
        Normalised source observations, labelled rows first.
    Y : array, shape (l + n, d_y)
        Normalised target observations, labelled rows first.
    labelled : int
        l, the number of rows that X and Y share.
    M : csr_array, shape (constraints, l + m + n), or None
        Reconstruction constraints of the latent prior, Eq. (6). None leaves P(Z) = N(0, I), the
        supervised model of Ek (2009).
    Z : array, shape (l + m + n, q)
        Initial latent coordinates.
    noise_floor_x, noise_floor_y : float
        Least noise variance of each view, in units of the normalised observations.
    """

    precision: Tensor
    factor_x: Tensor
    factor_y: Tensor
    rows_y: Tensor

    def __init__(
        self,
        X: FloatArray,
        Y: FloatArray,
        labelled: int,
        M: sparse.csr_array | None,
        Z: FloatArray,
        noise_floor_x: float,
        noise_floor_y: float,
    ) -> None:
        super().__init__()
        self.labelled = labelled
        self.columns_x, self.columns_y = X.shape[1], Y.shape[1]
        self.rows_x = len(X)
        self.entries = X.size + Y.size
        self.noise_floor_x, self.noise_floor_y = noise_floor_x, noise_floor_y

        self.Z = nn.Parameter(torch.from_numpy(np.array(Z, dtype=np.float64, order="C")))
        self.log_kernel_x = nn.Parameter(torch.from_numpy(initial_log_kernel()))
        self.log_kernel_y = nn.Parameter(torch.from_numpy(initial_log_kernel()))

        precision, self._prior_constant = latent_precision(M, *self.Z.shape)
        rows_y = np.r_[:labelled, len(X) : len(Z)]
        self.register_buffer("precision", precision)
        self.register_buffer("factor_x", compact_factor(torch.from_numpy(np.array(X))))
        self.register_buffer("factor_y", compact_factor(torch.from_numpy(np.array(Y))))
        self.register_buffer("rows_y", torch.from_numpy(rows_y))

    def source_energy(self) -> Tensor:
        """-log P(X|Z), Eq. (1), over labelled and source-only rows."""
        return negative_log_likelihood(
            self.Z[: self.rows_x],
            self.log_kernel_x,
            self.factor_x,
            self.columns_x,
            self.noise_floor_x,
        )

    def target_energy(self) -> Tensor:
        """-log P(Y|Z), Eq. (2), over labelled and target-only rows."""
        return negative_log_likelihood(
            self.Z[self.rows_y],
            self.log_kernel_y,
            self.factor_y,
            self.columns_y,
            self.noise_floor_y,
        )

    def prior_energy(self) -> Tensor:
        """-log P(Z), Eq. (5)."""
        return half_square(self.Z, self.precision) + self._prior_constant

    def forward(self) -> Tensor:
        """-log P(X|Z) P(Y|Z) P(Z), what training minimises, Eq. (4)."""
        if self.Z.device.type != "cpu":
            return self.sum_of_energies()
        variables, views = (self.Z, self.log_kernel_x, self.log_kernel_y), self._views()
        return energy(*variables, self.precision, *views) + self._prior_constant

    def sum_of_energies(self) -> Tensor:
        """The same, term by term."""
        return self.source_energy() + self.target_energy() + self.prior_energy()

    def _views(self) -> tuple[View, View]:
        return (
            View(slice(self.rows_x), self.factor_x.numpy(), self.columns_x, self.noise_floor_x),
            View(self.rows_y.numpy(), self.factor_y.numpy(), self.columns_y, self.noise_floor_y),
        )

    def begin_with(self, kernel_x: Kernel, kernel_y: Kernel) -> None:
        """Take over the kernels of a trained model, each in the units of its view."""
        with torch.no_grad():
            self.log_kernel_x.copy_(torch.from_numpy(kernel_x.to_log(self.noise_floor_x)))
            self.log_kernel_y.copy_(torch.from_numpy(kernel_y.to_log(self.noise_floor_y)))

    @property
    def kernel_x(self) -> Kernel:
        """The source view's kernel with its present parameters."""
        return SquaredExponential.from_log(
            self.log_kernel_x.detach().cpu().numpy(), self.noise_floor_x
        )

    @property
    def kernel_y(self) -> Kernel:
        """The target view's kernel with its present parameters."""
        return SquaredExponential.from_log(
            self.log_kernel_y.detach().cpu().numpy(), self.noise_floor_y
        )

    @property
    def latents_x(self) -> FloatArray:
        """Latent coordinates of the source view's rows, (l + m, q)."""
        return self.Z.detach()[: self.rows_x].cpu().numpy()

    @property
    def latents_y(self) -> FloatArray:
        """Latent coordinates of the target view's rows, (l + n, q)."""
        return self.Z.detach()[self.rows_y].cpu().numpy()

    def source_posterior(self, X: FloatArray) -> Predictor:
        """The source view given its observations (l + m, d_x), for source mapping."""
        return Posterior(self.latents_x, X, self.kernel_x)

    def target_posterior(self, Y: FloatArray) -> Predictor:
        """The target view given its observations (l + n, d_y), for target mapping."""
        return Posterior(self.latents_y, Y, self.kernel_y)

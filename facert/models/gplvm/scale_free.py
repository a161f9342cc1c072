"""The objective of training without the direction in which it has no minimum.

Eq. (4) leaves the scale of the latent space open. With c Z in place of Z and θ2/c² in place of both
θ2, (1) and (2) stay what they are, and the exponent of the prior (5) becomes c² tr(L Z Zᵀ)/2: a
search shrinks the latents for ever, slower and slower, and where it ends is up to its tolerance
and to rounding. Here the prior sees the latents at the scale that it expects of them, where the
mean square of a coordinate is 1:

    E(Z, Φ) = -log P(X|Z) - log P(Y|Z) + tr(L Z Zᵀ)/(2 s),      s = |Z|²/(N q),

which is the same for all c, and -log of (4) where s = 1 (but for the constant). Training minimises
E, and hands on latents with s = 1.

The search is conditioned by the Hessian. Rows that only the source shows and rows that only the
target shows do not meet in it: once both are eliminated, what is left is as large as the labels.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from torch import Tensor, nn

from facert.data.arrays import FloatArray, IntArray
from facert.models.closed_form import closed_form
from facert.models.gplvm.module import SharedGPLVM
from facert.models.gplvm.prior import product
from facert.models.gplvm.sparse_view import SparseView
from facert.models.optim.arrow import Arrow

# Latent coordinates of a view whose Hessian is kept: 50 MB a matrix
LARGEST = 2500


class ScaleFree(nn.Module):
    """E of a shared model; its parameters are the model's.

    Parameters
    ----------
    model : SharedGPLVM
    """

    def __init__(self, model: SharedGPLVM) -> None:
        super().__init__()
        self.model = model

    @property
    def Z(self) -> nn.Parameter:
        """The latent coordinates."""
        return self.model.Z

    def forward(self) -> Tensor:
        """E."""
        return closed_form(lambda *_: self.value_and_gradient(), *self.parameters())

    def value_and_gradient(self) -> Sequence[Tensor]:
        """E and its gradient in each parameter."""
        return self.model.scale_free()

    def curvature(self) -> Arrow | None:
        """The Hessian of E across the direction of scale; None of a sparse or a large model.

        Along changes of the latents that keep |Z| the prior's part is L/s - tr(L Z Zᵀ)/(s² N q) I.
        """
        model, views = self.model, (self.model.source, self.model.target)
        largest = max(view.rows.numel() for view in views) * model.Z.shape[1]
        if largest > LARGEST or any(isinstance(view, SparseView) for view in views):
            return None
        Z, rows = model.Z.detach().cpu().numpy(), [view.rows.cpu().numpy() for view in views]
        only = [np.setdiff1d(rows[0], rows[1]), np.setdiff1d(rows[1], rows[0])]
        both = np.intersect1d(rows[0], rows[1])
        shared = np.concatenate([_places(both, Z.shape[1]), Z.size + np.arange(6)])
        hessian = Arrow([_places(part, Z.shape[1]) for part in only], shared)
        prior = _prior_curvature(model, Z)
        for axis in range(Z.shape[1]):
            hessian.add(np.arange(axis, Z.size, Z.shape[1]), prior)
        for view, own, first in zip(views, rows, (0, 3), strict=True):
            places = np.concatenate([_places(own, Z.shape[1]), Z.size + first + np.arange(3)])
            hessian.add(places, view.hessian(Z[own]))
        return hessian


def _prior_curvature(model: SharedGPLVM, Z: FloatArray) -> FloatArray:
    """L/s - tr(L Z Zᵀ)/(s² N q) I, the same for each latent dimension, (N, N)."""
    square, LZ = float(np.mean(Z**2)), product(model.precision, model.Z.detach()).cpu().numpy()
    curvature: FloatArray = model.precision.to_dense().cpu().numpy() / square
    np.einsum("ii->i", curvature)[...] -= float(np.vdot(Z, LZ)) / (square**2 * Z.size)
    return curvature


def _places(rows: IntArray, latent_dim: int) -> IntArray:
    """Where the coordinates of rows stand among all of them."""
    return np.asarray((rows[:, None] * latent_dim + np.arange(latent_dim)).ravel())

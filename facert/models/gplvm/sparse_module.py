"""The shared model whose views see their frames through inducing latents, for large sets.

Eqs. (1) and (2) are replaced by the bound of `facert.models.gp.sparse`: an evaluation costs in
proportion to the rows of a view, and mapping depends on its inducing latents alone. They are
trained with the rest.

Where unlabelled rows outnumber the labels many times, what the labels say of both views together is
lost beside what each view says of its own. The unlabelled rows of a view therefore weigh no more
than `MOST_COUNTED` rows, all together, however many there are.
"""

from __future__ import annotations

import numpy as np
import torch
from scipy import sparse
from torch import Tensor, nn

from facert.data.arrays import FloatArray, IntArray
from facert.models.gp.posterior import Predictor
from facert.models.gp.sparse import ApproximationName, sparse_negative_log_likelihood
from facert.models.gp.sparse_posterior import sparse_posterior
from facert.models.gplvm.module import SharedGPLVM
from facert.models.gplvm.staging import spread

MOST_COUNTED = 100.0


class SparseSharedGPLVM(SharedGPLVM):
    """`SharedGPLVM` with inducing latents of each view, ``inducing_x`` and ``inducing_y``.

    Parameters
    ----------
    X, Y, labelled, M, Z, noise_floor_x, noise_floor_y
        As of `SharedGPLVM`.
    inducing : int
        Inducing latents of a view; all its rows where it has fewer. They begin at labelled rows
        and others spread over the view.
    approximation : {"vfe", "fitc"}
        See `facert.models.gp.sparse`.
    """

    weights_x: Tensor
    weights_y: Tensor

    def __init__(
        self,
        X: FloatArray,
        Y: FloatArray,
        labelled: int,
        M: sparse.csr_array | None,
        Z: FloatArray,
        noise_floor_x: float,
        noise_floor_y: float,
        *,
        inducing: int,
        approximation: ApproximationName = "vfe",
    ) -> None:
        super().__init__(X, Y, labelled, M, Z, noise_floor_x, noise_floor_y)
        self.approximation = approximation
        self.register_buffer("weights_x", row_weights(len(X), labelled))
        self.register_buffer("weights_y", row_weights(len(Y), labelled))
        rows = inducing_rows(len(X), labelled, inducing)
        self.inducing_x = nn.Parameter(torch.from_numpy(self.latents_x[rows]))
        rows = inducing_rows(len(Y), labelled, inducing)
        self.inducing_y = nn.Parameter(torch.from_numpy(self.latents_y[rows]))

    def forward(self) -> Tensor:
        """The bounds on Eqs. (1) and (2) and the prior (5), what training minimises."""
        return self.sum_of_energies()

    def source_energy(self) -> Tensor:
        """The bound on -log P(X|Z) over labelled and source-only rows."""
        return sparse_negative_log_likelihood(
            self.Z[: self.rows_x],
            self.inducing_x,
            self.log_kernel_x,
            self.factor_x,
            self.columns_x,
            self.noise_floor_x,
            self.approximation,
            self.weights_x,
        )

    def target_energy(self) -> Tensor:
        """The bound on -log P(Y|Z) over labelled and target-only rows."""
        return sparse_negative_log_likelihood(
            self.Z[self.rows_y],
            self.inducing_y,
            self.log_kernel_y,
            self.factor_y,
            self.columns_y,
            self.noise_floor_y,
            self.approximation,
            self.weights_y,
        )

    def source_posterior(self, X: FloatArray) -> Predictor:
        """The source view given its observations (l + m, d_x), seen from the inducing latents."""
        return sparse_posterior(
            self.inducing_x.detach().cpu().numpy(),
            self.latents_x,
            X,
            self.kernel_x,
            self.approximation,
            self.weights_x.cpu().numpy(),
        )

    def target_posterior(self, Y: FloatArray) -> Predictor:
        """The target view given its observations (l + n, d_y), seen from the inducing latents."""
        return sparse_posterior(
            self.inducing_y.detach().cpu().numpy(),
            self.latents_y,
            Y,
            self.kernel_y,
            self.approximation,
            self.weights_y.cpu().numpy(),
        )


def row_weights(rows: int, labelled: int) -> Tensor:
    """1 for labelled rows, and for the others what makes them count as `MOST_COUNTED` at most."""
    weights = torch.ones(rows, dtype=torch.float64)
    weights[labelled:] = min(1.0, MOST_COUNTED / max(rows - labelled, 1))
    return weights


def inducing_rows(rows: int, labelled: int, count: int) -> IntArray:
    """The rows at which inducing latents begin: labelled ones, and others evenly after them."""
    labels = spread(0, labelled, count)
    return np.concatenate([labels, spread(labelled, rows, count - len(labels))])

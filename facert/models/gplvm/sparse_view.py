"""A view of the shared model that sees its rows through inducing latents, for large sets.

Eq. (1) or (2) is replaced by the bound of `facert.models.gp.sparse`: an evaluation costs in
proportion to the rows of a view, and mapping depends on its inducing latents alone. They are
trained with the rest.

Where unlabelled rows outnumber the labels many times, the correspondence that the labels show is
lost beside the structure of each view. The unlabelled rows of a view therefore weigh no more
than `MOST_COUNTED` rows, all together, however many there are.
"""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor, nn

from facert.data.arrays import FloatArray, IntArray
from facert.models.gp.posterior import Predictor
from facert.models.gp.sparse import ApproximationName, sparse_negative_log_likelihood
from facert.models.gp.sparse_posterior import sparse_posterior
from facert.models.gplvm.module import GaussianView
from facert.models.gplvm.staging import spread
from facert.models.kernels import Kernel

MOST_COUNTED = 100.0


class SparseView(GaussianView):
    """`GaussianView` with the further trainable tensor ``inducing``.

    Parameters
    ----------
    observations, rows, noise_floor, kernel
        As of `GaussianView`.
    inducing : array, shape (m, q)
        Initial inducing latents, see `inducing_rows`.
    weights : Tensor, shape (n,)
        Weights of the rows, see `row_weights`.
    approximation : {"vfe", "fitc"}
        See `facert.models.gp.sparse`.
    """

    weights: Tensor

    def __init__(
        self,
        observations: FloatArray,
        rows: IntArray,
        noise_floor: float,
        kernel: type[Kernel],
        inducing: FloatArray,
        weights: Tensor,
        approximation: ApproximationName = "vfe",
    ) -> None:
        super().__init__(observations, rows, noise_floor, kernel)
        self.approximation = approximation
        self.register_buffer("weights", weights)
        self.inducing = nn.Parameter(torch.from_numpy(np.array(inducing)))

    def value_and_gradient(self, Z: Tensor) -> tuple[Tensor, ...]:
        """The bound in place of the likelihood; see `GaussianView`."""
        value, dZ, dU, d_log_kernel = sparse_negative_log_likelihood(
            Z,
            self.inducing.detach(),
            self.log_kernel.detach(),
            self.factor,
            self.columns,
            self.noise_floor,
            self.kernel_type,
            self.approximation,
            self.weights,
        )
        return value, dZ, d_log_kernel, dU

    def follow_scale(self, scale: float) -> None:
        """See `GaussianView`; the inducing latents go with the others."""
        super().follow_scale(scale)
        with torch.no_grad():
            self.inducing.div_(scale)

    def posterior(self, latents: FloatArray) -> Predictor:
        """The process given its observations, seen from the inducing latents."""
        return sparse_posterior(
            self.inducing.detach().cpu().numpy(),
            latents,
            self.observations,
            self.kernel,
            self.approximation,
            self.weights.cpu().numpy(),
        )


def row_weights(rows: int, labelled: int) -> Tensor:
    """Weights of rows: 1 for labelled ones; those of the others sum to `MOST_COUNTED` at most."""
    weights = torch.ones(rows, dtype=torch.float64)
    weights[labelled:] = min(1.0, MOST_COUNTED / max(rows - labelled, 1))
    return weights


def inducing_rows(rows: int, labelled: int, count: int) -> IntArray:
    """The rows of a view at which so many inducing latents begin, or all where there are fewer.

    They are labelled ones, and others spread evenly over the rest.
    """
    labels = spread(0, labelled, count)
    return np.concatenate([labels, spread(labelled, rows, count - len(labels))])

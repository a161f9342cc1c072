"""Source and target mapping on a torch device, for thousands of frames at once.

What costs is there: kernels, their derivatives, and the products with every training latent. Frames
go over in large chunks, and F with its q derivatives comes back; Newton's steps, in q dimensions,
stay where they are. The formulas are those of `facert.models.gplvm.source_mapping`, which tests
compare.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from facert.data.arrays import FloatArray
from facert.models.gp.posterior import Predictor
from facert.models.gplvm.source_mapping import Expansion, Mapped, Observation, SourceMapping

CHUNK = 4096  # frames solved together: about 2 CHUNK q (N + d) doubles of the device's memory


@dataclass(frozen=True, eq=False)
class _Point:
    """`facert.models.gp.posterior.PosteriorPoint` on the device."""

    mean: Tensor
    variance: Tensor
    offsets: Tensor
    k: Tensor
    whitened: Tensor


class DevicePredictor:
    """A view on a device.

    Parameters
    ----------
    view : Predictor
    device : torch.device
    """

    def __init__(self, view: Predictor, device: torch.device) -> None:
        self.device, self.kernel, self.columns = device, view.kernel, view.columns
        self.Z, self.stacked, self.whitener = (
            self.there(array) for array in (view.Z, view.stacked, view.whitener)
        )

    @property
    def alpha(self) -> Tensor:
        """α, (N, D)."""
        return self.stacked[:, len(self.Z) :]

    def there(self, array: FloatArray) -> Tensor:
        """An array on the device."""
        return torch.from_numpy(np.ascontiguousarray(array)).to(self.device)

    def predict(self, z: Tensor) -> _Point:
        """Mean and variance at z (B, q)."""
        n, kernel = len(self.Z), self.kernel
        offsets = z[:, None, :] - self.Z
        k = kernel.variance * torch.exp(-0.5 * kernel.inverse_width * offsets.square().sum(2))
        product = k @ self.stacked
        whitened, mean = product[:, :n], product[:, n:]
        explained = whitened.square().sum(1)
        variance = kernel.noise + (kernel.variance - explained).clamp(min=0.0)
        return _Point(mean, variance, offsets, k, whitened)

    def jacobians(self, at: _Point) -> tuple[Tensor, Tensor]:
        """H (B, q, N) and J (B, q, D): derivatives of T k and of the mean."""
        product = self._kernel_jacobian(at) @ self.stacked
        return product[:, :, : len(self.Z)], product[:, :, len(self.Z) :]

    def mean_jacobian(self, at: _Point) -> Tensor:
        """J alone, (B, q, D)."""
        return self._kernel_jacobian(at) @ self.alpha

    def _kernel_jacobian(self, at: _Point) -> Tensor:
        return (at.offsets * (-self.kernel.inverse_width * at.k)[:, :, None]).mT


class DeviceSourceMapping(SourceMapping):
    """`SourceMapping` whose batches are on a device; single frames are not: they are soon done.

    Parameters
    ----------
    posterior : Predictor
        The source view.
    device : torch.device
    """

    chunk = CHUNK

    def __init__(self, posterior: Predictor, device: torch.device) -> None:
        super().__init__(posterior)
        self._view = DevicePredictor(posterior, device)
        self._of_training = self._view.there(self._train_means)
        self._at_training = self._view.there(self._train_energy)

    def start(self, observed: Observation) -> FloatArray:
        """The training latent of least energy for each frame, (B, q)."""
        b, R = self._view.there(observed.mean), self._view.there(observed.variance)
        w = 1.0 / (self._train_variance + R)
        energies = torch.hstack([w, w * b]) @ self._of_training + self._at_training
        return np.asarray(self.posterior.Z[energies.argmin(1).cpu().numpy()])

    def _look(self, z: FloatArray, observed: Observation) -> tuple[FloatArray, FloatArray]:
        """F and x* at z (B, q)."""
        there = self._view.there
        place, b, R = there(z), there(observed.mean), there(observed.variance)
        at = self._view.predict(place)
        s = at.variance[:, None]
        w, r = 1.0 / (s + R), at.mean - b
        return _here(_energy(place, at, w, r)), _here(at.mean - s * w * r)

    def _expand(
        self,
        z: FloatArray,
        observed: Observation,
        scratch: FloatArray | None = None,  # noqa: ARG002  the device has its own memory
    ) -> Expansion:
        """F, ∇F and ∇²F at z (B, q)."""
        view, theta2 = self._view, self.posterior.kernel.inverse_width
        place, b, R = (view.there(array) for array in (z, observed.mean, observed.variance))
        at = view.predict(place)
        H, J = view.jacobians(at)

        s = at.variance
        w, r = 1.0 / (s[:, None] + R), at.mean - b
        wr = w * r
        w2r = w * wr
        a = -0.5 * wr.square().sum(1) + 0.5 * view.columns / s
        a_slope = (w2r * wr).sum(1) - 0.5 * view.columns / s**2
        g = -2.0 * _times(H, at.whitened)
        ug = _times(J, w2r)[:, :, None] * g[:, None, :]
        gradient = _times(J, wr) + a[:, None] * g + place

        K_inverse_k = at.whitened @ view.whitener
        ek = (wr @ view.alpha.T - 2.0 * a[:, None] * K_inverse_k) * at.k
        hessian = (
            (J * w[:, None, :]) @ J.mT
            + a_slope[:, None, None] * g[:, :, None] * g[:, None, :]
            - (ug + ug.mT)
            - (2.0 * a)[:, None, None] * (H @ H.mT)
            + theta2**2 * ((at.offsets * ek[:, :, None]).mT @ at.offsets)
        )
        hessian.diagonal(dim1=1, dim2=2).add_((1.0 - theta2 * ek.sum(1))[:, None])
        return Expansion(_here(_energy(place, at, w, r)), _here(gradient), _here(hessian))


def map_to_target_on(view: DevicePredictor, mapped: Mapped) -> tuple[FloatArray, FloatArray]:
    """`facert.models.gplvm.target_mapping.map_to_target` on the view's device."""
    means, stds = [], []
    for first in range(0, len(mapped.z), CHUNK):
        rows = slice(first, first + CHUNK)
        at = view.predict(view.there(mapped.z[rows]))
        J = view.mean_jacobian(at)
        spread = (J * torch.linalg.solve(view.there(mapped.hessian[rows]), J)).sum(1)
        means.append(_here(at.mean))
        stds.append(_here((at.variance[:, None] + spread.clamp(min=0.0)).sqrt()))
    return np.concatenate(means), np.concatenate(stds)


def _times(matrices: Tensor, vectors: Tensor) -> Tensor:
    """Matrices (B, q, n) by vectors (B, n), giving (B, q)."""
    return (matrices @ vectors[:, :, None])[:, :, 0]


def _energy(z: Tensor, at: _Point, w: Tensor, r: Tensor) -> Tensor:
    squares = (w * r * r).sum(1) + z.square().sum(1)
    return 0.5 * (squares + r.shape[1] * torch.log(at.variance))


def _here(tensor: Tensor) -> FloatArray:
    array: FloatArray = tensor.cpu().numpy()
    return array

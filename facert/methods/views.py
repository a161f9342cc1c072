"""A trained view of the shared models as the arrays of a model file.

An exact view is its latents and observations, from which the rest is computed again; a sparse one
its inducing latents and their weights, however many frames it was trained on.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from facert.data.array_group import DAMAGED, Shaped, check_axes, part_of, require_known_arrays
from facert.data.arrays import FloatArray
from facert.errors import InputError
from facert.models.gp.posterior import Posterior, Predictor
from facert.models.kernels import Kernel

EXACT = {"latents": "nq", "observations": "nd", "kernel": "3"}
SPARSE = {"latents": "mq", "whitener": "mm", "weights": "md", "kernel": "3"}


def view_arrays(view: Predictor, name: str) -> dict[str, FloatArray]:
    """The arrays of a view, whose name stands before theirs."""
    kernel = view.kernel
    arrays = {
        "latents": view.Z,
        "kernel": np.array([kernel.variance, kernel.inverse_width, kernel.noise]),
    }
    if isinstance(view, Posterior):
        arrays["observations"] = view.X
    else:
        arrays |= {"whitener": view.whitener, "weights": np.ascontiguousarray(view.alpha)}
    return {f"{name}.{part}": array for part, array in arrays.items()}


def view_sizes(arrays: Mapping[str, Shaped], name: str) -> dict[str, int]:
    """The sizes of a view that `view_from` could make: "q", "d", and "n" or "m".

    Raises
    ------
    InputError
        When an array is absent or unknown, or shapes do not fit together.
    """
    axes = SPARSE if f"{name}.whitener" in arrays else EXACT
    spelt = {f"{name}.{part}": letters for part, letters in axes.items()}
    require_known_arrays([n for n in arrays if n.startswith(f"{name}.")], spelt)
    return check_axes(arrays, spelt)


def view_from(arrays: Mapping[str, FloatArray], name: str, kernel_type: type[Kernel]) -> Predictor:
    """A view from the arrays of a file, where they bear its name; see `view_sizes`.

    Raises
    ------
    InputError
        For numbers that no kernel has.
    """
    own = part_of(arrays, f"{name}.")
    theta = own["kernel"]
    if not (theta > 0).all():
        raise InputError(f"{name}.kernel", "three positive numbers", f"{theta}", DAMAGED)
    kernel = kernel_type(*theta.tolist())
    if "whitener" in own:
        return Predictor(own["latents"], own["whitener"], own["weights"], kernel)
    return Posterior(own["latents"], own["observations"], kernel)

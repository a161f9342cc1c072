"""What a model's numbers make of a source is finite, or an error: never a pose of NaN."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from facert.data.arrays import FloatArray
from facert.errors import NumericalError

UNFIT = "the model's numbers are too large or small to map with: train it again"


@contextmanager
def mapping() -> Iterator[None]:
    """A block in which a model's numbers meet those of a source, which may be extreme as well.

    Raises
    ------
    NumericalError
        Where LAPACK, SciPy or Python find numbers that they cannot compute with.
    """
    try:
        with np.errstate(all="ignore"):  # whatever overflows is found by `require_finite`
            yield
    except (np.linalg.LinAlgError, ArithmeticError) as error:
        raise NumericalError(UNFIT) from error


def require_finite(*predicted: FloatArray | None) -> None:
    """Refuse what was predicted where it holds NaN or infinity, with a `NumericalError`."""
    if not all(array is None or np.isfinite(array).all() for array in predicted):
        raise NumericalError(UNFIT)

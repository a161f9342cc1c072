"""A symmetric matrix of arrow shape: groups of variables that meet in a common one alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from scipy.linalg.blas import dtrsv
from scipy.linalg.lapack import dpotrf, dtrtrs

from facert.data.arrays import FloatArray, IntArray


class Arrow:
    """A symmetric matrix over variables of which those of different wings do not meet.

    Parameters
    ----------
    wings : sequence of array of int
        Variables of each wing, rising.
    body : array of int
        The others, which meet all.
    """

    def __init__(self, wings: Sequence[IntArray], body: IntArray) -> None:
        self.places = [*(wing for wing in wings if len(wing)), body]
        sizes = [len(places) for places in self.places]
        self.own = [np.zeros((size, size)) for size in sizes]
        self.beside = [np.zeros((size, sizes[-1])) for size in sizes[:-1]]
        self._slots = np.empty(sum(sizes), dtype=np.int64)  # of a variable within its part
        self._parts = np.empty(sum(sizes), dtype=np.int64)
        for part, places in enumerate(self.places):
            self._slots[places], self._parts[places] = np.arange(len(places)), part

    def add(self, places: IntArray, block: FloatArray) -> Self:
        """Add a symmetric block (k, k) of variables (k,) that are in the body or in one wing."""
        last = len(self.own) - 1
        slots, parts = self._slots[places], self._parts[places]
        chosen = [np.flatnonzero(parts == part) for part in range(last + 1)]
        for part, rows in enumerate(chosen):
            self.own[part][np.ix_(slots[rows], slots[rows])] += block[np.ix_(rows, rows)]
            if part < last and len(rows):
                body = chosen[last]
                self.beside[part][np.ix_(slots[rows], slots[body])] += block[np.ix_(rows, body)]
        return self

    def factor(self, shift: float) -> ArrowFactor | None:
        """The Cholesky factor with so much added to the diagonal, relative to its mean size.

        None where the matrix is then not positive definite.
        """
        shift *= self._size
        roots, widths, rest = [], [], self.own[-1].copy()
        for own, beside in zip(self.own[:-1], self.beside, strict=True):
            root = _root(own, shift)
            if root is None:
                return None
            width = np.asarray(dtrtrs(root, beside, lower=1)[0])
            rest -= width.T @ width
            roots.append(root)
            widths.append(width)
        root = _root(rest, shift)
        return None if root is None else ArrowFactor(self.places, [*roots, root], widths)

    def solve(self, right: FloatArray, shift: float) -> FloatArray:
        """The x of (matrix + shift) x = right, positive definite or not; see `factor`."""
        shift *= self._size
        body, rest, side = self.places[-1], _shifted(self.own[-1], shift), right[self.places[-1]]
        solved = []
        for places, own, beside in zip(self.places, self.own, self.beside, strict=False):
            both = np.column_stack([beside, right[places]])
            solved.append(np.linalg.solve(_shifted(own, shift), both))
            rest -= beside.T @ solved[-1][:, :-1]
            side = side - beside.T @ solved[-1][:, -1]
        found = np.empty_like(right)
        found[body] = np.linalg.solve(rest, side)
        for places, wing in zip(self.places, solved, strict=False):
            found[places] = wing[:, -1] - wing[:, :-1] @ found[body]
        return found

    @property
    def _size(self) -> float:
        """Mean size of the diagonal."""
        return float(np.abs(np.concatenate([own.diagonal() for own in self.own])).mean())


@dataclass(frozen=True, eq=False)
class ArrowFactor:
    """L with L Lᵀ the matrix, wings first."""

    places: Sequence[IntArray]
    roots: Sequence[FloatArray]  # Lower triangles on the diagonal; those above mean nothing
    widths: Sequence[FloatArray]  # Of each wing, transposed, what stands below it

    def whiten(self, gradient: FloatArray) -> FloatArray:
        """L⁻¹ g: the gradient in the variables y = Lᵀ x."""
        found = np.empty_like(gradient)
        body = self.places[-1]
        rest = gradient[body]
        for places, root, width in zip(self.places, self.roots, self.widths, strict=False):
            found[places] = dtrsv(root, gradient[places], lower=1)
            rest = rest - width.T @ found[places]
        found[body] = dtrsv(self.roots[-1], rest, lower=1)
        return found

    def restore(self, y: FloatArray) -> FloatArray:
        """The variables of the run, x = L⁻ᵀ y."""
        found = np.empty_like(y)
        body = self.places[-1]
        found[body] = dtrsv(self.roots[-1], y[body], lower=1, trans=1)
        for places, root, width in zip(self.places, self.roots, self.widths, strict=False):
            found[places] = dtrsv(root, y[places] - width @ found[body], lower=1, trans=1)
        return found


def _root(matrix: FloatArray, shift: float) -> FloatArray | None:
    root, failed = dpotrf(_shifted(matrix, shift), lower=1, clean=0, overwrite_a=1)
    return None if failed or not np.isfinite(root.diagonal()).all() else root


def _shifted(matrix: FloatArray, shift: float) -> FloatArray:
    shifted = np.array(matrix, order="F")
    np.einsum("ii->i", shifted)[...] += shift
    return shifted

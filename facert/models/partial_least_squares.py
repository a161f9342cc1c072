"""Partial least squares: directions of the inputs that go most with the outputs, one by one.

Wold, "Path models with latent variables: the NIPALS approach" (1975), for several outputs, with
the leading singular vector in place of its power iteration: there is no number of iterations, and
what remains is looked at before anything is divided by it. Where the inputs have no further
direction that goes with the outputs, there are fewer components than were asked for.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from facert.data.arrays import FloatArray

NOTHING = 1e-12
"""Of the inputs, or of their products with the outputs, at the start: less that remains is
rounding."""


@dataclass(frozen=True, eq=False)
class LeastSquaresComponents:
    """Components of inputs X (n, d_x) that go with outputs Y (n, d_y)."""

    mean_X: FloatArray  # (d_x,)
    mean_Y: FloatArray  # (d_y,)
    rotations: FloatArray  # (d_x, k): From centred inputs to scores
    loadings: FloatArray  # (k, d_y): From scores to centred outputs

    @classmethod
    def of(cls, X: FloatArray, Y: FloatArray, count: int) -> LeastSquaresComponents:
        """At most `count` components of inputs (n, d_x) and outputs (n, d_y)."""
        mean_X, mean_Y = X.mean(axis=0), Y.mean(axis=0)
        left, rest = X - mean_X, Y - mean_Y
        least_score = NOTHING * np.linalg.norm(left)
        least_product = NOTHING * np.linalg.norm(left) * np.linalg.norm(rest)
        directions, input_loadings, loadings = [], [], []
        for _ in range(count):
            U, strength, _ = np.linalg.svd(left.T @ rest, full_matrices=False)
            scores = left @ U[:, 0]
            squared = float(scores @ scores)
            if strength[0] <= least_product or squared <= least_score**2:
                break
            directions.append(U[:, 0])
            input_loadings.append(left.T @ scores / squared)
            loadings.append(rest.T @ scores / squared)
            left = left - np.outer(scores, input_loadings[-1])
            rest = rest - np.outer(scores, loadings[-1])
        W = np.reshape(directions, (-1, X.shape[1])).T
        P = np.reshape(input_loadings, (-1, X.shape[1])).T
        rotations = np.linalg.solve((P.T @ W).T, W.T).T
        return cls(mean_X, mean_Y, rotations, np.reshape(loadings, (-1, Y.shape[1])))

    @property
    def weights(self) -> FloatArray:
        """The matrix of the linear map from centred inputs to centred outputs, (d_x, d_y)."""
        return self.rotations @ self.loadings

    def outputs(self, X: FloatArray, most: int) -> FloatArray:
        """Outputs of inputs (T, d_x) by 1 to `most` components, (most, T, d_y).

        Components are found one after the other: each map is the next with its last term left off;
        where there are fewer, all further ones are the last.
        """
        scores = (X - self.mean_X) @ self.rotations
        terms = np.zeros((most, len(X), len(self.mean_Y)))
        terms[: scores.shape[1]] = scores.T[:, :, None] * self.loadings[:, None, :]
        return self.mean_Y + np.cumsum(terms, axis=0)

"""Rotations as matrices, for programs whose Python has no library for them; angles in degrees."""

from __future__ import annotations

import math
from collections.abc import Sequence

Matrix = list[list[float]]


def of_vector(vector: Sequence[float]) -> Matrix:
    """The rotation about a vector, by its length."""
    angle = math.radians(math.sqrt(sum(x * x for x in vector)))
    if not angle:
        return [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    x, y, z = (math.radians(value) / angle for value in vector)
    c, s = math.cos(angle), math.sin(angle)
    d = 1 - c
    return [
        [c + x * x * d, x * y * d - z * s, x * z * d + y * s],
        [y * x * d + z * s, c + y * y * d, y * z * d - x * s],
        [z * x * d - y * s, z * y * d + x * s, c + z * z * d],
    ]


def vector_of(matrix: Matrix) -> list[float]:
    """The vector about which a rotation turns, as long as its angle; below 180 degrees."""
    pairs = ((2, 1), (0, 2), (1, 0))
    axis = [(matrix[i][j] - matrix[j][i]) / 2 for i, j in pairs]
    sine = math.sqrt(sum(x * x for x in axis))
    angle = math.atan2(sine, (matrix[0][0] + matrix[1][1] + matrix[2][2] - 1) / 2)
    return [math.degrees(x * (angle / sine if sine else 1.0)) for x in axis]


def of_euler(angles: Sequence[float]) -> Matrix:
    """The rotation about x, then y, then z."""
    x, y, z = (of_vector([a * (i == k) for i in range(3)]) for k, a in enumerate(angles))
    return multiplied(z, multiplied(y, x))


def euler_of(matrix: Matrix) -> list[float]:
    """The angles about x, then y, then z of a rotation."""
    y = math.asin(max(-1.0, min(1.0, -matrix[2][0])))
    x, z = math.atan2(matrix[2][1], matrix[2][2]), math.atan2(matrix[1][0], matrix[0][0])
    return [math.degrees(angle) for angle in (x, y, z)]


def multiplied(a: Matrix, b: Matrix) -> Matrix:
    """The rotation b, then a."""
    return [[sum(x * y for x, y in zip(row, column)) for column in zip(*b)] for row in a]


def transposed(matrix: Matrix) -> Matrix:
    """The rotation back."""
    return [list(row) for row in zip(*matrix)]


def turned(matrix: Matrix, vector: Sequence[float]) -> list[float]:
    """A vector after the rotation."""
    return [sum(x * y for x, y in zip(row, vector)) for row in matrix]

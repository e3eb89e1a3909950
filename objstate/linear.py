"""Small systems of linear equations and angles, compiled into the loops that need them."""

from __future__ import annotations

import math
from typing import Any

from objstate.compiling import inner
from objstate.geometry import TURN, FloatArray

ROOT_2, ROOT_TAU = math.sqrt(2.0), math.sqrt(2.0 * math.pi)  # of normal distributions

_inner = inner(nogil=True, error_model="numpy", fastmath={"contract"})


@_inner
def wrapped(angle: float) -> Any:
    """An angle in [-pi, pi)."""
    return angle - TURN * math.floor((angle + math.pi) / TURN)


@_inner
def solve(matrix: FloatArray, right: FloatArray) -> Any:
    """Set ``right`` (n, m) to matrix^-1 right; log |determinant|. The matrix is overwritten."""
    log_determinant = 0.0
    size = matrix.shape[0]
    for k in range(size):
        pivot = k
        for i in range(k + 1, size):
            if abs(matrix[i, k]) > abs(matrix[pivot, k]):
                pivot = i
        if pivot != k:
            for j in range(size):
                matrix[k, j], matrix[pivot, j] = matrix[pivot, j], matrix[k, j]
            for j in range(right.shape[1]):
                right[k, j], right[pivot, j] = right[pivot, j], right[k, j]
        log_determinant += math.log(abs(matrix[k, k]))
        for i in range(k + 1, size):
            factor = matrix[i, k] / matrix[k, k]
            for j in range(k + 1, size):
                matrix[i, j] -= factor * matrix[k, j]
            for j in range(right.shape[1]):
                right[i, j] -= factor * right[k, j]
    for k in range(size - 1, -1, -1):
        for j in range(right.shape[1]):
            value = right[k, j]
            for i in range(k + 1, size):
                value -= matrix[k, i] * right[i, j]
            right[k, j] = value / matrix[k, k]
    return log_determinant

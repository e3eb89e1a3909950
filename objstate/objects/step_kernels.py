"""Storing the components of a door's mixture, and comparing what was stored; compiled."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from objstate.compiling import called_with, inner, njit
from objstate.geometry import FloatArray
from objstate.objects.mixture_kernels import ORIGIN, STATE, ZERO

Table = NDArray[np.float32]
INDEX, WEIGHTS = 0, 1  # columns of a table: weights at rest under each pace, then moving
STORED = (STATE, ORIGIN, ORIGIN + 1, ZERO)  # errors whose means and covariances follow

_compile = njit(nogil=True, error_model="numpy", fastmath={"contract"})
_inner = inner(nogil=True, error_model="numpy", fastmath={"contract"})


@called_with("f1 f3 f2 f3 f g2")
@_compile
def store(
    weights: FloatArray,
    by_pace: FloatArray,
    means: FloatArray,
    covariances: FloatArray,
    least: float,
    out: Table,
) -> Any:
    """Fill rows of ``out`` with the components of ``weights`` (c,) above the ``least``; how many.

    ``by_pace`` (2, k, c) are weights of a resting and of a moving door under each pace, ``means``
    (c, 8) and ``covariances`` (c, 8, 8) those of the errors.
    """
    rows, paces = 0, by_pace.shape[1]
    for c in range(weights.shape[0]):
        if weights[c] <= least:
            continue
        out[rows, INDEX] = c
        column = WEIGHTS
        for mode in range(2):
            for k in range(paces):
                out[rows, column] = by_pace[mode, k, c]
                column += 1
        for a in range(len(STORED)):
            out[rows, column] = means[c, STORED[a]]
            column += 1
        for a in range(len(STORED)):
            for b in range(a, len(STORED)):
                out[rows, column] = covariances[c, STORED[a], STORED[b]]
                column += 1
        rows += 1
    return rows


@_inner
def _mode(table: Table, row: int, mode: int, paces: FloatArray) -> Any:
    """Weight of a component of a door at rest (``mode`` 0) or of one that moves (1)."""
    total = 0.0
    for k in range(paces.shape[0]):
        total += paces[k] * table[row, WEIGHTS + mode * paces.shape[0] + k]
    return total


@_inner
def _next(table: Table, row: int, paces: FloatArray, heavy: float) -> Any:
    """The first row from a ``row`` on whose component weighs more than ``heavy``."""
    while row < table.shape[0]:
        if _mode(table, row, 0, paces) + _mode(table, row, 1, paces) > heavy:
            break
        row += 1
    return row


@called_with("g2 f1 g2 f1 f f f")
@_compile
def are_alike(
    one: Table,
    paces: FloatArray,
    other: Table,
    other_paces: FloatArray,
    heavy: float,
    most: float,
    most_stds: float,
) -> Any:
    """Whether two tables have the same components above the weight ``heavy``, nearly alike.

    Their weights, with the probabilities of paces (k,), differ by ``most`` at most; the state's
    mean and deviation by ``most_stds`` of the deviation.
    """
    i, j = _next(one, 0, paces, heavy), _next(other, 0, other_paces, heavy)
    mean = WEIGHTS + 2 * paces.shape[0]
    variance = mean + len(STORED)
    while i < one.shape[0] and j < other.shape[0]:
        if one[i, INDEX] != other[j, INDEX]:
            return False
        for mode in range(2):
            if abs(_mode(one, i, mode, paces) - _mode(other, j, mode, other_paces)) > most:
                return False
        std, other_std = math.sqrt(one[i, variance]), math.sqrt(other[j, variance])
        off = max(abs(one[i, mean] - other[j, mean]), abs(std - other_std))
        if off > most_stds * min(std, other_std):
            return False
        i, j = _next(one, i + 1, paces, heavy), _next(other, j + 1, other_paces, heavy)
    return i == one.shape[0] and j == other.shape[0]

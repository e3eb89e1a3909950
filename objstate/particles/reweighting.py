"""Compiled updates of weights, the largest possible exponent of evidence, and resampling."""

from __future__ import annotations

from typing import Any

import numpy as np

from objstate.compiling import called_with, inner, njit
from objstate.geometry import FloatArray

STEP_PRECISION = 12  # halvings in the search for the largest step

_compile = njit(nogil=True, error_model="numpy", fastmath={"contract"})
_inner = inner(nogil=True, error_model="numpy", fastmath={"contract"})
_maker = inner(makes_arrays=True, nogil=True, error_model="numpy", fastmath={"contract"})


@_inner
def _raised(log: FloatArray, values: FloatArray) -> Any:
    """The largest of logarithms (n,), and the sum of ``values`` (n,), their scaled exponentials."""
    top, total = -np.inf, 0.0
    for j in range(log.shape[0]):
        top = max(top, log[j])
    for j in range(log.shape[0]):
        values[j] = np.exp(log[j] - top)
        total += values[j]
    return top, total


@_maker
def _comb(weights: FloatArray, total: float, count: int, start: float) -> Any:
    """Systematic sample: indices (count,) of weights (n,) with a sum ``total``."""
    chosen, last = np.empty(count, dtype=np.int64), weights.shape[0] - 1
    j, edge = 0, weights[0] / total
    for k in range(count):
        while j < last and edge <= (start + k) / count:
            j += 1
            edge += weights[j] / total
        chosen[k] = j
    return chosen


@called_with("f1 f1 f1")
@_compile
def normalize(log: FloatArray, logarithms: FloatArray, values: FloatArray) -> Any:
    """The logarithm of the sum of weights with logarithms (n,), and their effective number.

    The sum is not finite where no weight is above zero. ``values`` (n,) become the weights,
    normalized, and ``logarithms`` (n,) their logarithms.
    """
    squared = 0.0
    top, total = _raised(log, values)
    log_sum = top + np.log(total)
    for j in range(log.shape[0]):
        values[j] /= total
        squared += values[j] * values[j]
        logarithms[j] = log[j] - log_sum
    return log_sum, 1.0 / squared


@called_with("f1 i f")
@_compile
def systematic(weights: FloatArray, count: int, start: float) -> Any:
    """Systematic sample of normalized weights (n,): indices (count,)."""
    return _comb(weights, 1.0, count, start)


@_inner
def _effective(log_weights: FloatArray) -> Any:
    """Kish's effective number of samples with weights (n,) of any sum."""
    top = -np.inf
    for j in range(log_weights.shape[0]):
        top = max(top, log_weights[j])
    total, squared = 0.0, 0.0
    for j in range(log_weights.shape[0]):
        weight = np.exp(log_weights[j] - top)
        total += weight
        squared += weight * weight
    return total * total / squared


@called_with("f1 f1 f f")
@_compile
def largest_step(
    log_weights: FloatArray, log_likelihood: FloatArray, most: float, least_effective: float
) -> Any:
    """The largest exponent up to ``most`` of a likelihood (n,) with enough effective samples."""
    needed, top = min(least_effective, _effective(log_weights)), -np.inf
    for j in range(log_likelihood.shape[0]):
        top = max(top, log_likelihood[j])
    if not np.isfinite(top):
        return most
    after = np.empty(log_weights.shape[0])
    low, high, step = 0.0, most, most
    for _ in range(STEP_PRECISION + 1):
        for j in range(after.shape[0]):
            after[j] = log_weights[j] + step * log_likelihood[j]
        if _effective(after) >= needed:
            low = step
        else:
            high = step
        if low >= high:
            break
        step = (low + high) / 2.0
    return high

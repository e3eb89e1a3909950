"""Compiled loops: the forward simulation of a way."""

from __future__ import annotations

import numpy as np
from numba import njit

from objstate.geometry import FloatArray, IntArray


@njit(cache=True, nogil=True)
def gains_along(
    means: FloatArray,  # (n, 2)
    variances: FloatArray,  # (n, 2)
    drift: FloatArray,  # (n,)
    ways: FloatArray,  # (a, k, 3)
    lengths: IntArray,  # (a,)
    range_min: float,
    range_max: float,
    field_of_view: float,
    noise: float,
    out: FloatArray,  # (a,)
    mode: int = 0,
) -> None:
    """Sum of the entropy drops of all updates along each way, nats."""
    for a in range(len(ways)):
        log_shares = 0.0
        for n in range(len(means)):
            first, second = variances[n, 0], variances[n, 1]
            if mode == 3 and n != a: continue
            once = False
            for k in range(lengths[a]):
                first += drift[n]
                second += drift[n]
                dx, dy = means[n, 0] - ways[a, k, 0], means[n, 1] - ways[a, k, 1]
                distance = np.sqrt(dx * dx + dy * dy)
                if distance < range_min or distance > range_max:
                    continue
                turn = (np.arctan2(dy, dx) - ways[a, k, 2] + np.pi) % (2.0 * np.pi) - np.pi
                if abs(turn) > field_of_view / 2.0:
                    continue
                if once and mode == 4: continue
                once = True
                if mode in (0, 3, 4): log_shares += np.log((1.0 + first / noise) * (1.0 + second / noise))
                first *= noise / (first + noise)
                second *= noise / (second + noise)
            f0 = variances[n, 0] + drift[n]*lengths[a]
            if mode == 1: log_shares += 2*np.log(f0/first)
            if mode == 2: log_shares += 2*np.log(variances[n,0]/first)
        out[a] = 0.5 * log_shares

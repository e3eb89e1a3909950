"""Compiled loops: the forward simulation of a way."""

from __future__ import annotations

import numpy as np

from objstate.compiling import njit
from objstate.geometry import FloatArray, IntArray


@njit(nogil=True)
def gains_along(
    means: FloatArray,  # (n, 2)
    variances: FloatArray,  # (n, d)
    drift: FloatArray,  # (n,)
    ways: FloatArray,  # (a, k, 3)
    lengths: IntArray,  # (a,)
    range_min: float,
    range_max: float,
    field_of_view: float,
    noise: float,
    at_the_end: bool,
    out: FloatArray,  # (a,)
) -> None:
    """The gains that ``gaussian.gains_along`` describes, nats."""
    for a in range(len(ways)):
        gain = 0.0
        for n in range(len(means)):
            spread = variances[n].copy()
            for k in range(lengths[a]):
                spread += drift[n]
                dx, dy = means[n, 0] - ways[a, k, 0], means[n, 1] - ways[a, k, 1]
                distance = np.sqrt(dx * dx + dy * dy)
                if distance < range_min or distance > range_max:
                    continue
                turn = (np.arctan2(dy, dx) - ways[a, k, 2] + np.pi) % (2.0 * np.pi) - np.pi
                if abs(turn) > field_of_view / 2.0:
                    continue
                for d in range(len(spread)):
                    if not at_the_end:
                        gain += 0.5 * np.log(1.0 + spread[d] / noise)
                    spread[d] *= noise / (spread[d] + noise)
            if at_the_end:
                unseen = variances[n] + lengths[a] * drift[n]
                gain += 0.5 * np.log(unseen / spread).sum()
        out[a] = gain

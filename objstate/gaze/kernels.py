"""Compiled loops: the forward simulation of a way, and what is in sight."""

from __future__ import annotations

import numpy as np

from objstate.compiling import called_with, njit
from objstate.geometry import BoolArray, FloatArray, IntArray


@called_with("f2 f2 f1 f3 i1 f f f f b b2 f1")
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
    counted: BoolArray,  # (a, n) which objects count for each way
    out: FloatArray,  # (a,)
) -> None:
    """The gains that ``gaussian.gains_along`` describes, nats."""
    for a in range(len(ways)):
        gain = 0.0
        for n in range(len(means)):
            if not counted[a, n]:
                continue
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


@called_with("f2 f1 f2 f2 f1 b2")
@njit(nogil=True)
def in_sight(
    poses: FloatArray,  # (k, 3) of the laser
    bearings: FloatArray,  # (n,) rad, of its beams
    ranges: FloatArray,  # (k, n) m, how far they see
    circles: FloatArray,  # (o, 3) x, y, radius
    reach: FloatArray,  # (o,) m, from a pose to the middles of circles
    out: BoolArray,  # (k, o)
) -> None:
    """Which circles some beam enters from each pose."""
    x, y = np.empty(len(bearings)), np.empty(len(bearings))
    for k in range(len(poses)):
        for n in range(len(bearings)):
            x[n], y[n] = np.cos(poses[k, 2] + bearings[n]), np.sin(poses[k, 2] + bearings[n])
        for o in range(len(circles)):
            out[k, o] = False
            dx, dy = circles[o, 0] - poses[k, 0], circles[o, 1] - poses[k, 1]
            if dx * dx + dy * dy > reach[o] * reach[o]:
                continue
            for n in range(len(bearings)):
                along, aside = dx * x[n] + dy * y[n], dx * y[n] - dy * x[n]
                room = circles[o, 2] ** 2 - aside**2
                if room < 0.0:
                    continue
                half = np.sqrt(room)
                if along + half > 0.0 and along - half < ranges[k, n]:
                    out[k, o] = True
                    break

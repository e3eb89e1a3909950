"""Which readings near an object repeat earlier ones; compiled.

Scans in quick succession meet the same pieces of the same surfaces. What the model lacks of these,
such as a box beside a door or the form of a leaf, is the same each time. So a piece that was met in
n scans before has the weight 1 / (1 + n) in the evidence for an object's states (docs/model.md,
"Readings that repeat").
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from objstate.compiling import called_with, njit
from objstate.geometry import FloatArray
from objstate.linear import ROOT_TAU

LENGTH = 0.05  # m along a surface, from which on its deviations are independent
SHIFT = 0.01  # m; deviation of ranges to the same surface from pose to pose
BENT = 0.5  # deviation of a surface between two points, as a share of their distance
REPEATS = 0.8  # probability that the surface of the last scan is still there
ANYWHERE = 1.0  # 1/m, density of a range to another one

_compile = njit(nogil=True, error_model="numpy", fastmath={"contract"})


class Ends(NamedTuple):
    """Where beams ended on surfaces, and how often each piece was met so far."""

    points: FloatArray  # (m, 2) m in the building, in the order of the scan; NaN without return
    times: FloatArray  # (m,)


NO_ENDS = Ends(np.empty((0, 2)), np.empty(0))


def fresh(ends: Ends) -> FloatArray:
    """(n,) share of a beam that counts."""
    shares = np.empty(len(ends.times))
    share(ends.points, ends.times, shares)
    return shares


def follow(
    before: Ends,
    origins: FloatArray,
    directions: FloatArray,
    measured: FloatArray,
    variance: float,
    growth: float,
) -> Ends:
    """The ends of a laser's scan, with ``before`` those of its last one.

    Beams have ``origins`` and ``directions`` (n, 2) in the building and ``measured`` ranges (n,) m,
    whose noise has a ``variance`` m^2 that grows with the squared range by ``growth``.
    """
    times = np.empty(len(measured))
    count(before.points, before.times, origins, directions, measured, variance, growth, times)
    ranges = np.where(np.isfinite(measured), measured, np.nan)
    return Ends(origins + ranges[:, None] * directions, times)


@called_with("f2 f1 f2 f2 f1 f f f1")
@_compile
def count(
    points: FloatArray,
    times: FloatArray,
    origins: FloatArray,
    directions: FloatArray,
    measured: FloatArray,
    variance: float,
    growth: float,
    out: FloatArray,
) -> None:
    """Set ``out`` (n,) to how often the piece that each beam meets has been met, with this scan.

    The last scan's ends are ``points`` (m, 2), met so many ``times`` (m,).
    """
    for i in range(measured.shape[0]):
        out[i] = 1.0
        if measured[i] == np.inf:
            continue
        dx, dy, nearest = directions[i, 0], directions[i, 1], np.inf
        before, along_before = np.nan, np.nan
        for k in range(points.shape[0]):
            off_x, off_y = points[k, 0] - origins[i, 0], points[k, 1] - origins[i, 1]
            across, along = dx * off_y - dy * off_x, dx * off_x + dy * off_y
            if before * across <= 0.0 and along > 0.0 and along_before > 0.0:
                part = before / (before - across) if before != across else 0.5
                distance = along_before + part * (along - along_before)
                off = abs(measured[i] - distance)
                if off < nearest:
                    nearest = off
                    gap = math.hypot(
                        points[k, 0] - points[k - 1, 0], points[k, 1] - points[k - 1, 1]
                    )
                    spread = SHIFT * SHIFT + BENT * BENT * gap * gap * part * (1.0 - part)
                    spread += 2.0 * (variance + growth * distance * distance)
                    same = math.exp(-0.5 * off * off / spread) / (ROOT_TAU * math.sqrt(spread))
                    same *= REPEATS / (REPEATS * same + (1.0 - REPEATS) * ANYWHERE)
                    same *= math.exp(-gap * min(part, 1.0 - part) / LENGTH)
                    out[i] = 1.0 + same * min(times[k - 1], times[k])
            before, along_before = across, along


@called_with("f2 f1 f1")
@_compile
def share(points: FloatArray, times: FloatArray, out: FloatArray) -> None:
    """Set ``out`` (n,) to the share that a beam counts whose surface, at ``points``, was met so often.

    Readings of a surface that are evenly spaced by g, with exponential correlation, count as many
    independent ones as tanh(g / 2 LENGTH) times their number.
    """
    before = 1.0
    for i in range(times.shape[0]):
        after = 1.0
        if i + 1 < times.shape[0]:
            gap = math.hypot(points[i + 1, 0] - points[i, 0], points[i + 1, 1] - points[i, 1])
            if gap < np.inf:
                after = math.tanh(gap / (2.0 * LENGTH))
        out[i] = 0.5 * (before + after) / times[i]
        before = after

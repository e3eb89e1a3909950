"""Which readings near an object repeat earlier ones; compiled.

Scans in quick succession meet the same pieces of the same surfaces. What the model lacks of these,
such as a box beside a door or the form of a leaf, is the same each time. So a piece that was met in
n scans before has the weight 1 / (1 + n) in the evidence for an object's states
(docs/model/door.md, "Readings that repeat").
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from objstate.compiling import called_with, inner, njit
from objstate.geometry import BoolArray, FloatArray
from objstate.linear import ROOT_TAU
from objstate.objects.mixture_kernels import STEP

if TYPE_CHECKING:
    from objstate.objects.mixture_kernels import Beams, Noise

LENGTH = 0.05  # m along a surface, from which on its deviations are independent
SHIFT = 0.01  # m; deviation of ranges to the same surface from pose to pose
BENT = 0.5  # deviation of a surface between two points, as a share of their distance
REPEATS = 0.98  # probability that the surface of the last scan is still there
ANYWHERE = 1.0  # 1/m, density of a range to another one
CLOSEST = 1e-9  # m
FAR = 2.0  # LENGTHs, from which on an end tells nothing of a place
SURELY = 0.999  # largest probability that a surface was met before

_compile = njit(nogil=True, error_model="numpy", fastmath={"contract"})
_inner = inner(nogil=True, error_model="numpy", fastmath={"contract"})


class Ends(NamedTuple):
    """Where beams ended on surfaces, and how often these were met so far, there and in between."""

    points: FloatArray  # (m, 2) m in the building, in the order of the scan
    times: FloatArray  # (m,)
    between: FloatArray  # (m - 1,) in the middle between two points
    returned: BoolArray  # (m,) whether a reading came back; the others ended nowhere in reach


NO_ENDS = Ends(np.empty((0, 2)), np.empty(0), np.empty(0), np.empty(0, dtype=bool))


def shares(ends: Ends) -> FloatArray:
    """(n,) by how much beams count that meet a surface for the first time."""
    out = np.empty(len(ends.times))
    share(ends.points, ends.returned, out)
    return out


def counted(ends: Ends, origins: FloatArray) -> FloatArray:
    """(n,) how often what beams from ``origins`` (n, 2) tell was told by earlier ones."""
    out = np.empty(len(ends.times))
    beside(ends.points, ends.returned, ends.times, origins, out)
    return out


def standing(ends: Ends) -> FloatArray:
    """(n,) 1/m, densities of the readings by what was met there before and still stands."""
    same = np.minimum(ends.times - 1.0, SURELY)
    return np.asarray((1.0 - REPEATS) * ANYWHERE * same / (1.0 - same))


def followed(
    before: Mapping[str, Ends], laser: str, beams: Beams, noise: Noise
) -> Mapping[str, Ends]:
    """The ends of each laser's last scan, with a new one of a laser."""
    readings = beams.origins, beams.directions, beams.measured
    grows = noise.variance, noise.growth, noise.range_max
    return {**before, laser: follow(before.get(laser, NO_ENDS), *readings, *grows)}


def follow(
    before: Ends,
    origins: FloatArray,
    directions: FloatArray,
    measured: FloatArray,
    variance: float,
    growth: float,
    range_max: float,
) -> Ends:
    """The ends of a laser's scan, with ``before`` those of its last one.

    Beams have ``origins`` and ``directions`` (n, 2) in the building and ``measured`` ranges (n,) m,
    inf where none came back from within ``range_max`` m. Their noise has a ``variance`` m^2 that
    grows with the squared range by ``growth``.
    """
    count = len(measured)
    points, returned = np.empty((count, 2)), np.empty(count, dtype=bool)
    times, between = np.empty(count), np.empty(max(count - 1, 0))
    readings = origins, directions, measured
    trace(*before, *readings, variance, growth, range_max, points, times, between, returned)
    return Ends(points, times, between, returned)


@_inner
def _fades(away: float, middle: float) -> Any:
    """Weight of an end at a distance ``away`` on the way to the ``middle``, beside the latter's.

    It interpolates a process with exponential correlation: linearly where the middle is near.
    """
    middle = max(middle, CLOSEST)
    left = math.expm1(-2.0 * max(middle - away, 0.0) / LENGTH)
    return math.exp(-away / LENGTH) * left / math.expm1(-2.0 * middle / LENGTH)


@_inner
def _is_same(off: float, distance: float, bent: float, variance: float, growth: float) -> Any:
    """Probability that two readings are of one surface, whose ranges differ by ``off``.

    At a ``distance`` m, at points between which the surface may be ``bent``.
    """
    spread = SHIFT * SHIFT + BENT * BENT * bent * bent
    spread += 2.0 * (variance + growth * distance * distance)
    same = math.exp(-0.5 * off * off / spread) / (ROOT_TAU * math.sqrt(spread))
    return REPEATS * same / (REPEATS * same + (1.0 - REPEATS) * ANYWHERE)


@_inner
def _met(
    points: FloatArray,
    times: FloatArray,
    between: FloatArray,
    returned: BoolArray,
    origin: Any,
    place: Any,
    came: bool,
    variance: float,
    growth: float,
) -> Any:
    """How often the surface at a place has been met before, by the last scan's ends.

    It is seen from an ``origin``, and a reading ``came`` from it or not. The last scan has
    ``points`` (m, 2), and the surface was met so many ``times`` (m,) there and ``between`` (m - 1,)
    two of them. The place is on a surface that goes through two neighbouring ends, or that has one
    end: on a thin thing there is no other.
    """
    x, y = origin
    off_x, off_y = place[0] - x, place[1] - y
    away, nearest, before, along_before = math.hypot(off_x, off_y), np.inf, np.nan, np.nan
    dx, dy = off_x / max(away, CLOSEST), off_y / max(away, CLOSEST)
    aside, distance, bent, seen, by_end = np.inf, 0.0, 0.0, 0.0, 0.0
    for k in range(points.shape[0]):
        off_x, off_y = points[k, 0] - x, points[k, 1] - y
        across, along = dx * off_y - dy * off_x, dx * off_x + dy * off_y
        if came and returned[k] and abs(across) < FAR * LENGTH:
            again = times[k] * math.exp(-abs(across) / LENGTH)
            again *= _is_same(away - along, along, across, variance, growth)
            by_end = max(by_end, again)
        if before * across <= 0.0 and along > 0.0 and along_before > 0.0:
            part = before / (before - across) if before != across else 0.5
            met = along_before + part * (along - along_before)
            is_seen = came or returned[k] or returned[k - 1]
            off = abs(away - met) if is_seen else 0.0
            if off < nearest or aside > 0.0:
                nearest, distance, aside = off, met, 0.0
                gap_x, gap_y = points[k, 0] - points[k - 1, 0], points[k, 1] - points[k - 1, 1]
                gap = math.hypot(gap_x, gap_y)
                bent = gap * math.sqrt(part * (1.0 - part))
                end = times[k - 1] if part < 0.5 else times[k]
                seen = between[k - 1]
                seen += (end - seen) * _fades(gap * min(part, 1.0 - part), 0.5 * gap)
        elif along > 0.0 and abs(across) < aside:  # beyond both ends of the scan
            nearest = abs(away - along) if came or returned[k] else 0.0
            aside, distance, bent, seen = abs(across), along, abs(across), times[k]
        before, along_before = across, along
    if seen > 0.0:
        seen *= math.exp(-aside / LENGTH) * _is_same(nearest, distance, bent, variance, growth)
    return max(seen, by_end)


@called_with("f2 f1 f1 b1 f2 f2 f1 f f f f2 f1 f1 b1")
@_compile
def trace(
    last_points: FloatArray,
    last_times: FloatArray,
    last_between: FloatArray,
    last_returned: BoolArray,
    origins: FloatArray,
    directions: FloatArray,
    measured: FloatArray,
    variance: float,
    growth: float,
    range_max: float,
    points: FloatArray,
    times: FloatArray,
    between: FloatArray,
    returned: BoolArray,
) -> None:
    """Set the ends of a scan, see ``follow``, with those of the last one."""
    count = measured.shape[0]
    for i in range(count):
        returned[i] = measured[i] < np.inf
        away = measured[i] if returned[i] else range_max
        x, y = origins[i, 0] + away * directions[i, 0], origins[i, 1] + away * directions[i, 1]
        points[i, 0], points[i, 1] = x, y
    for i in range(2 * count - 1):  # the points, then the middles
        k = i if i < count else i - count + 1
        x, y, came, once = points[k, 0], points[k, 1], returned[k], 1.0
        if i >= count:
            half_x, half_y = 0.5 * (x - points[k - 1, 0]), 0.5 * (y - points[k - 1, 1])
            x, y, came = x - half_x, y - half_y, returned[k] or returned[k - 1]
            once = math.exp(-math.hypot(half_x, half_y) / LENGTH)
        origin = origins[k, 0], origins[k, 1]
        once += _met(
            last_points,
            last_times,
            last_between,
            last_returned,
            origin,
            (x, y),
            came,
            variance,
            growth,
        )
        if i < count:
            times[i] = once
        else:
            between[k - 1] = once


@called_with("f2 b1 f1")
@_compile
def share(points: FloatArray, returned: BoolArray, out: FloatArray) -> None:
    """Set ``out`` (n,) to the share that a beam counts beside its neighbours, with ends ``points``.

    Readings of a surface that are evenly spaced by g, with exponential correlation, count as many
    independent ones as tanh(g / 2 LENGTH) times their number.
    """
    before = 1.0
    for i in range(out.shape[0]):
        after = 1.0
        if i + 1 < out.shape[0] and returned[i] and returned[i + 1]:
            gap = math.hypot(points[i + 1, 0] - points[i, 0], points[i + 1, 1] - points[i, 1])
            after = math.tanh(gap / (2.0 * LENGTH))
        out[i] = 0.5 * (before + after)
        before = after


@called_with("f2 b1 f1 f2 f1")
@_compile
def beside(
    points: FloatArray,
    returned: BoolArray,
    times: FloatArray,
    origins: FloatArray,
    out: FloatArray,
) -> None:
    """Set ``out`` (n,) to how often what beams tell was told by earlier ones.

    That is how often the surface at their ends ``points`` was met, ``times`` (n,). A beam that
    passes a nearer surface tells where this ends. That was told as often as the surface was met by
    a neighbouring beam, the less the farther beside it passes.
    """
    for i in range(out.shape[0]):
        x, y, out[i] = origins[i, 0], origins[i, 1], times[i]
        dx, dy = points[i, 0] - x, points[i, 1] - y
        away = max(math.hypot(dx, dy), CLOSEST)
        for k in (i - 1, i + 1):
            if k < 0 or k >= out.shape[0] or not returned[k]:
                continue
            off_x, off_y = points[k, 0] - x, points[k, 1] - y
            if math.hypot(off_x, off_y) > away - STEP:
                continue
            gap = abs(dx * off_y - dy * off_x) / away
            out[i] = max(out[i], 1.0 + (times[k] - 1.0) * math.exp(-gap / LENGTH))

"""Data of the compiled loops for level scans, and the beam model.

A laser that sweeps a horizontal plane sees walls and objects as outlines, lists of segments ``(ax,
ay, bx, by)``. Bearings are compared as pseudo-angles, which grow with the bearing from -2 at -pi to
2 at pi and need no trigonometry. ``beams`` (7, n) has a row for each of the constants below, sorted
by bearing in the robot's frame. ``index`` finds the first beam at or after a bearing. ``sweep``
(3,) is the centre of the beams' origins in the robot's frame and the largest distance of an origin
from it. Poses and placements are (4,): x, y, cosine and sine of the yaw.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from objstate.compiling import called_with, inner, njit, record
from objstate.geometry import BoolArray, FloatArray, IntArray
from objstate.linear import wrapped
from objstate.sensing.beam_model import LEAST_DENSITY
from objstate.sensing.segments import hit

BEARING, DIRECTION_X, DIRECTION_Y, ORIGIN_X, ORIGIN_Y, MEASURED, SHORT = range(7)
CENTRE_X, CENTRE_Y, SPREAD = range(3)
X, Y, COS, SIN = range(4)
PEAK, PER_SIGMA, RANDOM, MISSING, HIT, RANGE_MAX, GAUSSIAN, UNEXPECTED, LASTING = range(9)

FLAT_BELL = 36.0  # exponent from which a Gaussian counts as flat: 2e-16 of its height
DECADES = 150  # decades by which a product may change before it is checked
# products are kept between these, so that one more density can't overflow
SMALL, LARGE = 1e-200, 1e200
GRAZING = 0.1  # cosine of incidence below which a range has no information about a surface's shift

_compile = njit(nogil=True, error_model="numpy", fastmath={"contract"})
_inner = inner(nogil=True, error_model="numpy", fastmath={"contract"})
_maker = inner(makes_arrays=True, nogil=True, error_model="numpy", fastmath={"contract"})
_inner_product = inner(nogil=True, error_model="numpy", fastmath={"contract", "reassoc"})


@record("laser", "i1 f2 i1 f1 f1")
class Beams(NamedTuple):
    """Some beams of a scan and their readings."""

    order: IntArray  # (n,) the beams by bearing
    rows: FloatArray  # (7, n) in that order; (5, n) for a laser, without readings
    lookup: IntArray  # (m + 1,) first beam at or after each of some even steps of the pseudo-angle
    measured: FloatArray  # (n,) m
    short: FloatArray  # (n,) densities of being stopped before the target


@record("scenery", "f2 i1 i1 f2 i1 f1")
class Scenery(NamedTuple):
    """Objects that may each stand in several places."""

    outlines: FloatArray  # (k, 4) segments of all objects in turn
    outline_ends: IntArray  # (j,) where each object's segments end
    rims: IntArray  # (j,) how many of each object's segments are its rim
    placements: FloatArray  # (s, 4) of all objects in turn
    placement_ends: IntArray  # (j,) where each object's placements end
    shares: FloatArray  # (s,) their weights


@called_with("f2 f f2")
@_compile
def with_trigonometry(poses: FloatArray, home: float, out: FloatArray) -> None:
    """Poses (n, 3) as the loops take them, ``out`` (n, 4), with yaws relative to ``home``."""
    for p in range(poses.shape[0]):
        yaw = poses[p, 2] - home
        out[p, X], out[p, Y], out[p, COS], out[p, SIN] = (
            poses[p, 0],
            poses[p, 1],
            np.cos(yaw),
            np.sin(yaw),
        )


@called_with("f f f f f2 f2")
@_compile
def hinged(
    x: float, y: float, direction: float, home: float, states: FloatArray, out: FloatArray
) -> None:
    """Placements ``out`` (s, 4) about the hinge of a leaf, relative to its home state.

    The leaf turns in a direction, 1 or -1.
    """
    for k in range(states.shape[0]):
        turn = direction * (states[k, 0] - home)
        out[k, X], out[k, Y], out[k, COS], out[k, SIN] = x, y, np.cos(turn), np.sin(turn)


@called_with("f2 f2")
@_compile
def stand(poses: FloatArray, out: FloatArray) -> Any:
    """Left, bottom, right and top, m, of the positions of poses (n, 3).

    ``out`` (n, 4) are the poses as the loops take them.
    """
    left, bottom, right, top = np.inf, np.inf, -np.inf, -np.inf
    for p in range(poses.shape[0]):
        x, y, yaw = poses[p, 0], poses[p, 1], poses[p, 2]
        left, bottom, right, top = min(left, x), min(bottom, y), max(right, x), max(top, y)
        out[p, X], out[p, Y], out[p, COS], out[p, SIN] = x, y, np.cos(yaw), np.sin(yaw)
    return left, bottom, right, top


@called_with("f3 f3 f2")
@_compile
def stand_about(poses: FloatArray, out: FloatArray, stds: FloatArray) -> Any:
    """Poses (h, p, 3) in h groups as the loops take them; the largest distance from a mean, m.

    ``out`` (h, p + 1, 4) begins with each group's mean, unless it has one pose alone. ``stds``
    (h, 2) are the deviations of position, m, and yaw, rad.
    """
    count, farthest = poses.shape[1], 0.0
    first = out.shape[1] - count
    for h in range(poses.shape[0]):
        x, y, cos, sin = 0.0, 0.0, 0.0, 0.0
        for p in range(count):
            place, yaw = out[h, first + p], poses[h, p, 2]
            place[X], place[Y] = poses[h, p, 0], poses[h, p, 1]
            place[COS], place[SIN] = np.cos(yaw), np.sin(yaw)
            x, y = x + place[X] / count, y + place[Y] / count
            cos, sin = cos + place[COS], sin + place[SIN]
        xx, xy, yy, turned = 0.0, 0.0, 0.0, 0.0
        yaw = np.arctan2(sin, cos)
        for p in range(count if count > 1 else 0):
            dx, dy = poses[h, p, 0] - x, poses[h, p, 1] - y
            turn = wrapped(poses[h, p, 2] - yaw)
            xx, xy, yy = xx + dx * dx / count, xy + dx * dy / count, yy + dy * dy / count
            turned += turn * turn / count
            farthest = max(farthest, np.hypot(dx, dy))
        stds[h, 0] = np.sqrt(0.5 * (xx + yy) + np.hypot(0.5 * (xx - yy), xy))
        stds[h, 1] = np.sqrt(turned)
        if first > 0:
            mean = out[h, 0]
            mean[X], mean[Y], mean[COS], mean[SIN] = x, y, np.cos(yaw), np.sin(yaw)
    return farthest


@_maker
def taken(chosen: BoolArray, laser: Beams) -> Any:
    """The chosen (n,) beams of a scan: their order (m,), ``beams`` (7, m), and index."""
    count, place = 0, np.empty(chosen.shape[0], dtype=np.int64)
    for i in range(chosen.shape[0]):
        place[i] = count
        count += chosen[i]
    some, beams = np.empty(count, dtype=np.int64), np.empty((7, count))
    # number of chosen beams before each, by bearing
    before = np.empty(chosen.shape[0] + 1, dtype=np.int64)
    k = 0
    for i in range(chosen.shape[0]):
        before[i] = k
        j = laser.order[i]
        if chosen[j]:
            some[k] = place[j]
            for row in range(MEASURED):
                beams[row, k] = laser.rows[row, i]
            beams[MEASURED, k], beams[SHORT, k] = laser.measured[j], laser.short[j]
            k += 1
    before[chosen.shape[0]] = k
    lookup = np.empty(laser.lookup.shape[0], dtype=np.int64)
    for cell in range(lookup.shape[0]):
        lookup[cell] = before[laser.lookup[cell]]
    return some, beams, lookup


@called_with("b1 laser")
@_compile
def take(chosen: BoolArray, laser: Beams) -> Any:
    """``taken``, for Python."""
    return taken(chosen, laser)


@called_with("f1 f f f1")
@_compile
def short(measured: FloatArray, rate: float, peak: float, out: FloatArray) -> None:
    """Densities ``out`` (n,) of being stopped at ``measured`` (n,): ``peak`` exp(-rate d).

    The rate is in 1/m. A missing return was not stopped and counts as if at the laser.
    """
    for i in range(measured.shape[0]):
        stopped = 0.0 if np.isinf(measured[i]) else measured[i]
        out[i] = peak * np.exp(-rate * stopped)


@called_with("f1 f f f1")
@_compile
def lasting(measured: FloatArray, std: float, peak: float, out: FloatArray) -> None:
    """Densities ``out`` (n,) of ranges that continue the previous one ``measured`` (n,).

    They differ by ``std`` m; ``peak`` is the density of equal ranges. Nothing continues from or to
    a missing return.
    """
    for j in range(measured.shape[0]):
        off = (measured[j] - measured[j - 1]) / std if j > 0 else np.inf
        out[j] = peak * np.exp(-0.5 * off * off) if np.isfinite(off) else 0.0


@called_with("i1 f2 f1 f f1")
@_compile
def ends(
    order: IntArray, beams: FloatArray, sweep: FloatArray, height: float, pose: FloatArray
) -> Any:
    """The ends (n, 3) of beams from a robot at a pose (4,), in the scan's order.

    Sorted beam i is ``order[i]`` of the scan.
    """
    out = np.empty((order.shape[0], 3))
    for i in range(order.shape[0]):
        measured = beams[MEASURED, i]
        x = sweep[CENTRE_X] + beams[ORIGIN_X, i] + measured * beams[DIRECTION_X, i]
        y = sweep[CENTRE_Y] + beams[ORIGIN_Y, i] + measured * beams[DIRECTION_Y, i]
        out[order[i], 0] = pose[X] + pose[COS] * x - pose[SIN] * y
        out[order[i], 1] = pose[Y] + pose[SIN] * x + pose[COS] * y
        out[order[i], 2] = height
    return out


@_inner
def _met(
    i: int,
    beams: FloatArray,
    sweep: FloatArray,
    pose: FloatArray,
    place: FloatArray,
    outline: FloatArray,
) -> Any:
    """The range of sorted beam ``i`` to an outline (k, 4) at a place (4,), from a pose (4,)."""
    x, y = sweep[CENTRE_X] + beams[ORIGIN_X, i], sweep[CENTRE_Y] + beams[ORIGIN_Y, i]
    east = pose[X] + pose[COS] * x - pose[SIN] * y - place[X]
    north = pose[Y] + pose[SIN] * x + pose[COS] * y - place[Y]
    dx = pose[COS] * beams[DIRECTION_X, i] - pose[SIN] * beams[DIRECTION_Y, i]
    dy = pose[SIN] * beams[DIRECTION_X, i] + pose[COS] * beams[DIRECTION_Y, i]
    own_x, own_y = place[COS] * east + place[SIN] * north, place[COS] * north - place[SIN] * east
    own_dx, own_dy = place[COS] * dx + place[SIN] * dy, place[COS] * dy - place[SIN] * dx
    nearest = np.inf
    for j in range(outline.shape[0]):
        nearest = min(nearest, hit(own_x, own_y, own_dx, own_dy, outline[j]))
    return nearest


@called_with("b1 i1 f2 f1 f1 f1 f2 f2 f f")
@_compile
def share_explained(
    bears: BoolArray,
    order: IntArray,
    beams: FloatArray,
    sweep: FloatArray,
    pose: FloatArray,
    background: FloatArray,
    placements: FloatArray,
    outline: FloatArray,
    range_max: float,
    margin: float,
) -> Any:
    """Share of the beams reaching an object (n,) which read what is expected, within a margin.

    Expected is the smaller of the ``background`` (n,) and the range to an outline (k, 4) at
    placements (s, 4), from a pose (4,). All ranges beyond ``range_max`` are equal. Sorted beam i is
    ``order[i]`` of the scan, in whose order ``bears`` and ``background`` are.
    """
    bearing, explained = 0, 0
    for i in range(order.shape[0]):
        if not bears[order[i]]:
            continue
        bearing += 1
        alone = np.inf
        for s in range(placements.shape[0]):
            alone = min(alone, _met(i, beams, sweep, pose, placements[s], outline))
        expected = min(background[order[i]], alone)
        off = min(beams[MEASURED, i], range_max) - min(expected, range_max)
        explained += abs(off) <= margin
    return explained / bearing


@called_with("i1 f2 f1 f1 f2 f2 f2")
@_compile
def ranges_to(
    order: IntArray,
    beams: FloatArray,
    sweep: FloatArray,
    pose: FloatArray,
    placements: FloatArray,
    outline: FloatArray,
    out: FloatArray,
) -> None:
    """Ranges ``out`` (s, n) of an outline (k, 4) at placements (s, 4), from one pose (4,)."""
    for s in range(placements.shape[0]):
        for i in range(order.shape[0]):
            out[s, order[i]] = _met(i, beams, sweep, pose, placements[s], outline)


@_inner
def bell(exponent: float) -> Any:
    """exp(-exponent) by squaring; 0 from ``FLAT_BELL`` on.

    The relative error is below 1e-4 up to an exponent of 10, and 2e-6 of the peak beyond.
    """
    part = min(exponent, FLAT_BELL) / 64.0
    value = 1.0 + part * (-1.0 + part * (0.5 + part * (-1.0 / 6.0 + part * (1.0 / 24.0))))
    value *= value
    value *= value
    value *= value
    value *= value
    value *= value
    value *= value
    return value if exponent < FLAT_BELL else 0.0


@_inner
def density(measured: float, short: float, expected: float, model: FloatArray) -> Any:
    """p(d | d-hat) of one beam: AMCL's mixture of four parts, or the paper's Gaussian.

    ``short`` is the density of having been stopped at ``measured`` by something unexpected. A
    missing return (inf) is an event with a probability, not a density.
    """
    if model[GAUSSIAN] > 0.0:
        range_max = model[RANGE_MAX]
        off = (min(measured, range_max) - min(expected, range_max)) * model[PER_SIGMA]
        return max(model[PEAK] * np.exp(-0.5 * off * off), LEAST_DENSITY)
    if measured == np.inf:
        return model[MISSING] + (model[HIT] if expected >= model[RANGE_MAX] else 0.0)
    p = model[RANDOM]
    off = (measured - expected) * model[PER_SIGMA]
    p += model[PEAK] * bell(0.5 * off * off)
    if measured < expected:
        p += short
    return p


@called_with("f1 f1 f2 f1 f2")
@_compile
def log_likelihoods(
    measured: FloatArray,
    short: FloatArray,
    expected: FloatArray,
    model: FloatArray,
    out: FloatArray,
) -> None:
    """Log p(d_i | d-hat_i) of each beam: measured and short (n,), expected and out (m, n)."""
    for row in range(expected.shape[0]):
        for i in range(expected.shape[1]):
            out[row, i] = np.log(density(measured[i], short[i], expected[row, i], model))


@_inner
def _densities(
    measured: FloatArray,
    short: FloatArray,
    expected: FloatArray,
    model: FloatArray,
    out: FloatArray,
) -> None:
    """p(d_i | d-hat_i) of each beam, as ``density``: all arrays (n,), several beams at a time."""
    if model[GAUSSIAN] > 0.0:
        for i in range(out.shape[0]):
            out[i] = density(measured[i], short[i], expected[i], model)
        return
    peak, per_sigma, random = model[PEAK], model[PER_SIGMA], model[RANDOM]
    for i in range(out.shape[0]):
        off = (measured[i] - expected[i]) * per_sigma
        stopped = short[i] if measured[i] < expected[i] else 0.0
        out[i] = random + stopped + peak * bell(0.5 * off * off)
    missing, clear, range_max = model[MISSING], model[MISSING] + model[HIT], model[RANGE_MAX]
    for i in range(out.shape[0]):
        none = clear if expected[i] >= range_max else missing
        out[i] = none if measured[i] == np.inf else out[i]


@_inner
def floor_of(measured: float, model: FloatArray) -> Any:
    """The density of a reading whatever is expected; of a missing return, a probability."""
    if model[GAUSSIAN] > 0.0:
        return LEAST_DENSITY
    return model[MISSING] if measured == np.inf else model[RANDOM]


@_inner
def at_once(short: FloatArray, model: FloatArray) -> Any:
    """The number of densities whose product surely doesn't overflow."""
    highest = model[PEAK] + model[HIT] + model[RANDOM] + model[MISSING]
    for i in range(short.shape[0]):
        highest = max(highest, model[PEAK] + model[RANDOM] + short[i])
    lowest = max(min(floor_of(0.0, model), floor_of(np.inf, model)), SMALL)
    return max(1, int(DECADES / max(np.log10(highest / lowest), 1.0)))


@_inner_product
def _product(factors: FloatArray) -> Any:
    """The product of densities (n,)."""
    product = 1.0
    for i in range(factors.shape[0]):
        product *= factors[i]
    return product


@called_with("f2 f2 f2 f1 f2")
@_compile
def total_log_likelihoods(
    measured: FloatArray,
    short: FloatArray,
    expected: FloatArray,
    model: FloatArray,
    out: FloatArray,
) -> None:
    """Log p(o | d-hat) of all beams of each scan: measured and short (m, n).

    ``expected`` is (p, n), ``out`` (m, p).
    """
    densities = np.empty(expected.shape[1])
    for k in range(measured.shape[0]):
        step = at_once(short[k], model)
        for row in range(expected.shape[0]):
            _densities(measured[k], short[k], expected[row], model, densities)
            out[k, row] = 0.0
            for first in range(0, densities.shape[0], step):
                out[k, row] += np.log(_product(densities[first : first + step]))

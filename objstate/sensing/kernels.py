"""The loops over robot samples, states, segments and beams, compiled.

Everything here is level: a laser that sweeps a horizontal plane sees walls and
objects as outlines, lists of segments ``(ax, ay, bx, by)``. A segment is projected
onto the range of beams that it covers, and each of those keeps the nearest hit.
So the work for a scan grows with its beams, not with beams times segments.

Bearings are compared as pseudo-angles, which grow with the bearing from -2 at -pi
to 2 at pi and need no trigonometry. ``beams`` (7, n) holds a row for each of the
constants below, sorted by bearing in the robot's frame; ``index`` finds the first
beam at or after a bearing; ``sweep`` (3,) is the centre of the beams' origins in
the robot's frame and the largest distance of an origin from it. Poses and
placements come as (4,): x, y, cosine and sine of the yaw.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from objstate.compiling import njit
from objstate.geometry import BoolArray, FloatArray, IntArray

BEARING, DIRECTION_X, DIRECTION_Y, ORIGIN_X, ORIGIN_Y, MEASURED, SHORT = range(7)
CENTRE_X, CENTRE_Y, SPREAD = range(3)
X, Y, COS, SIN = range(4)
PEAK, PER_SIGMA, RANDOM, MISSING, HIT, RANGE_MAX, GAUSSIAN = range(7)

SLACK = 1e-9  # m, or pseudo-angle, by which a beam may pass an end of a segment and still hit
FLAT_BELL = 36.0  # exponent from which the bell is flat: 2e-16 of its height
NEAR_SIGMAS = 4.0  # a range shorter than this many sigmas before an object was stopped by another
LEAST_DENSITY = 1e-100  # of the pure Gaussian, which has no floor of its own (21 sigmas)
SMALL, LARGE = 1e-200, 1e200  # products are kept between these: one density more is still a float
GRAZING = 0.1  # cosine of incidence below which a range says nothing of a shift of the surface
LEAST_SHARE = 1e-12  # what rounding may leave of one when all shares are taken away

_compile = njit(nogil=True, error_model="numpy", fastmath={"contract"})


@_compile
def pseudo_angle(x: float, y: float) -> Any:
    """A number that grows with the bearing of (x, y): -2 at -pi, 0 at 0, 2 at pi."""
    t = abs(y) / (abs(x) + abs(y))
    if x < 0.0:
        t = 2.0 - t
    return -t if y < 0.0 else t


@_compile
def bell(exponent: float) -> Any:
    """exp(-exponent) by squaring, off by less than 1e-4 of itself; 0 from ``FLAT_BELL`` on."""
    part = min(exponent, FLAT_BELL) / 1024.0
    value = 1.0 - part * (1.0 - part / 2.0 * (1.0 - part / 3.0))
    value *= value
    value *= value
    value *= value
    value *= value
    value *= value
    value *= value
    value *= value
    value *= value
    value *= value
    value *= value
    return value if exponent < FLAT_BELL else 0.0


@_compile
def density(measured: float, short: float, expected: float, model: FloatArray) -> Any:
    """p(d | d-hat) of one beam: AMCL's four-part mixture, or the paper's Gaussian.

    ``short`` is the density of having been stopped at ``measured`` by something unexpected.
    A missing return (inf) is an event of its own, with a probability and no density.
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


@_compile
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


@_compile
def _log_product(factors: FloatArray) -> Any:
    """The logarithm of the product of densities (n,)."""
    total, product = 0.0, 1.0
    for i in range(factors.shape[0]):
        product *= factors[i]
        if product < SMALL or product > LARGE:
            total += np.log(product)
            product = 1.0
    return total + np.log(product)


@_compile
def total_log_likelihoods(
    measured: FloatArray,
    short: FloatArray,
    expected: FloatArray,
    model: FloatArray,
    out: FloatArray,
) -> None:
    """Log p(o | d-hat) of all beams together: measured and short (n,), expected (m, n), out (m,)."""
    densities = np.empty(expected.shape[1])
    for row in range(expected.shape[0]):
        _densities(measured, short, expected[row], model, densities)
        out[row] = _log_product(densities)


@_compile
def first_at_or_after(bearing: float, beams: FloatArray, index: IntArray) -> Any:
    """The first beam whose pseudo-angle is not below ``bearing``."""
    count, cells = beams.shape[1], index.shape[0] - 1
    cell = int((bearing + 2.0) * cells / 4.0)
    i = index[min(max(cell, 0), cells)]
    while i < count and beams[BEARING, i] < bearing:
        i += 1
    return i


@_compile
def _hit(
    first: int,
    last: int,
    ax: float,
    ay: float,
    ex: float,
    ey: float,
    beams: FloatArray,
    spread: float,
    nearest: FloatArray,
) -> None:
    """Let beams first..last keep the nearer of what they have and the segment from a along e."""
    if spread == 0.0:  # the beams between the bearings of a segment's ends are those that hit it
        cross = ax * ey - ay * ex
        for i in range(first, last):
            distance = cross / (beams[DIRECTION_X, i] * ey - beams[DIRECTION_Y, i] * ex)
            if 0.0 <= distance < nearest[i]:
                nearest[i] = distance
        return
    length = abs(ex) + abs(ey)
    slack, parallel = SLACK / length, SLACK * length
    for i in range(first, last):
        dx, dy = beams[DIRECTION_X, i], beams[DIRECTION_Y, i]
        turn = dx * ey - dy * ex
        if abs(turn) <= parallel:  # seen from its end, a segment has no width
            continue
        fx, fy = ax - beams[ORIGIN_X, i], ay - beams[ORIGIN_Y, i]
        distance = (fx * ey - fy * ex) / turn
        along = (fx * dy - fy * dx) / turn
        if -slack <= along <= 1.0 + slack and 0.0 <= distance < nearest[i]:
            nearest[i] = distance


@_compile
def _project(
    ax: float,
    ay: float,
    bx: float,
    by: float,
    beams: FloatArray,
    index: IntArray,
    spread: float,
    nearest: FloatArray,
) -> Any:
    """Project one segment, given relative to the sweep's centre; return the beams it may touch.

    The returned bounds (first, last) cover all touched beams; where the segment
    lies across the bearing of pi they are those of the whole sweep.
    """
    count = beams.shape[1]
    ex, ey = bx - ax, by - ay
    cross = ax * by - ay * bx
    if cross < 0.0:
        ax, ay, bx, by, ex, ey = bx, by, ax, ay, -ex, -ey
    if spread == 0.0 and abs(cross) <= SLACK * (abs(ex) + abs(ey)):  # seen from its end: no width
        return count, 0
    margin = SLACK
    if spread > 0.0:  # origins off the centre see the ends at other bearings
        length_squared = ex * ex + ey * ey
        if length_squared == 0.0:
            return count, 0
        along = min(max(-(ax * ex + ay * ey) / length_squared, 0.0), 1.0)
        gap = np.sqrt((ax + along * ex) ** 2 + (ay + along * ey) ** 2)
        if gap <= spread + SLACK:
            _hit(0, count, ax, ay, ex, ey, beams, spread, nearest)
            return 0, count
        margin += np.arcsin(spread / gap)  # a pseudo-angle grows no faster than its angle
    start, end = pseudo_angle(ax, ay), pseudo_angle(bx, by)
    if end < start:
        end += 4.0
    start, end = start - margin, end + margin
    if end - start >= 4.0:
        _hit(0, count, ax, ay, ex, ey, beams, spread, nearest)
        return 0, count
    if start < -2.0:
        start, end = start + 4.0, end + 4.0
    if end > 2.0:
        first = first_at_or_after(start, beams, index)
        last = first_at_or_after(end - 4.0, beams, index)
        _hit(first, count, ax, ay, ex, ey, beams, spread, nearest)
        _hit(0, last, ax, ay, ex, ey, beams, spread, nearest)
        return 0, count
    first, last = first_at_or_after(start, beams, index), first_at_or_after(end, beams, index)
    _hit(first, last, ax, ay, ex, ey, beams, spread, nearest)
    return first, last


@_compile
def _project_outline(
    pose: FloatArray,
    placement: FloatArray,
    outline: FloatArray,
    convex: bool,
    beams: FloatArray,
    index: IntArray,
    sweep: FloatArray,
    nearest: FloatArray,
) -> Any:
    """Project an outline (k, 4) that stands at a placement, seen from a pose; beams it may touch.

    A convex outline runs clockwise; from one place outside, only its near side is seen.
    """
    dx, dy = placement[X] - pose[X], placement[Y] - pose[Y]
    x = pose[COS] * dx + pose[SIN] * dy - sweep[CENTRE_X]
    y = -pose[SIN] * dx + pose[COS] * dy - sweep[CENTRE_Y]
    cos = placement[COS] * pose[COS] + placement[SIN] * pose[SIN]
    sin = placement[SIN] * pose[COS] - placement[COS] * pose[SIN]
    one_sided = convex and sweep[SPREAD] == 0.0
    first, last = beams.shape[1], 0
    while True:
        inside = one_sided
        for k in range(outline.shape[0]):
            ax = x + cos * outline[k, 0] - sin * outline[k, 1]
            ay = y + sin * outline[k, 0] + cos * outline[k, 1]
            bx = x + cos * outline[k, 2] - sin * outline[k, 3]
            by = y + sin * outline[k, 2] + cos * outline[k, 3]
            if one_sided and ax * by - ay * bx <= 0.0:
                continue
            inside = False
            begin, end = _project(ax, ay, bx, by, beams, index, sweep[SPREAD], nearest)
            first, last = min(first, begin), max(last, end)
        if not inside:
            return first, last
        one_sided = False


@_compile
def cast(
    poses: FloatArray,
    placements: FloatArray,
    outline: FloatArray,
    convex: bool,
    beams: FloatArray,
    index: IntArray,
    sweep: FloatArray,
    out: FloatArray,
) -> None:
    """Ranges ``out`` (p, s, n) from poses (p, 4) to an outline (k, 4) in placements (s, 4).

    Each beam keeps what ``out`` held where that is nearer.
    """
    for p in range(poses.shape[0]):
        for s in range(placements.shape[0]):
            _project_outline(
                poses[p], placements[s], outline, convex, beams, index, sweep, out[p, s]
            )


@_compile
def mark_seen(
    poses: FloatArray,
    outline: FloatArray,
    beams: FloatArray,
    index: IntArray,
    sweep: FloatArray,
    seen: BoolArray,
) -> None:
    """Set ``seen`` (k,) for the segments of an outline (k, 4) that some beam hits from some pose."""
    fixed = np.array([0.0, 0.0, 1.0, 0.0])
    alone, nearest = np.full(beams.shape[1], np.inf), np.empty(beams.shape[1])
    by = np.empty(beams.shape[1], dtype=np.int64)  # which segment each beam hits
    for p in range(poses.shape[0]):
        for i in range(beams.shape[1]):
            nearest[i], by[i] = np.inf, -1
        for k in range(outline.shape[0]):
            first, last = _project_outline(
                poses[p], fixed, outline[k : k + 1], False, beams, index, sweep, alone
            )
            for i in range(first, last):
                if alone[i] < nearest[i]:
                    nearest[i], by[i] = alone[i], k
                alone[i] = np.inf
        for i in range(beams.shape[1]):
            if by[i] >= 0:
                seen[by[i]] = True


@_compile
def pose_log_likelihood(
    poses: FloatArray,
    expected: FloatArray,
    order: IntArray,
    outlines: FloatArray,
    outline_ends: IntArray,
    convex: BoolArray,
    placements: FloatArray,
    placement_ends: IntArray,
    shares: FloatArray,
    beams: FloatArray,
    index: IntArray,
    sweep: FloatArray,
    model: FloatArray,
    out: FloatArray,
) -> None:
    """Log p(o | l) ``out`` (p,), each beam averaged over where uncertain objects may be.

    Object j has the rows of ``outlines`` up to ``outline_ends[j]``, is ``convex[j]`` or
    not, and may stand at the ``placements`` up to ``placement_ends[j]``, with weights ``shares``. Where it is
    nearer than what is ``expected`` (p, n) of all else, it is what the beam should read; else the
    beam keeps the likelihood it had. Sorted beam i has the column ``order[i]`` of it.
    """
    count = beams.shape[1]
    nearest = np.empty(count)
    alone = np.full(count, np.inf)
    likelihood = np.empty(count)
    mixed = np.zeros(count)
    kept = np.ones(count)
    for p in range(poses.shape[0]):
        for i in range(count):
            nearest[i] = expected[p, order[i]]
        _densities(beams[MEASURED], beams[SHORT], nearest, model, likelihood)
        outline_start, placement_start = 0, 0
        for j in range(outline_ends.shape[0]):
            outline = outlines[outline_start : outline_ends[j]]
            begin, end = count, 0
            for s in range(placement_start, placement_ends[j]):
                first, last = _project_outline(
                    poses[p], placements[s], outline, convex[j], beams, index, sweep, alone
                )
                begin, end = min(begin, first), max(end, last)
                for i in range(first, last):
                    distance = alone[i]
                    alone[i] = np.inf
                    if distance < nearest[i]:
                        measured, short = beams[MEASURED, i], beams[SHORT, i]
                        mixed[i] += shares[s] * density(measured, short, distance, model)
                        kept[i] -= shares[s]
            for i in range(begin, end):
                rest = kept[i] if kept[i] > LEAST_SHARE else 0.0
                likelihood[i] = rest * likelihood[i] + mixed[i]
                mixed[i] = 0.0
                kept[i] = 1.0
            outline_start, placement_start = outline_ends[j], placement_ends[j]
        out[p] = _log_product(likelihood)

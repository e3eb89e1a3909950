"""Compiled loops of light checks: the beams that can meet an object, and their likelihoods."""

from __future__ import annotations

from typing import Any

import numpy as np

from objstate.compiling import called_with, inner, njit
from objstate.geometry import FloatArray, IntArray

X, Y, COS, SIN = range(4)
PEAK_SHARE, MISSING, SHORT, RATE, RANDOM, RANGE_MAX, TEMPERING = range(7)
MOST = 48  # beams that a check uses; of more, every second, third, ...
FLAT = 6.0  # standard deviations beyond which a hit is impossible: 1e-8 of its peak
SOON = 3.0  # standard deviations before an object at which a beam counts as stopped before it
WIDE = 1.5  # rad to either side, from which on a sector leaves out no segment
LOGGED = 16  # beams whose densities are multiplied before a logarithm is taken
BELIEVED, ELSEWHERE, ABSENT = range(3)

_inner = inner(nogil=True, error_model="numpy")


@called_with("f1 f2 f f f1")
@njit(nogil=True, error_model="numpy")
def sector(
    laser: FloatArray,  # (4,) x, y, cos, sin of its pose
    corners: FloatArray,  # (c, 2) m, of the region
    std: float,  # m, of the robot's position
    yaw_std: float,  # rad
    out: FloatArray,  # (4,) lowest and highest bearing, rad from the laser's heading; near, far, m
) -> None:
    """Bearings and ranges of a region, widened by two deviations of the robot's error."""
    _sector(laser, corners, std, yaw_std, out)


@_inner
def _sector(
    laser: FloatArray, corners: FloatArray, std: float, yaw_std: float, out: FloatArray
) -> None:
    middle_x, middle_y = corners[:, 0].mean() - laser[X], corners[:, 1].mean() - laser[Y]
    towards = np.arctan2(
        laser[COS] * middle_y - laser[SIN] * middle_x, laser[COS] * middle_x + laser[SIN] * middle_y
    )
    low, high, near, far, inside = 0.0, 0.0, np.inf, 0.0, True
    for k in range(len(corners)):
        ax, ay = corners[k, 0] - laser[X], corners[k, 1] - laser[Y]
        b = (k + 1) % len(corners)
        bx, by = corners[b, 0] - laser[X], corners[b, 1] - laser[Y]
        turn = np.arctan2(middle_x * ay - middle_y * ax, middle_x * ax + middle_y * ay)
        low, high = min(low, turn), max(high, turn)
        far = max(far, np.hypot(ax, ay))
        dx, dy = bx - ax, by - ay
        share = min(max(-(ax * dx + ay * dy) / (dx * dx + dy * dy), 0.0), 1.0)
        near = min(near, np.hypot(ax + share * dx, ay + share * dy))
        inside = inside and ax * dy - ay * dx <= 0.0
    if inside:
        out[0], out[1], out[2], out[3] = -np.pi, np.pi, 0.0, far + 2.0 * std
        return
    wider = 2.0 * (yaw_std + std / max(near, std))
    out[0], out[1] = towards + low - wider, towards + high + wider
    out[2], out[3] = max(near - 2.0 * std, 0.0), far + 2.0 * std


@_inner
def _meets(x: float, y: float, dx: float, dy: float, segment: FloatArray) -> float:
    """Range at which a beam from (x, y) meets a segment (4,); inf where it doesn't."""
    ax, ay = segment[0] - x, segment[1] - y
    ex, ey = segment[2] - segment[0], segment[3] - segment[1]
    across = dx * ey - dy * ex
    if across == 0.0:
        return np.inf
    along = (ax * ey - ay * ex) / across
    share = (ax * dy - ay * dx) / across
    return along if along > 0.0 and -1e-9 <= share <= 1.0 + 1e-9 else np.inf


@_inner
def _beams_in(sector_: FloatArray, bearings: FloatArray, ranges: FloatArray, out: IntArray) -> int:
    """Numbers ``out`` of the beams in a sector that read anything, and how many they are."""
    middle, half, count = (sector_[0] + sector_[1]) / 2.0, (sector_[1] - sector_[0]) / 2.0, 0
    for j in range(len(bearings)):
        turn = bearings[j] - middle
        turn -= 2.0 * np.pi * np.rint(turn / (2.0 * np.pi))
        if abs(turn) <= half and ranges[j] == ranges[j] and ranges[j] != -np.inf:
            out[count] = j
            count += 1
    return count


@_inner
def _segments_in(laser: FloatArray, sector_: FloatArray, around: FloatArray, out: IntArray) -> int:
    """Numbers ``out`` of the segments that may reach into a sector, and how many they are."""
    middle, half, count = (sector_[0] + sector_[1]) / 2.0, (sector_[1] - sector_[0]) / 2.0, 0
    to_x = laser[COS] * np.cos(middle) - laser[SIN] * np.sin(middle)
    to_y = laser[SIN] * np.cos(middle) + laser[COS] * np.sin(middle)
    is_narrow, steep = half < WIDE, np.tan(min(half, WIDE))
    for m in range(len(around)):
        ax, ay = around[m, 0] - laser[X], around[m, 1] - laser[Y]
        bx, by = around[m, 2] - laser[X], around[m, 3] - laser[Y]
        a_on, b_on = (ax * to_x + ay * to_y) * steep, (bx * to_x + by * to_y) * steep
        a_left, b_left = to_x * ay - to_y * ax, to_x * by - to_y * bx
        left, right = a_left > a_on and b_left > b_on, -a_left > a_on and -b_left > b_on
        if not (is_narrow and (left or right or (a_on <= 0.0 and b_on <= 0.0))):
            out[count] = m
            count += 1
    return count


@_inner
def _outline_at(x: float, y: float, dx: float, dy: float, outline: FloatArray) -> float:
    """Range at which a beam from (x, y) first meets an outline (k, 4)."""
    least = np.inf
    for k in range(len(outline)):
        least = min(least, _meets(x, y, dx, dy, outline[k]))
    return least


@called_with("f1 f1 f2 f2 f2")
@njit(nogil=True, error_model="numpy")
def ranges_of(
    laser: FloatArray,  # (4,)
    bearings: FloatArray,  # (n,) rad
    shape: FloatArray,  # (k, 4) segments in the shape's own frame
    placements: FloatArray,  # (s, 4) of it
    out: FloatArray,  # (s, n) m, inf where a beam doesn't meet it
) -> None:
    """What beams read of a shape alone."""
    for s in range(len(placements)):
        off_x, off_y = laser[X] - placements[s, X], laser[Y] - placements[s, Y]
        cos, sin = placements[s, COS], placements[s, SIN]
        x, y = cos * off_x + sin * off_y, cos * off_y - sin * off_x
        for j in range(len(bearings)):
            along, aside = np.cos(bearings[j]), np.sin(bearings[j])
            dx, dy = (
                laser[COS] * along - laser[SIN] * aside,
                laser[SIN] * along + laser[COS] * aside,
            )
            out[s, j] = _outline_at(x, y, cos * dx + sin * dy, cos * dy - sin * dx, shape)


@_inner
def _by_hypothesis(
    totals: FloatArray,
    hypotheses: IntArray,
    log_weights: FloatArray,
    tempering: float,
    out: FloatArray,
) -> None:
    """Tempered log-likelihoods ``out`` (3,) by those of states (s + 1,), absence last."""
    states, top = len(hypotheses), totals[0]
    for s in range(1, len(totals)):
        top = max(top, totals[s])
    out[:] = 0.0
    for s in range(states):
        out[hypotheses[s]] += np.exp(tempering * (totals[s] - top) + log_weights[s])
    for h in range(ABSENT):
        out[h] = np.log(out[h]) + tempering * top
    out[ABSENT] = tempering * totals[states]


@called_with("f1 f1 f1 f1 f2 i1 f2 f f2 f1 i1 f1 f f1 f1 f1")
@njit(nogil=True, error_model="numpy")
def check(
    laser: FloatArray,  # (4,) x, y, cos, sin of its pose
    bearings: FloatArray,  # (n,) rad, from its heading
    ranges: FloatArray,  # (n,) m
    sector_: FloatArray,  # (4,) as ``sector`` has it
    around: FloatArray,  # (m, 4) segments of walls and of other objects, m
    owners: IntArray,  # (m,) numbers of what they belong to
    outline: FloatArray,  # (k, 4) segments of the object, in its own frame
    radius: float,  # m, about its origin, that holds the outline
    placements: FloatArray,  # (s, 4) x, y, cos, sin of it in each state; the first as believed
    variances: FloatArray,  # (s,) m^2 of a hit, in each state
    hypotheses: IntArray,  # (s,) which hypothesis each state is of
    log_weights: FloatArray,  # (s,) of the states of a hypothesis, which sum to one
    background: float,  # m^2, variance of a hit on the background
    model: FloatArray,  # (7,)
    out: FloatArray,  # (3,) log-likelihoods of the hypotheses
    hidden: FloatArray,  # (o + 1,) beams stopped before the object, by owner; last: by none of them
) -> Any:
    """Beams used, and beams that would meet the object were nothing before it."""
    states, reach = len(placements), model[RANGE_MAX]
    chosen, near = np.empty(len(bearings), np.int64), np.empty(len(around), np.int64)
    count = _beams_in(sector_, bearings, ranges, chosen)
    close = _segments_in(laser, sector_, around, near)
    own_x, own_y = np.empty(states), np.empty(states)  # the laser as the object sees it
    for s in range(states):
        off_x, off_y = laser[X] - placements[s, X], laser[Y] - placements[s, Y]
        own_x[s] = placements[s, COS] * off_x + placements[s, SIN] * off_y
        own_y[s] = placements[s, COS] * off_y - placements[s, SIN] * off_x
    totals, product, used, bears = np.zeros(states + 1), np.ones(states + 1), 0, 0
    for c in range(0, count, max((count + MOST - 1) // MOST, 1)):
        reading, bearing = ranges[chosen[c]], bearings[chosen[c]]
        cos, sin = np.cos(bearing), np.sin(bearing)
        dx, dy = laser[COS] * cos - laser[SIN] * sin, laser[SIN] * cos + laser[COS] * sin
        behind, owner = np.inf, -1
        for m in range(close):
            meets = _meets(laser[X], laser[Y], dx, dy, around[near[m]])
            if meets < behind:
                behind, owner = meets, owners[near[m]]
        short = model[SHORT] * model[RATE] * np.exp(-model[RATE] * reading)
        absent = _density(reading, behind, background, short, model)
        product[states] *= absent
        for s in range(states):
            cos, sin = placements[s, COS], placements[s, SIN]
            ox, oy = cos * dx + sin * dy, cos * dy - sin * dx
            if abs(own_x[s] * oy - own_y[s] * ox) > radius:
                product[s] *= absent
                continue
            alone = _outline_at(own_x[s], own_y[s], ox, oy, outline)
            if alone < behind:
                product[s] *= _density(reading, alone, variances[s], short, model)
            else:
                product[s] *= absent
            if s == 0 and alone < reach:
                bears += 1
                if reading < alone - SOON * np.sqrt(variances[0]):
                    is_known = abs(reading - behind) <= SOON * np.sqrt(background)
                    hidden[owner if is_known else len(hidden) - 1] += 1.0
        used += 1
        if used % LOGGED == 0:
            totals += np.log(product)
            product[:] = 1.0
    totals += np.log(product)
    _by_hypothesis(totals, hypotheses, log_weights, model[TEMPERING], out)
    return used, bears


@_inner
def _density(
    reading: float, expected: float, variance: float, short: float, model: FloatArray
) -> Any:
    """Of a reading where a range is expected: AMCL's mixture."""
    if reading >= model[RANGE_MAX]:
        return model[MISSING] + (model[PEAK_SHARE] if expected >= model[RANGE_MAX] else 0.0)
    density = model[RANDOM] / model[RANGE_MAX]
    off = reading - expected
    if reading < expected:
        density += short
    squared = off * off / variance
    if squared < FLAT * FLAT:
        density += model[PEAK_SHARE] * np.exp(-0.5 * squared) / np.sqrt(2.0 * np.pi * variance)
    return density

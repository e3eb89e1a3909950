"""How likely beams are for a doorway with its leaf at many angles, compiled.

Beams (9, n) have the rows below. Only what they meet within a disc about the doorway counts: a
beam that passes the disc says no more than that, so nothing has to be known of what lies behind.
Within the disc, something may stand where the map knows nothing, from ``UNKNOWN`` m on.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from objstate.compiling import called_with, inner, njit
from objstate.geometry import BoolArray, FloatArray, IntArray

ORIGIN_X, ORIGIN_Y, DIRECTION_X, DIRECTION_Y, RANGE, PAST, REACH, SHORT, UNKNOWN, _ROWS = range(10)
HIT, PER_SIGMA, PEAK, RANDOM, MISSING = range(5)  # of the beam model
LEAST_CROSS = 0.05  # sine of the incidence below which a beam doesn't tell of a surface
UNDRAWN = 0.5  # probability that something stands where the map knows nothing
LEAST_UNKNOWN = 2  # cells in a row: maps leave single ones out
SOFT = 0.03  # m over which a leaf's edges fade: a beam's width, and where the robot was
# A map's walls end half a cell before or behind where they should, so a beam may pass them on
# either side: m by which it does so farther to the left, and how probable that is, by Gauss and
# Hermite's rule for a deviation of 1.75 cm.
ASIDE, SHARES = (0.0, -0.03, 0.03), (2.0 / 3.0, 1.0 / 6.0, 1.0 / 6.0)

_inner = inner(nogil=True, error_model="numpy", fastmath={"contract"})
_compile = njit(nogil=True, error_model="numpy", fastmath={"contract"})


@_inner
def density(beams: FloatArray, j: int, expected: float, model: FloatArray) -> Any:
    """Of beam ``j`` where something is expected at a distance; infinity where nothing is in the disc."""
    measured, past, unknown = beams[RANGE, j], beams[PAST, j], beams[UNKNOWN, j]
    drawn = 1.0 - UNDRAWN if unknown < expected else 1.0
    rest = model[RANDOM] * max(1.0 - past / beams[REACH, j], 0.0) + model[MISSING]
    if measured >= past:
        return rest + (drawn * model[HIT] if expected == np.inf else 0.0)
    floor = model[RANDOM] / beams[REACH, j] + (beams[SHORT, j] if measured < expected else 0.0)
    if unknown < measured and unknown < expected:
        floor += model[HIT] * UNDRAWN / (past - unknown)
    if expected == np.inf:
        return floor
    off = (measured - expected) * model[PER_SIGMA]
    return floor + drawn * model[PEAK] * np.exp(-0.5 * off * off)


@_inner
def densities(
    beams: FloatArray, j: int, expected: FloatArray, nearer: float, model: FloatArray
) -> Any:
    """Of beam ``j`` on average over where it may pass, if nothing is ``nearer`` than so many metres.

    ``expected`` (3, n) are the distances to the map, ``ASIDE`` of beams.
    """
    total = 0.0
    for k in range(len(SHARES)):
        total += SHARES[k] * density(beams, j, min(expected[k, j], nearer), model)
    return total


@called_with("f2 b2 f1 f f1")
@_compile
def enter_unknown(
    beams: FloatArray, known: BoolArray, corner: FloatArray, cells: float, out: FloatArray
) -> None:
    """Distance ``out`` (n,) from which on a map knows nothing; inf beyond the disc.

    ``known`` are its cells (rows, columns), ``corner`` (3,) its pose, ``cells`` how many a metre has.
    """
    cos, sin = np.cos(corner[2]) * cells, np.sin(corner[2]) * cells
    rows, columns = known.shape
    for j in range(beams.shape[1]):
        x, y = beams[ORIGIN_X, j] - corner[0], beams[ORIGIN_Y, j] - corner[1]
        dx, dy = beams[DIRECTION_X, j], beams[DIRECTION_Y, j]
        out[j] = np.inf
        blank = 0
        for step in range(int(beams[PAST, j] * cells)):
            way = step / cells
            px, py = x + way * dx, y + way * dy
            column, row = int(np.floor(px * cos + py * sin)), int(np.floor(py * cos - px * sin))
            inside = 0 <= row < rows and 0 <= column < columns
            blank = 0 if inside and known[row, column] else blank + 1
            if blank > LEAST_UNKNOWN:
                out[j] = way - LEAST_UNKNOWN / cells
                break


@called_with("f2 f2 i1 f1 f1")
@_compile
def background_log_likelihood(
    beams: FloatArray, expected: FloatArray, group: IntArray, model: FloatArray, out: FloatArray
) -> None:
    """Sum into ``out`` (groups,) the log-densities of beams for what is expected (3, n)."""
    for j in range(beams.shape[1]):
        out[group[j]] += np.log(densities(beams, j, expected, np.inf, model))


@called_with("f2 f2 i1 f2 f f1 f2")
@_compile
def leaf_gain(
    beams: FloatArray,
    expected: FloatArray,
    group: IntArray,
    leaves: FloatArray,
    half: float,
    model: FloatArray,
    out: FloatArray,
) -> None:
    """By how much a leaf makes the beams of each group likelier: ``out`` (leaves, groups), to be zero.

    ``leaves`` (m, 4) are its hinge, bearing and width; it is ``half`` m thick to either side.
    Without it (3, n) is ``expected``.
    """
    count = leaves.shape[0]
    along_x, along_y = np.cos(leaves[:, 2]), np.sin(leaves[:, 2])
    middle_x, middle_y, radius = leaves[:, 0].mean(), leaves[:, 1].mean(), 0.0
    for m in range(count):
        off = np.hypot(leaves[m, 0] - middle_x, leaves[m, 1] - middle_y)
        radius = max(radius, off + leaves[m, 3] + SOFT)
    for j in range(beams.shape[1]):
        ox, oy = beams[ORIGIN_X, j], beams[ORIGIN_Y, j]
        dx, dy = beams[DIRECTION_X, j], beams[DIRECTION_Y, j]
        nearest = min(max(expected[0, j], expected[1, j], expected[2, j]), beams[PAST, j])
        x, y = middle_x - ox, middle_y - oy
        if abs(x * dy - y * dx) > radius or x * dx + y * dy - radius > nearest + half:
            continue
        without = -1.0
        for m in range(count):
            ux, uy = along_x[m], along_y[m]
            ax, ay = leaves[m, 0] - ox, leaves[m, 1] - oy
            aside, width = ax * dy - ay * dx, leaves[m, 3]
            if abs(aside) > width + SOFT:
                continue
            cross = dx * uy - dy * ux
            sine = abs(cross)
            if sine < LEAST_CROSS:
                continue
            if cross < 0.0:
                aside = -aside
            met = min(aside, width * sine - aside) / SOFT + 0.5
            if met <= 0.0:
                continue
            along = (ax * uy - ay * ux) / cross - half / sine
            if along <= 0.0 or along >= nearest:
                continue
            met = min(met, 1.0)
            if without < 0.0:
                without = densities(beams, j, expected, np.inf, model)
            there = densities(beams, j, expected, along, model)
            out[m, group[j]] += np.log(met * there / without + 1.0 - met)


@called_with("f2 f2 i1 f1 i f i1 f1")
@_compile
def nearest_line(
    ends: FloatArray,
    directions: FloatArray,
    about: IntArray,
    line: FloatArray,
    number: int,
    steep: float,
    of: IntArray,
    aside: FloatArray,
) -> None:
    """Note a line as that of ends which lie nearer to it than to those before: ``of`` (n,).

    ``ends`` (n, 2) and ``directions`` (n, 2) are of beams, ``about`` (k,) the numbers of those that
    may be near, ``line`` (5,) start, unit vector and length, which beams meet steeply. ``aside``
    (n,) is how far to their line's left ends lie, m; at first, how near they have to lie.
    """
    ux, uy, length = line[2], line[3], line[4]
    for j in about:
        x, y = ends[j, 0] - line[0], ends[j, 1] - line[1]
        off = ux * y - uy * x
        place = ux * x + uy * y
        if not abs(off) < abs(aside[j]) or not 0.0 < place < length:
            continue
        if abs(ux * directions[j, 1] - uy * directions[j, 0]) > steep:
            of[j], aside[j] = number, off


@called_with("f2 f2 f1 f1 f1 f f i1 f1 f1")
@_compile
def crossed(
    origins: FloatArray,
    directions: FloatArray,
    ranges: FloatArray,
    reach: FloatArray,
    line: FloatArray,
    steep: float,
    margin: float,
    numbers: IntArray,
    places: FloatArray,
    beyond: FloatArray,
) -> int:
    """How many beams cross a line (5,) steeply, or would if they got so far.

    Places up to ``margin`` m beside it count. The first of ``numbers`` (n,) get the beams' numbers,
    ``places`` (n,) where along the line, ``beyond`` (n,) how far they get beyond it, m.
    """
    ux, uy = line[2], line[3]
    count = 0
    for j in range(len(ranges)):
        cosine = ux * directions[j, 1] - uy * directions[j, 0]
        if abs(cosine) <= steep:
            continue
        x, y = origins[j, 0] - line[0], origins[j, 1] - line[1]
        way = (uy * x - ux * y) / cosine
        if not 0.2 < way < reach[j]:
            continue
        place = ux * (x + way * directions[j, 0]) + uy * (y + way * directions[j, 1])
        if not -margin < place < line[4] + margin:
            continue
        numbers[count], places[count] = j, place
        beyond[count] = (ranges[j] - way) * abs(cosine)
        count += 1
    return count


@called_with("f2 f2 f1 i1 i1 f1 f i1 f1")
@_compile
def through(
    origins: FloatArray,
    directions: FloatArray,
    ranges: FloatArray,
    scans: IntArray,
    chosen: IntArray,
    middle: FloatArray,
    radius: float,
    index: IntArray,
    past: FloatArray,
) -> int:
    """How many beams of the chosen scans reach a disc.

    Scan k has the beams from ``scans[k]`` on. The first of ``index`` (n,) get their numbers,
    ``past`` (n,) how far along they leave the disc, m.
    """
    count = 0
    for k in chosen:
        for j in range(scans[k], scans[k + 1]):
            x, y = middle[0] - origins[j, 0], middle[1] - origins[j, 1]
            along = x * directions[j, 0] + y * directions[j, 1]
            half2 = radius * radius - (x * x + y * y - along * along)
            if half2 <= 0.0:
                continue
            half = np.sqrt(half2)
            if along + half <= 0.0 or not ranges[j] > along - half:
                continue
            index[count], past[count] = j, along + half
            count += 1
    return count


@called_with("f2 f2 f2 f1 f1")
@_compile
def chain(
    first: FloatArray, prior: FloatArray, gain: FloatArray, stays: FloatArray, out: FloatArray
) -> None:
    """Log evidence ``out`` (u,) of looks with log-likelihoods ``gain`` (s, groups), by states (s,).

    ``first`` (u, s) and ``prior`` (u, s) are log-probabilities of states in the map and of those
    drawn anew; between looks a state stays with the probabilities ``stays`` (groups,).
    """
    rows, states = first.shape
    groups = gain.shape[1]
    most = np.empty(groups)
    likely = np.empty((groups, states))
    for k in range(groups):
        most[k] = gain[:, k].max()
        likely[k] = np.exp(gain[:, k] - most[k])
    for u in range(rows):
        highest = first[u].max()
        before, anew = np.exp(first[u] - highest), np.exp(prior[u])
        total = before.sum()
        log = highest
        for k in range(groups):
            moved = (1.0 - stays[k]) * total
            total = 0.0
            for s in range(states):
                before[s] = (stays[k] * before[s] + moved * anew[s]) * likely[k, s]
                total += before[s]
            log += most[k] + np.log(total)
            before /= total
            total = 1.0
        out[u] = log + np.log(total)


@_inner
def _quantile(ordered: FloatArray, share: float) -> Any:
    place = share * (len(ordered) - 1)
    low = int(place)
    high = min(low + 1, len(ordered) - 1)
    return ordered[low] + (place - low) * (ordered[high] - ordered[low])


@called_with("f2 f1 f f1 f f f1")
@_compile
def off_drawn(
    away: FloatArray,
    bearings: FloatArray,
    width: float,
    stds: FloatArray,
    last: float,
    most: float,
    out: FloatArray,
) -> None:
    """Squared deviations ``out`` (a,) of leaves from what a map shows.

    That is points ``away`` (m, 2) m from the hinge. ``stds`` (4,) are of the turn, of the place
    aside, of an end beyond the leaf's and before it; the share ``last`` of the points lies before
    the end. From ``most`` on, all count the same.
    """
    count = len(away)
    middle_x, middle_y = away[:, 0].mean(), away[:, 1].mean()
    for a in range(len(bearings)):
        cos, sin = np.cos(bearings[a]), np.sin(bearings[a])
        along, aside = np.empty(count), np.empty(count)
        spread = both = 0.0
        middle = cos * middle_x + sin * middle_y
        for i in range(count):
            along[i] = cos * away[i, 0] + sin * away[i, 1]
            aside[i] = cos * away[i, 1] - sin * away[i, 0]
            spread += (along[i] - middle) ** 2
            both += aside[i] * (along[i] - middle)
        out[a] = (both / max(spread, 1e-9) / stds[0]) ** 2
        if out[a] < most:
            out[a] += (_quantile(np.sort(aside), 0.5) / stds[1]) ** 2
            end = _quantile(np.sort(along), last) - width
            out[a] += (end / (stds[2] if end > 0.0 else stds[3])) ** 2


@called_with("f2 f2 f1 f b3")
@_compile
def shown_along(
    points: FloatArray, hinges: FloatArray, bearings: FloatArray, size: float, out: BoolArray
) -> None:
    """Which bins of ``size`` m along rays points (m, 2) show that lie as near to these: ``out``.

    Rays begin at ``hinges`` (h, 2) and run along ``bearings`` (t,); ``out`` (h, t, bins) is false
    to begin with.
    """
    cosines, sines = np.cos(bearings), np.sin(bearings)
    bins = out.shape[2]
    for h in range(len(hinges)):
        for i in range(len(points)):
            x, y = points[i, 0] - hinges[h, 0], points[i, 1] - hinges[h, 1]
            far = int(np.sqrt(x * x + y * y) / size)
            if far >= bins:
                continue
            for t in range(len(bearings)):
                aside = cosines[t] * y - sines[t] * x
                if abs(aside) < size and x * cosines[t] + y * sines[t] > 0.0:
                    out[h, t, far] = True


@called_with("f1 f f f2 f2")
@_compile
def stretches(
    told: FloatArray, leaves: float, begins: float, before: FloatArray, after: FloatArray
) -> None:
    """Of a chain of two states, that of wall and another, what bins on either side of a place tell.

    ``told`` (n,) are log-odds of wall by each bin, ``leaves`` and ``begins`` the probabilities of
    leaving wall and of coming to it from bin to bin. ``before`` (n + 1, 2) gets the probabilities
    of the states at each bin by those before it, ``after`` (n + 1, 2) the likelihoods of those from
    it on, up to a factor.
    """
    count = len(told)
    before[0, 0] = begins / (begins + leaves)
    before[0, 1] = 1.0 - before[0, 0]
    after[count] = 0.5
    for k in range(count):
        wall, other = before[k, 0] * np.exp(told[k]), before[k, 1]
        total = wall + other
        before[k + 1, 0] = (wall - leaves * wall + begins * other) / total
        before[k + 1, 1] = (other - begins * other + leaves * wall) / total
    for k in range(count - 1, -1, -1):
        wall = after[k + 1, 0] + leaves * (after[k + 1, 1] - after[k + 1, 0])
        other = after[k + 1, 1] + begins * (after[k + 1, 0] - after[k + 1, 1])
        wall *= np.exp(told[k])
        after[k, 0], after[k, 1] = wall / (wall + other), other / (wall + other)


@called_with("f2 f1 f i f f i")
@_compile
def free_way(
    cells: FloatArray,
    hinge: FloatArray,
    bearing: float,
    sense: int,
    width: float,
    margin: float,
    strays: int,
) -> float:
    """The angle, rad, beyond which a leaf can't come from closed without meeting cells (m, 2).

    ``strays`` of them don't count, nor those within ``margin`` m of its hinge, its edge, or where
    it is closed. A leaf may stand up to ``margin`` m behind a cell that it just meets.
    """
    lowest = np.full(strays + 1, np.inf)
    for i in range(len(cells)):
        x, y = cells[i, 0] - hinge[0], cells[i, 1] - hinge[1]
        far = np.sqrt(x * x + y * y)
        if far < margin or far > width - margin:
            continue
        along = np.cos(bearing) * x + np.sin(bearing) * y
        aside = sense * (np.cos(bearing) * y - np.sin(bearing) * x)
        angle = np.arctan2(aside, along)
        if angle * far < margin:
            continue
        angle += margin / far
        for k in range(strays + 1):
            if angle < lowest[k]:
                lowest[k], angle = angle, lowest[k]
    return float(lowest[strays])

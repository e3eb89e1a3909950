"""The beams that an outline covers and their ranges, for many robot poses; compiled.

A segment is projected onto the beams that it covers, and each of these keeps the nearest hit. So
the work for a scan grows with its beams, not with beams times segments. Robot samples lie close
together, so that an outline covers about the same beams from all of them. Poses therefore run along
the last axis of every array here, and the loops over them are short and without branches: the
processor handles several poses at a time. Beams, poses, placements and outlines are as in
``sweeps``.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from objstate.compiling import called_with, inner, njit
from objstate.geometry import BoolArray, FloatArray, IntArray
from objstate.sensing.segments import SLACK
from objstate.sensing.sweeps import (
    BEARING,
    CENTRE_X,
    CENTRE_Y,
    COS,
    DIRECTION_X,
    DIRECTION_Y,
    ORIGIN_X,
    ORIGIN_Y,
    SIN,
    SPREAD,
    Beams,
    X,
    Y,
    taken,
)

SPARE = 10  # number of work arrays over the poses, shared by many placements
LEAST_LENGTH = 1e-200  # length of the mean direction of headings over the whole circle

_compile = njit(nogil=True, error_model="numpy", fastmath={"contract"})
_inner = inner(nogil=True, error_model="numpy", fastmath={"contract"})
_maker = inner(makes_arrays=True, nogil=True, error_model="numpy", fastmath={"contract"})
_inner_finite = inner(nogil=True, error_model="numpy", fastmath={"contract", "nnan", "nsz"})


@_inner
def pseudo_angle(x: float, y: float) -> Any:
    """A number that grows with the bearing of (x, y): -2 at -pi, 0 at 0, 2 at pi."""
    t = abs(y) / (abs(x) + abs(y))
    if x < 0.0:
        t = 2.0 - t
    return -t if y < 0.0 else t


@_inner
def _first_at_or_after(bearing: float, beams: FloatArray, index: IntArray) -> Any:
    """The first beam whose pseudo-angle is not below ``bearing``."""
    count, cells = beams.shape[1], index.shape[0] - 1
    cell = int((bearing + 2.0) * cells / 4.0)
    i = index[min(max(cell, 0), cells)]
    while i < count and beams[BEARING, i] < bearing:
        i += 1
    return i


@_inner
def _hit(
    ax: FloatArray,
    ay: FloatArray,
    ex: FloatArray,
    ey: FloatArray,
    beams: FloatArray,
    i: int,
    slack: float,
    least: float,
    nearest: FloatArray,
) -> None:
    """Let beam ``i`` keep the smaller of its range and that of a segment from a along e."""
    dx, dy = beams[DIRECTION_X, i], beams[DIRECTION_Y, i]
    ox, oy = beams[ORIGIN_X, i], beams[ORIGIN_Y, i]
    for p in range(nearest.shape[1]):
        fx, fy = ax[p] - ox, ay[p] - oy
        turn = dx * ey[p] - dy * ex[p]
        squared = turn * turn
        along = (fx * dy - fy * dx) * turn
        distance = (fx * ey[p] - fy * ex[p]) / turn
        hits = (along >= -slack * squared) & (along <= (1.0 + slack) * squared) & (squared > least)
        closer = hits & (distance >= 0.0) & (distance < nearest[i, p])
        nearest[i, p] = distance if closer else nearest[i, p]


class Stands(NamedTuple):
    """Where a laser stands for robot poses that lie close together."""

    lasers: FloatArray  # (4, p) its poses
    middle: FloatArray  # (4,) of these
    strayed: float  # m, their largest distance from the middle
    turned: float  # rad, their largest turn from it


@_maker
def stands(poses: FloatArray, sweep: FloatArray) -> Any:
    """``Stands`` of the sweep's centre for robot poses (p, 4)."""
    lasers, middle = np.empty((4, poses.shape[0])), np.empty(4)
    for p in range(poses.shape[0]):
        cos, sin = poses[p, COS], poses[p, SIN]
        lasers[X, p] = poses[p, X] + cos * sweep[CENTRE_X] - sin * sweep[CENTRE_Y]
        lasers[Y, p] = poses[p, Y] + sin * sweep[CENTRE_X] + cos * sweep[CENTRE_Y]
        lasers[COS, p], lasers[SIN, p] = cos, sin
    for row in range(4):
        total = 0.0
        for p in range(lasers.shape[1]):
            total += lasers[row, p]
        middle[row] = total / lasers.shape[1]
    length = max(np.hypot(middle[COS], middle[SIN]), LEAST_LENGTH)
    middle[COS] /= length
    middle[SIN] /= length
    strayed, least = 0.0, 1.0
    for p in range(lasers.shape[1]):
        off = (lasers[X, p] - middle[X]) ** 2 + (lasers[Y, p] - middle[Y]) ** 2
        strayed = max(strayed, off)
    for p in range(lasers.shape[1]):
        least = min(least, lasers[COS, p] * middle[COS] + lasers[SIN, p] * middle[SIN])
    return Stands(lasers, middle, np.sqrt(strayed), np.arccos(max(least, -1.0)))


@_inner_finite
def _turns(x: FloatArray, y: FloatArray, to_x: float, to_y: float) -> Any:
    """Least and largest tangent of the turn from one direction to those of (x, y) (p,).

    Both are infinite where some are turned by 90 degrees or more.
    """
    least, largest, ahead = np.inf, -np.inf, np.inf
    for p in range(x.shape[0]):
        along, across = to_x * x[p] + to_y * y[p], to_x * y[p] - to_y * x[p]
        tangent = across / along
        least, largest, ahead = min(least, tangent), max(largest, tangent), min(ahead, along)
    return (least, largest) if ahead > 0.0 else (-np.inf, np.inf)


@_inner
def _bearing(x: float, y: float, tangent: float, about: float) -> Any:
    """The pseudo-angle of (x, y) turned on by a tangent, unwrapped to be near another."""
    found = pseudo_angle(x - tangent * y, y + tangent * x)
    if found - about > 2.0:
        return found - 4.0
    return found + 4.0 if found - about < -2.0 else found


@_inner
def _gap(segment: FloatArray) -> Any:
    """The distance of the origin from a segment (4,)."""
    ax, ay, bx, by = segment[0], segment[1], segment[2], segment[3]
    ex, ey = bx - ax, by - ay
    squared, along = ex * ex + ey * ey, 0.0
    if squared > 0.0:
        along = min(max(-(ax * ex + ay * ey) / squared, 0.0), 1.0)
    return np.sqrt((ax + along * ex) ** 2 + (ay + along * ey) ** 2)


@_inner
def _covered(
    segment: FloatArray,
    starts: Any,
    ends: Any,
    strayed: float,
    spread: float,
    beams: FloatArray,
    index: IntArray,
) -> Any:
    """The first beam that a segment (4,) may touch from any pose, and the number of such beams.

    The segment is relative to the poses' middle, from which they deviate; ``starts`` and ``ends``
    are the turns of its ends' bearings from there to the poses. ``spread`` is the largest distance
    of beams' origins.
    """
    count, gap = beams.shape[1], _gap(segment) - strayed
    if gap <= spread + SLACK or starts[0] == -np.inf or ends[0] == -np.inf:
        return 0, count
    ax, ay, bx, by = segment[0], segment[1], segment[2], segment[3]
    margin = SLACK + np.arcsin(spread / gap)  # pseudo-angles grow no faster than angles
    about = pseudo_angle(ax, ay)
    of_end = _bearing(bx, by, 0.0, about)
    low = min(_bearing(ax, ay, starts[0], about), _bearing(bx, by, ends[0], of_end)) - margin
    high = max(_bearing(ax, ay, starts[1], about), _bearing(bx, by, ends[1], of_end)) + margin
    if high - low >= 4.0:
        return 0, count
    if low < -2.0:
        low, high = low + 4.0, high + 4.0
    if low >= 2.0:
        low, high = low - 4.0, high - 4.0
    first = _first_at_or_after(low, beams, index)
    if high > 2.0:
        return first, count - first + _first_at_or_after(high - 4.0, beams, index)
    return first, _first_at_or_after(high, beams, index) - first


@_inner
def _lies_between_beams(
    segment: FloatArray,
    strayed: float,
    turned: float,
    spread: float,
    beams: FloatArray,
    index: IntArray,
) -> Any:
    """Whether a segment (4,) lies between two beams from all poses; a conservative test.

    The segment is relative to the poses' middle, from which they deviate and are turned by some
    values at most.
    """
    gap = _gap(segment) - strayed - spread
    if gap <= SLACK:
        return False
    # pseudo-angles grow no faster than angles, an arc sine less than its sine times a right angle
    margin = SLACK + turned + 0.5 * np.pi * (strayed + spread) / gap
    begin = pseudo_angle(segment[0], segment[1])
    end = _bearing(segment[2], segment[3], 0.0, begin)
    low, high = min(begin, end) - margin, max(begin, end) + margin
    if low < -2.0 or high > 2.0:
        return False
    first = _first_at_or_after(low, beams, index)
    return first == beams.shape[1] or beams[BEARING, first] > high


@_inner
def _is_behind(segment: FloatArray, margin: float) -> Any:
    """Whether a margin around the origin is on the right, inner, side of a rim's segment (4,)."""
    ex, ey = segment[2] - segment[0], segment[3] - segment[1]
    return segment[0] * ey - segment[1] * ex <= -margin * np.sqrt(ex * ex + ey * ey)


@_inner
def _is_outside(seen: FloatArray, rim: int | np.int64, margin: float) -> Any:
    """Whether a margin around the origin is outside of the closed loops ``seen[:rim]`` (k, 4)."""
    turns = 0  # winding number of the loops about the origin
    for j in range(rim):
        if _gap(seen[j]) <= margin:
            return False
        across = seen[j, 0] * seen[j, 3] - seen[j, 1] * seen[j, 2]
        turns += (seen[j, 1] <= 0.0) & (seen[j, 3] > 0.0) & (across > 0.0)
        turns -= (seen[j, 3] <= 0.0) & (seen[j, 1] > 0.0) & (across < 0.0)
    return (rim > 0) & (turns == 0)


@_inner
def _seen_from(
    middle: FloatArray, place: FloatArray, outline: FloatArray, seen: FloatArray
) -> None:
    """The ends ``seen`` (k, 4) of an outline at a place (4,), relative to a laser's pose (4,)."""
    dx, dy = place[X] - middle[X], place[Y] - middle[Y]
    x, y = middle[COS] * dx + middle[SIN] * dy, middle[COS] * dy - middle[SIN] * dx
    cos = place[COS] * middle[COS] + place[SIN] * middle[SIN]
    sin = place[SIN] * middle[COS] - place[COS] * middle[SIN]
    for j in range(outline.shape[0]):
        for end in range(0, 4, 2):
            seen[j, end] = x + cos * outline[j, end] - sin * outline[j, end + 1]
            seen[j, end + 1] = y + sin * outline[j, end] + cos * outline[j, end + 1]


@_maker
def project(
    at: Stands,
    place: FloatArray,
    outline: FloatArray,
    rim: int | np.int64,
    beams: FloatArray,
    index: IntArray,
    spread: float,
    nearest: FloatArray,
    is_touched: BoolArray,
    spare: FloatArray,
) -> None:
    """Let each beam keep the smaller of ``nearest`` (n, p) and the range to an outline (k, 4).

    The outline stands at a place (4,). ``is_touched`` (n,) is set for the beams that may meet it
    from some of the lasers' p poses. From outside of the outline's first ``rim`` segments, only
    their near sides are seen. ``spare`` (``SPARE``, p) is overwritten.
    """
    lasers, middle, strayed, turned = at
    size, count = lasers.shape[1], beams.shape[1]
    x, y, cos, sin = spare[0], spare[1], spare[2], spare[3]
    ax, ay, bx, by = spare[4], spare[5], spare[6], spare[7]
    ex, ey = spare[8], spare[9]
    for p in range(size):
        dx, dy = place[X] - lasers[X, p], place[Y] - lasers[Y, p]
        x[p] = lasers[COS, p] * dx + lasers[SIN, p] * dy
        y[p] = lasers[COS, p] * dy - lasers[SIN, p] * dx
    for p in range(size):
        cos[p] = place[COS] * lasers[COS, p] + place[SIN] * lasers[SIN, p]
        sin[p] = place[SIN] * lasers[COS, p] - place[COS] * lasers[SIN, p]
    seen = np.empty((outline.shape[0], 4))
    _seen_from(middle, place, outline, seen)
    is_outside = _is_outside(seen, rim, strayed + spread)
    for j in range(rim if is_outside else outline.shape[0]):
        if is_outside and _is_behind(seen[j], strayed + spread):
            continue
        if _lies_between_beams(seen[j], strayed, turned, spread, beams, index):
            continue
        along_x, along_y = outline[j, 2] - outline[j, 0], outline[j, 3] - outline[j, 1]
        for p in range(size):
            ax[p] = x[p] + cos[p] * outline[j, 0] - sin[p] * outline[j, 1]
            ay[p] = y[p] + sin[p] * outline[j, 0] + cos[p] * outline[j, 1]
        for p in range(size):
            ex[p] = cos[p] * along_x - sin[p] * along_y
            ey[p] = sin[p] * along_x + cos[p] * along_y
        for p in range(size):
            bx[p], by[p] = ax[p] + ex[p], ay[p] + ey[p]
        first, touched = _covered(
            seen[j],
            _turns(ax, ay, seen[j, 0], seen[j, 1]),
            _turns(bx, by, seen[j, 2], seen[j, 3]),
            strayed,
            spread,
            beams,
            index,
        )
        length = abs(along_x) + abs(along_y)
        slack, least = SLACK / length, (SLACK * length) ** 2
        for step in range(touched):
            i = first + step
            i -= count if i >= count else 0
            _hit(ax, ay, ex, ey, beams, i, slack, least, nearest)
            is_touched[i] = True


@_inner
def untouched(nearest: FloatArray, is_touched: BoolArray) -> None:
    """Reset touched beams (n,) and ranges (n, p)."""
    for i in range(is_touched.shape[0]):
        is_touched[i] = False
        for p in range(nearest.shape[1]):
            nearest[i, p] = np.inf


@called_with("f2 f2 f2 i b1 laser f1 f3")
@_compile
def cast(
    poses: FloatArray,
    placements: FloatArray,
    outline: FloatArray,
    rim: int | np.int64,
    chosen: BoolArray,
    laser: Beams,
    sweep: FloatArray,
    out: FloatArray,
) -> None:
    """Ranges ``out`` (s, m, p) of an outline (k, 4) at placements (s, 4), from poses (p, 4).

    Of the ``chosen`` beams (n,), see ``taken``, in the scan's order.
    """
    order, beams, index = taken(chosen, laser)
    at, count = stands(poses, sweep), beams.shape[1]
    nearest, spare = np.empty((count, poses.shape[0])), np.empty((SPARE, poses.shape[0]))
    is_touched = np.empty(count, dtype=np.bool_)
    untouched(nearest, is_touched)
    for s in range(placements.shape[0]):
        project(
            at,
            placements[s],
            outline,
            rim,
            beams,
            index,
            sweep[SPREAD],
            nearest,
            is_touched,
            spare,
        )
        for i in range(count):
            is_touched[i] = False
            for p in range(poses.shape[0]):
                out[s, order[i], p] = nearest[i, p]
                nearest[i, p] = np.inf

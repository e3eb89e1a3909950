"""Ranges of walls for many robot poses side by side, the nearest walls first; compiled.

A building has thousands of wall segments, of which a laser sees a few dozen. Segments are processed
in the order of their distance. A segment that lies, from all poses, behind what every beam that may
meet it has hit can't change any range. It is skipped after a few operations whose number doesn't
depend on that of the poses. So the ranges are exactly those of all segments. Beams, poses and
outlines are as in ``sweeps``.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from objstate.compiling import called_with, inner, njit, record
from objstate.geometry import BoolArray, FloatArray, IntArray
from objstate.sensing.projection import (
    SPARE,
    _bearing,
    _first_at_or_after,
    _gap,
    _seen_from,
    project,
    pseudo_angle,
    stands,
    untouched,
)
from objstate.sensing.segments import SLACK
from objstate.sensing.sweeps import COS, SPREAD, Beams, X, Y, taken

TOGETHER = 16  # segments that are projected at a time

_compile = njit(nogil=True, error_model="numpy", fastmath={"contract"})
_inner = inner(nogil=True, error_model="numpy", fastmath={"contract"})
_inner_finite = inner(nogil=True, error_model="numpy", fastmath={"contract", "nnan", "nsz"})


@_inner_finite
def _largest(values: FloatArray) -> Any:
    """The largest of some values (p,), of which some may be infinite."""
    largest = -np.inf
    for p in range(values.shape[0]):
        largest = max(largest, values[p])
    return largest


@_inner
def _renewed(farthest: FloatArray, nearest: FloatArray, is_touched: BoolArray) -> Any:
    """The largest of ``farthest`` (n,), updated from ``nearest`` (n, p) for the touched beams."""
    largest = 0.0
    for i in range(farthest.shape[0]):
        if is_touched[i]:
            farthest[i], is_touched[i] = _largest(nearest[i]), False
        largest = max(largest, farthest[i])
    return largest


@_inner
def _is_hidden(
    segment: FloatArray,
    strayed: float,
    turned: float,
    beams: FloatArray,
    index: IntArray,
    farthest: FloatArray,
) -> Any:
    """Whether no beam can meet a segment (4,) before its hit at ``farthest`` (n,) from any pose.

    The segment is relative to the poses' middle, from which beams' origins deviate and headings are
    turned by some values at most.
    """
    count, gap = beams.shape[1], _gap(segment) - strayed
    if gap <= SLACK:
        return False
    # pseudo-angles grow no faster than angles, an arc sine less than its sine times a right angle
    margin = SLACK + turned + 0.5 * np.pi * strayed / gap
    begin = pseudo_angle(segment[0], segment[1])
    end = _bearing(segment[2], segment[3], 0.0, begin)
    low, high = min(begin, end) - margin, max(begin, end) + margin
    first, until = 0, count
    if high - low < 4.0:
        if low < -2.0:
            low, high = low + 4.0, high + 4.0
        if low >= 2.0:
            low, high = low - 4.0, high - 4.0
        first = _first_at_or_after(low, beams, index)
        if high > 2.0:
            until = count + _first_at_or_after(high - 4.0, beams, index)
        else:
            until = _first_at_or_after(high, beams, index)
    for step in range(first, until):
        if farthest[step - count if step >= count else step] > gap:
            return False
    return True


@record("walls", "f2 i1 f2 f1")
class WallGroups(NamedTuple):
    """Wall segments in groups of neighbours, each within a circle."""

    segments: FloatArray  # (k, 4) group by group
    starts: IntArray  # (g + 1,) where each group begins
    circles: FloatArray  # (g, 4) middles: x, y, x, y m
    radii: FloatArray  # (g,) m


@record("near", "f2 i1 i1 f1")
class NearGroups(NamedTuple):
    """The groups of walls near some places, one place after the other, the nearest first."""

    places: FloatArray  # (t, 2) m
    ends: IntArray  # (t,) where the groups of each place end
    groups: IntArray  # (j,)
    distances: FloatArray  # (j,) m from the place; ascending for each place


@_inner
def _begin(nearest: FloatArray, is_touched: BoolArray, farthest: FloatArray) -> None:
    """Reset touched beams and largest ranges (n,), and ranges (n, p)."""
    untouched(nearest, is_touched)
    for i in range(farthest.shape[0]):
        farthest[i] = np.inf


@_inner
def _scatter(nearest: FloatArray, order: IntArray, out: FloatArray) -> None:
    """Put ranges (n, p) of sorted beams into the scan's order."""
    for i in range(nearest.shape[0]):
        for p in range(nearest.shape[1]):
            out[order[i], p] = nearest[i, p]


@called_with("f3 walls near b1 laser f1 f3")
@_compile
def wall_ranges(
    poses: FloatArray,
    walls: WallGroups,
    near: NearGroups,
    chosen: BoolArray,
    laser: Beams,
    sweep: FloatArray,
    out: FloatArray,
) -> None:
    """Ranges ``out`` (h, m, p) of walls from poses (h, p, 4), in h groups that lie close together.

    ``near`` has a place for each group, by whose distances walls are taken in turn. Of the
    ``chosen`` beams (n,) of a scan, see ``taken``, in the scan's order.
    """
    order, beams, index = taken(chosen, laser)
    size, count, spread = poses.shape[1], beams.shape[1], sweep[SPREAD]
    nearest, spare = np.empty((count, size)), np.empty((SPARE, size))
    farthest, is_touched = np.empty(count), np.empty(count, dtype=np.bool_)
    front, seen, fixed = np.empty((TOGETHER, 4)), np.empty((1, 4)), np.zeros(4)
    fixed[COS] = 1.0
    for h in range(poses.shape[0]):
        at = stands(poses[h], sweep)
        dx, dy = at.middle[X] - near.places[h, 0], at.middle[Y] - near.places[h, 1]
        off, margin, held = np.sqrt(dx * dx + dy * dy), at.strayed + spread, 0
        _begin(nearest, is_touched, farthest)
        reached = np.inf  # m, largest range reached by all beams
        last = near.ends[h]
        for j in range(near.ends[h - 1] if h > 0 else 0, last + 1):
            is_over = j == last or near.distances[j] - off - margin > reached
            k = end = group = 0
            if not is_over:
                group = near.groups[j]
                k, end = walls.starts[group], walls.starts[group + 1]
                k -= end - k > 1  # where there are several, their circle comes first
            while k < end or (is_over and held > 0):
                if k < end:
                    is_circle = k < walls.starts[group]
                    line = walls.circles[group] if is_circle else walls.segments[k]
                    around = margin + walls.radii[group] if is_circle else margin
                    _seen_from(at.middle, fixed, line.reshape(1, 4), seen)
                    if _is_hidden(seen[0], around, at.turned, beams, index, farthest):
                        k = end if is_circle else k
                    elif not is_circle:
                        for part in range(4):  # assigning a whole row takes seconds to compile
                            front[held, part] = line[part]
                        held += 1
                    k += 1
                if held == TOGETHER or is_over:
                    place = at, fixed, front[:held], np.int64(0), beams, index, spread
                    project(*place, nearest, is_touched, spare)
                    held, reached = 0, _renewed(farthest, nearest, is_touched)
            if is_over:
                break
        _scatter(nearest, order, out[h])

"""Compiled loops of the search: ranges around many places, and the likelihood of a scan there."""

from __future__ import annotations

from typing import Any

import numpy as np

from objstate.compiling import called_with, inner, njit
from objstate.geometry import FloatArray, IntArray
from objstate.sensing.segments import SLACK, hit

_compile = njit(nogil=True, error_model="numpy", fastmath={"contract", "nnan", "nsz"})
_inner = inner(nogil=True, error_model="numpy", fastmath={"contract", "nnan", "nsz"})


@called_with("f2 f i i")
@_compile
def by_cell(segments: FloatArray, side: float, columns: int, rows: int) -> Any:
    """The segments (k, 4) that pass each cell of a grid.

    Numbers (m,), and where those of each cell begin and end (w, h). Segments are relative to the
    grid's corner.
    """
    first, last = np.zeros((columns, rows), np.int64), np.zeros((columns, rows), np.int64)
    numbers, reach = np.empty(0, np.int64), 0.5 * np.sqrt(2.0) * side + SLACK
    for is_counted in (False, True):
        for k in range(segments.shape[0]):
            ax, ay = segments[k, 0], segments[k, 1]
            bx, by = segments[k, 2], segments[k, 3]
            length = np.hypot(bx - ax, by - ay)
            for column in range(int(min(ax, bx) / side), min(int(max(ax, bx) / side) + 1, columns)):
                for row in range(int(min(ay, by) / side), min(int(max(ay, by) / side) + 1, rows)):
                    x, y = (column + 0.5) * side - ax, (row + 0.5) * side - ay
                    if abs((bx - ax) * y - (by - ay) * x) > reach * length:
                        continue
                    if is_counted:
                        numbers[last[column, row]] = k
                    last[column, row] += 1
        if not is_counted:
            total = 0
            for column in range(columns):
                for row in range(rows):
                    first[column, row] = total
                    total += last[column, row]
                    last[column, row] = first[column, row]
            numbers = np.empty(total, np.int64)
    return numbers, first, last


@_inner
def _distance(
    x: float,
    y: float,
    dx: float,
    dy: float,
    segments: FloatArray,
    numbers: IntArray,
    first: IntArray,
    last: IntArray,
    side: float,
) -> Any:
    """Distance along a ray from x, y to the nearest segment; inf where there is none.

    The place is relative to the grid's corner.
    """
    nearest, column, row = np.inf, int(np.floor(x / side)), int(np.floor(y / side))
    per_column = side / abs(dx) if dx != 0.0 else np.inf  # m along the ray
    per_row = side / abs(dy) if dy != 0.0 else np.inf
    to_column = ((column + (dx > 0.0)) * side - x) / dx if dx != 0.0 else np.inf
    to_row = ((row + (dy > 0.0)) * side - y) / dy if dy != 0.0 else np.inf
    while 0 <= column < first.shape[0] and 0 <= row < first.shape[1]:
        for place in range(first[column, row], last[column, row]):
            nearest = min(nearest, hit(x, y, dx, dy, segments[numbers[place]]))
        if nearest <= min(to_column, to_row):
            break
        if to_column < to_row:
            column += 1 if dx > 0.0 else -1
            to_column += per_column
        else:
            row += 1 if dy > 0.0 else -1
            to_row += per_row
    return nearest


@called_with("f2 f2 f2 i1 i2 i2 f f f")
@_compile
def look_round(
    points: FloatArray,
    directions: FloatArray,
    segments: FloatArray,
    numbers: IntArray,
    first: IntArray,
    last: IntArray,
    side: float,
    clearance: float,
    enclosed: float,
) -> Any:
    """The least and the largest range about each of b directions (b, 2) from points (c, 2).

    Also which points (c,) are free: nothing within ``clearance`` m, and segments at a share
    ``enclosed`` of the directions. Ranges of other points are meaningless. Points and segments (k,
    4) are relative to the grid's corner; ``by_cell`` gives the remaining arguments.
    """
    count, turns = points.shape[0], directions.shape[0]
    nearest, farthest = np.empty((count, turns)), np.empty((count, turns))
    free, ranges = np.empty(count, np.bool_), np.empty(turns)
    for p in range(count):
        free[p], seen = True, turns
        for t in range(turns):
            dx, dy = directions[t, 0], directions[t, 1]
            ranges[t] = _distance(
                points[p, 0], points[p, 1], dx, dy, segments, numbers, first, last, side
            )
            seen -= ranges[t] == np.inf
            if ranges[t] < clearance or seen < enclosed * turns:
                free[p] = False
                break
        for t in range(turns):
            before, after = ranges[t - 1], ranges[(t + 1) % turns]
            nearest[p, t] = min(before, ranges[t], after)
            farthest[p, t] = max(before, ranges[t], after)
    return nearest, farthest, free


@_inner
def _of_beam(
    beam: tuple[float, float, float],
    least: float,
    most: float,
    between: float,
    reach: float,
    missing: FloatArray,
    per_sigma: float,
) -> Any:
    """Approximate log density of a beam (3,) where ranges from ``least`` to ``most`` are expected."""
    measured = beam[0]
    if measured < np.inf:
        off = max(least - measured, measured - most, 0.0) * per_sigma
        return max(between - 0.5 * off * off, beam[2] if measured < least else beam[1])
    return missing[0] if most >= reach else missing[1]


@_inner
def _score(
    nearest: FloatArray,
    farthest: FloatArray,
    breadth: FloatArray,
    bins: IntArray,
    beams: FloatArray,
    reach: float,
    missing: FloatArray,
    per_sigma: float,
    twice: FloatArray,
    out: FloatArray,
) -> None:
    """Approximate log p(o | l) ``out`` (b,) of one place for b headings.

    ``twice`` (3, 2 b) holds the expected ranges of b bearings twice in a row, so that the bearings
    of a beam in all headings are contiguous.
    """
    turns = out.shape[0]
    for t in range(turns):
        twice[0, t] = twice[0, t + turns] = nearest[t]
        twice[1, t] = twice[1, t + turns] = farthest[t]
        twice[2, t] = twice[2, t + turns] = breadth[t]
        out[t] = 0.0
    for i in range(bins.shape[0]):
        least, most = twice[0, bins[i] : bins[i] + turns], twice[1, bins[i] : bins[i] + turns]
        between, beam = twice[2, bins[i] : bins[i] + turns], (beams[0, i], beams[1, i], beams[2, i])
        for t in range(turns):
            out[t] += _of_beam(beam, least[t], most[t], between[t], reach, missing, per_sigma)


@_inner
def _one_score(
    nearest: FloatArray,
    farthest: FloatArray,
    breadth: FloatArray,
    bins: IntArray,
    beams: FloatArray,
    reach: float,
    missing: FloatArray,
    per_sigma: float,
    turn: int | np.int64,
) -> Any:
    """Approximate log p(o | l) of one place for one of its b headings."""
    total, turns = 0.0, nearest.shape[0]
    for i in range(bins.shape[0]):
        at, beam = (bins[i] + turn) % turns, (beams[0, i], beams[1, i], beams[2, i])
        near, far, between = nearest[at], farthest[at], breadth[at]
        total += _of_beam(beam, near, far, between, reach, missing, per_sigma)
    return total


@_inner
def _nowhere(beams: FloatArray, missing: FloatArray) -> Any:
    """The same where no place is free: every range is random."""
    total = 0.0
    for i in range(beams.shape[1]):
        total += beams[1, i] if beams[0, i] < np.inf else missing[1]
    return total


@_inner
def _cell(x: float, y: float, cells: IntArray, spacing: float) -> Any:
    """The place in whose cell x, y lies, relative to the grid's corner; -1 where none is free."""
    column, row = int(np.floor(x / spacing)), int(np.floor(y / spacing))
    if 0 <= column < cells.shape[0] and 0 <= row < cells.shape[1]:
        return cells[column, row]
    return -1


@called_with("f2 f2 i2 f1 f f2 f2 f2 i1 f2 f1 f f1 f")
@_compile
def scores(
    points: FloatArray,
    headings: FloatArray,
    cells: IntArray,
    corner: FloatArray,
    spacing: float,
    nearest: FloatArray,
    farthest: FloatArray,
    breadth: FloatArray,
    bins: IntArray,
    beams: FloatArray,
    offset: FloatArray,
    reach: float,
    missing: FloatArray,
    per_sigma: float,
) -> Any:
    """Approximate log p(o | l) (p, t) for robots at points (p, 2) in t headings, by look-up.

    ``headings`` are (p, t), or (1, t) where they are the same at each point. ``cells`` (w, h) holds
    the number of the place in each cell, or -1. Place c expects ranges between ``nearest`` and
    ``farthest`` (c, b) at each of b bearings, with the log density ``breadth`` (c, b). A beam has
    the bearing ``bins`` (n,) and a column of ``beams`` (3, n): its range, and its log density of a
    random reading beyond what is expected and before it. ``missing`` (2,) are the log probabilities
    of no return with nothing in reach and with something in reach. The laser stands at the pose
    ``offset`` (3,) on the robot.
    """
    turns, count = nearest.shape[1], headings.shape[1]
    twice = np.empty((3, 2 * turns))
    # of places whose headings are all asked for
    table, is_known = np.empty(nearest.shape), np.zeros(nearest.shape[0], np.bool_)
    nowhere, out = _nowhere(beams, missing), np.empty((points.shape[0], count))
    off, turn = np.empty((count, 2)), np.empty(count, np.int64)
    for p in range(points.shape[0]):
        for t in range(count if p < headings.shape[0] else 0):
            cos, sin = np.cos(headings[p, t]), np.sin(headings[p, t])
            off[t, 0] = cos * offset[0] - sin * offset[1] - corner[0]
            off[t, 1] = sin * offset[0] + cos * offset[1] - corner[1]
            turn[t] = int(np.rint((headings[p, t] + offset[2]) / (2.0 * np.pi) * turns)) % turns
        for t in range(count):
            place = _cell(points[p, 0] + off[t, 0], points[p, 1] + off[t, 1], cells, spacing)
            if place < 0:
                out[p, t] = nowhere
                continue
            if count == 1:
                out[p, t] = _one_score(
                    nearest[place],
                    farthest[place],
                    breadth[place],
                    bins,
                    beams,
                    reach,
                    missing,
                    per_sigma,
                    turn[t],
                )
                continue
            if not is_known[place]:
                is_known[place] = True
                _score(
                    nearest[place],
                    farthest[place],
                    breadth[place],
                    bins,
                    beams,
                    reach,
                    missing,
                    per_sigma,
                    twice,
                    table[place],
                )
            out[p, t] = table[place, turn[t]]
    return out

"""The piece of wall that each beam meets, compiled."""

from __future__ import annotations

from typing import Any

import numpy as np

from objstate.compiling import called_with, inner, njit
from objstate.geometry import FloatArray, IntArray
from objstate.sensing.segments import SLACK

TOGETHER = 12  # neighbouring beams for which pieces are looked up together
ACUTE = 0.5  # cosine of their least angle with the first, for which that is worth while
GRAZING = 0.12  # cosine of incidence below which a range has no information about a wall

_compile = njit(nogil=True, error_model="numpy", fastmath={"contract"})
_inner = inner(nogil=True, error_model="numpy", fastmath={"contract"})


@_inner
def met(x: float, y: float, dx: float, dy: float, segment: FloatArray, normal: FloatArray) -> Any:
    """Distance along a unit ray to a segment (4,) with a unit normal (2,); inf if it misses."""
    ax, ay = segment[0] - x, segment[1] - y
    bx, by = segment[2] - x, segment[3] - y
    if (dx * ay - dy * ax > 0.0) == (dx * by - dy * bx > 0.0):
        return np.inf
    distance = (normal[0] * ax + normal[1] * ay) / (normal[0] * dx + normal[1] * dy)
    return distance if distance >= 0.0 else np.inf


@_inner
def _ahead(
    pieces: FloatArray,
    among: IntArray,
    origins: FloatArray,
    directions: FloatArray,
    first: int,
    past: int,
    out: IntArray,
) -> Any:
    """Pieces ``out`` of those ``among`` some that beams ``first`` .. ``past`` may meet; how many.

    None that lies behind, to the left of the leftmost beam, or to the right of the rightmost.
    """
    x, y, dx, dy = origins[first, 0], origins[first, 1], directions[first, 0], directions[first, 1]
    left, right, leftmost, rightmost, margin, least, count = first, first, 0.0, 0.0, SLACK, 1.0, 0
    for i in range(first + 1, past):
        margin = max(margin, SLACK + abs(origins[i, 0] - x) + abs(origins[i, 1] - y))
        least = min(least, dx * directions[i, 0] + dy * directions[i, 1])
        across = dx * directions[i, 1] - dy * directions[i, 0]
        if across > leftmost:
            left, leftmost = i, across
        if across < rightmost:
            right, rightmost = i, across
    left_x, left_y = directions[left, 0], directions[left, 1]
    right_x, right_y = directions[right, 0], directions[right, 1]
    for m in range(among.shape[0]):
        k = among[m]
        ax, ay, bx, by = pieces[k, 0] - x, pieces[k, 1] - y, pieces[k, 2] - x, pieces[k, 3] - y
        misses = min(left_x * ay - left_y * ax, left_x * by - left_y * bx) > margin
        misses |= max(right_x * ay - right_y * ax, right_x * by - right_y * bx) < -margin
        misses |= max(dx * ax + dy * ay, dx * bx + dy * by) < -margin
        if not misses or least < ACUTE:
            out[count] = k
            count += 1
    return count


@called_with("f2 f2 i1 f2 f2 f1 i1")
@_compile
def meet(
    pieces: FloatArray,
    normals: FloatArray,
    among: IntArray,
    origins: FloatArray,
    directions: FloatArray,
    ranges: FloatArray,
    numbers: IntArray,
) -> None:
    """The nearest of some pieces (k, 4) for each beam: ``ranges`` (n,) and ``numbers`` (n,).

    inf and -1 where there is none.
    """
    ahead, count = np.empty_like(among), 0
    for i in range(origins.shape[0]):
        if i % TOGETHER == 0:
            past = min(i + TOGETHER, origins.shape[0])
            count = _ahead(pieces, among, origins, directions, i, past, ahead)
        nearest, number = np.inf, -1
        x, y, dx, dy = origins[i, 0], origins[i, 1], directions[i, 0], directions[i, 1]
        for m in range(count):
            k = ahead[m]
            distance = met(x, y, dx, dy, pieces[k], normals[k])
            if distance < nearest:
                nearest, number = distance, k
        ranges[i], numbers[i] = nearest, number

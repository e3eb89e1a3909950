"""The search's inner loop, compiled: how well places all over a building explain a scan."""

from __future__ import annotations

from typing import Any

import numpy as np

from objstate.compiling import inner, njit
from objstate.geometry import FloatArray, IntArray

_compile = njit(nogil=True, error_model="numpy", fastmath={"contract", "nnan", "nsz"})
_inner = inner(nogil=True, error_model="numpy", fastmath={"contract", "nnan", "nsz"})


@_inner
def _add_return(
    nearest: FloatArray,
    farthest: FloatArray,
    breadth: FloatArray,
    measured: float,
    anything: float,
    short: float,
    per_sigma: float,
    out: FloatArray,
) -> None:
    """Add to ``out`` (b,) what a beam with a return says of headings in which it has these bearings (b,)."""
    for t in range(out.shape[0]):
        off = max(nearest[t] - measured, measured - farthest[t], 0.0) * per_sigma
        least = short if measured < nearest[t] else anything
        out[t] += max(breadth[t] - 0.5 * off * off, least)


@_inner
def _add_missing(farthest: FloatArray, reach: float, missing: FloatArray, out: FloatArray) -> None:
    """Add the same of a beam without a return."""
    for t in range(out.shape[0]):
        out[t] += missing[0] if farthest[t] >= reach else missing[1]


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
    out: FloatArray,
) -> None:
    """About log p(o | l) ``out`` (b,) of a place where so much should be read at b bearings, for as many headings."""
    for t in range(out.shape[0]):
        out[t] = 0.0
    for i in range(bins.shape[0]):
        measured, anything, short = beams[0, i], beams[1, i], beams[2, i]
        first, rest = (
            bins[i],
            out.shape[0] - bins[i],
        )  # headings up to ``rest`` have bearings from ``first``
        if measured < np.inf:
            _add_return(
                nearest[first:],
                farthest[first:],
                breadth[first:],
                measured,
                anything,
                short,
                per_sigma,
                out[:rest],
            )
            _add_return(
                nearest[:first],
                farthest[:first],
                breadth[:first],
                measured,
                anything,
                short,
                per_sigma,
                out[rest:],
            )
        else:
            _add_missing(farthest[first:], reach, missing, out[:rest])
            _add_missing(farthest[:first], reach, missing, out[rest:])


@_inner
def _nowhere(beams: FloatArray, missing: FloatArray) -> Any:
    """The same where no place is free: every beam reads anything at all."""
    total = 0.0
    for i in range(beams.shape[1]):
        total += beams[1, i] if beams[0, i] < np.inf else missing[1]
    return total


@_compile
def scores(
    poses: FloatArray,
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
    """About log p(o | l) (p,) for robot poses (p, 3), by look-up.

    ``cells`` (w, h) gives the place of each cell, -1 where none is free; place c should read between
    ``nearest`` and ``farthest`` (c, b) at each of b bearings, with the log density ``breadth``
    (c, b). A beam has the bearing ``bins`` (n,) and the column of ``beams`` (3, n): its range and its
    log density if it read anything at all, beyond what is expected and before. ``missing`` (2,) are
    the log probabilities of no return with nothing in reach and with something. The laser stands at
    the pose ``offset`` (3,) as seen from the robot.
    """
    turns = nearest.shape[1]
    table, is_known = np.empty(nearest.shape), np.empty(nearest.shape[0], dtype=np.bool_)
    for place in range(nearest.shape[0]):
        is_known[place] = False
    nowhere, out = _nowhere(beams, missing), np.empty(poses.shape[0])
    for p in range(poses.shape[0]):
        cos, sin = np.cos(poses[p, 2]), np.sin(poses[p, 2])
        x = poses[p, 0] + cos * offset[0] - sin * offset[1] - corner[0]
        y = poses[p, 1] + sin * offset[0] + cos * offset[1] - corner[1]
        column, row = int(np.floor(x / spacing)), int(np.floor(y / spacing))
        place = -1
        if 0 <= column < cells.shape[0] and 0 <= row < cells.shape[1]:
            place = cells[column, row]
        if place < 0:
            out[p] = nowhere
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
                table[place],
            )
        turn = int(np.rint((poses[p, 2] + offset[2]) / (2.0 * np.pi) * turns)) % turns
        out[p] = table[place, turn]
    return out

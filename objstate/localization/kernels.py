"""The search's inner loop, compiled: how well places all over a building explain a scan."""

from __future__ import annotations

import numpy as np
from numba import njit

from objstate.geometry import FloatArray, IntArray


@njit(cache=True, nogil=True, error_model="numpy")
def add_scores(
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
    out: FloatArray,
) -> None:
    """Add to ``out`` (p,) about log p(o | l) for robot poses (p, 3), by look-up.

    ``cells`` (w, h) gives the place of each cell, -1 where none is free; place c should read between
    ``nearest`` and ``farthest`` (c, b) at each of b bearings, with the log density ``breadth``
    (c, b). A beam has the bearing ``bins`` (n,) and the column of ``beams`` (3, n): its range and its
    log density if it read anything at all, beyond what is expected and before. ``missing`` (2,) are
    the log probabilities of no return with nothing in reach and with something. The laser stands at
    ``offset`` (2,) on the robot. Nowhere free: every beam reads anything at all.
    """
    count, turns = bins.shape[0], nearest.shape[1]
    for p in range(poses.shape[0]):
        cos, sin = np.cos(poses[p, 2]), np.sin(poses[p, 2])
        x = poses[p, 0] + cos * offset[0] - sin * offset[1] - corner[0]
        y = poses[p, 1] + sin * offset[0] + cos * offset[1] - corner[1]
        column, row = int(np.floor(x / spacing)), int(np.floor(y / spacing))
        place = -1
        if 0 <= column < cells.shape[0] and 0 <= row < cells.shape[1]:
            place = cells[column, row]
        turn = int(np.round(poses[p, 2] / (2.0 * np.pi) * turns)) % turns
        total = 0.0
        for i in range(count):
            measured = beams[0, i]
            if place < 0:
                total += missing[1] if measured == np.inf else beams[1, i]
                continue
            b = bins[i] + turn
            b -= turns if b >= turns else 0
            near, far = nearest[place, b], farthest[place, b]
            if measured == np.inf:
                total += missing[0] if far >= reach else missing[1]
                continue
            off, least = 0.0, beams[1, i]
            if measured < near:
                off, least = (near - measured) * per_sigma, beams[2, i]
            elif measured > far:
                off = (measured - far) * per_sigma
            total += max(breadth[place, b] - 0.5 * off * off, least)
        out[p] += total

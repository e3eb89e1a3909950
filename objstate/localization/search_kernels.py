"""The search's inner loop, compiled: how well places all over a building explain a scan."""

from __future__ import annotations

import numpy as np

from objstate.compiling import njit
from objstate.geometry import FloatArray, IntArray


@njit(nogil=True, error_model="numpy", fastmath={"contract", "reassoc"})
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
    log density if it read anything at all, beyond what is expected and before; those without a
    return come last. ``missing`` (2,) are
    the log probabilities of no return with nothing in reach and with something. The laser stands at
    ``offset`` (2,) on the robot. Nowhere free: every beam reads anything at all.
    """
    turns = nearest.shape[1]
    near, far, broad = nearest.ravel(), farthest.ravel(), breadth.ravel()
    measured, anything, short = beams[0], beams[1], beams[2]
    returns, nowhere = 0, 0.0
    for i in range(measured.shape[0]):
        returns += measured[i] < np.inf
        nowhere += anything[i] if measured[i] < np.inf else missing[1]
    for p in range(poses.shape[0]):
        cos, sin = np.cos(poses[p, 2]), np.sin(poses[p, 2])
        x = poses[p, 0] + cos * offset[0] - sin * offset[1] - corner[0]
        y = poses[p, 1] + sin * offset[0] + cos * offset[1] - corner[1]
        column, row = int(np.floor(x / spacing)), int(np.floor(y / spacing))
        place = -1
        if 0 <= column < cells.shape[0] and 0 <= row < cells.shape[1]:
            place = cells[column, row]
        if place < 0:
            out[p] += nowhere
            continue
        turn = int(np.round(poses[p, 2] / (2.0 * np.pi) * turns)) % turns
        total = 0.0
        for i in range(returns):
            b = bins[i] + turn
            b += place * turns - (turns if b >= turns else 0)
            off = max(near[b] - measured[i], measured[i] - far[b], 0.0) * per_sigma
            least = short[i] if measured[i] < near[b] else anything[i]
            total += max(broad[b] - 0.5 * off * off, least)
        for i in range(returns, measured.shape[0]):
            b = bins[i] + turn
            b += place * turns - (turns if b >= turns else 0)
            total += missing[0] if far[b] >= reach else missing[1]
        out[p] += total

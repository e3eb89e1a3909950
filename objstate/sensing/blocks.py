"""Which of a building's many wall segments lie near a place, without looking at all of them."""

from __future__ import annotations

import math

import numpy as np

from objstate.geometry import FloatArray, IntArray
from objstate.lazy import lazy

SIDE = 8.0  # m of a block


class Blocks:
    """Wall segments (k, 4) by the blocks of the floor that they pass."""

    def __init__(self, segments: FloatArray) -> None:
        self.segments = segments

    def within(self, place: FloatArray, radius: float) -> FloatArray:
        """The segments that come within ``radius`` m of a place (2,), in their own order."""
        if len(self.segments) == 0:
            return self.segments
        lower, rows, blocks, of = self._by_block
        (x, y), (lower_x, lower_y) = place.tolist(), lower.tolist()
        first_x, last_x = (math.floor((x + to) / SIDE) - lower_x for to in (-radius, radius))
        first_y, last_y = (math.floor((y + to) / SIDE) - lower_y for to in (-radius, radius))
        first_y, last_y = max(first_y, 0), min(last_y, rows - 1)
        columns = np.arange(max(first_x, 0), last_x + 1) * rows
        starts = np.searchsorted(blocks, columns + first_y)
        ends = np.searchsorted(blocks, columns + last_y, side="right")
        parts = [of[start:end] for start, end in zip(starts.tolist(), ends.tolist(), strict=True)]
        numbers = np.sort(np.concatenate([of[:0], *parts]))
        again = numbers[1:] == numbers[:-1]  # in another block
        near = self.segments[np.concatenate([numbers[:1], numbers[1:][~again]])]
        return np.ascontiguousarray(near[_distance(near, place) <= radius])

    @lazy
    def _by_block(self) -> tuple[IntArray, int, IntArray, IntArray]:
        """Which segments (m,) touch which blocks (m,) with their bounding boxes, block by block.

        Blocks are numbered column by column, from the lower one (2,), so many rows a column.
        """
        ends = self.segments.reshape(-1, 2, 2)
        lower = np.floor(ends.min(axis=1) / SIDE).astype(np.int64)
        counts = np.floor(ends.max(axis=1) / SIDE).astype(np.int64) - lower + 1
        of = np.repeat(np.arange(len(ends)), counts.prod(axis=1))
        number = np.arange(len(of)) - np.searchsorted(of, of)
        x, y = np.divmod(number, counts[of, 1])
        corner = lower.min(axis=0)
        rows = int((lower + counts)[:, 1].max() - corner[1])
        blocks = (lower[of, 0] - corner[0] + x) * rows + lower[of, 1] - corner[1] + y
        order = np.argsort(blocks, kind="stable")
        return corner, rows, blocks[order], of[order]


def _distance(segments: FloatArray, point: FloatArray) -> FloatArray:
    """Distances (k,) of segments (k, 4) from a point (2,)."""
    (ax, ay, bx, by), (x, y) = segments.T, point.tolist()
    along_x, along_y = bx - ax, by - ay
    squared = np.maximum(along_x**2 + along_y**2, np.finfo(float).tiny)
    share = np.minimum(np.maximum(((x - ax) * along_x + (y - ay) * along_y) / squared, 0.0), 1.0)
    return np.asarray(np.hypot(ax + share * along_x - x, ay + share * along_y - y))

"""Which of a building's many wall segments lie near a place, without looking at all of them."""

from __future__ import annotations

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
        (first_x, first_y), (last_x, last_y) = (
            (np.floor((place + side * radius) / SIDE).astype(int) - lower).tolist()
            for side in (-1.0, 1.0)
        )
        first_y, last_y = max(first_y, 0), min(last_y, rows - 1)
        columns = np.arange(max(first_x, 0), last_x + 1) * rows
        starts = np.searchsorted(blocks, columns + first_y)
        ends = np.searchsorted(blocks, columns + last_y, side="right")
        parts = [of[start:end] for start, end in zip(starts.tolist(), ends.tolist(), strict=True)]
        near = self.segments[np.unique(np.concatenate([of[:0], *parts]))]
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
    start, along = segments[:, :2], segments[:, 2:] - segments[:, :2]
    length_squared = np.maximum((along**2).sum(axis=1), np.finfo(float).tiny)
    share = (((point - start) * along).sum(axis=1) / length_squared).clip(0.0, 1.0)
    nearest = start + share[:, None] * along
    return np.asarray(np.hypot(*(nearest - point).T))

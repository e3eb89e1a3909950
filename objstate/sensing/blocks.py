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
        (first_x, first_y), (last_x, last_y) = (
            np.floor((place + side * radius) / SIDE).astype(int).tolist() for side in (-1.0, 1.0)
        )
        blocks = (
            self._by_block.get((x, y))
            for x in range(first_x, last_x + 1)
            for y in range(first_y, last_y + 1)
        )
        found = [each for each in blocks if each is not None]
        if not found:
            return self.segments[:0]
        near = self.segments[np.unique(np.concatenate(found))]
        return np.ascontiguousarray(near[_distance(near, place) <= radius])

    @lazy
    def _by_block(self) -> dict[tuple[int, int], IntArray]:
        """Indices of the segments whose bounding boxes touch each block."""
        ends = self.segments.reshape(-1, 2, 2)
        lower = np.floor(ends.min(axis=1) / SIDE).astype(np.int64)
        counts = np.floor(ends.max(axis=1) / SIDE).astype(np.int64) - lower + 1
        of = np.repeat(np.arange(len(ends)), counts.prod(axis=1))
        number = np.arange(len(of)) - np.searchsorted(of, of)
        x, y = np.divmod(number, counts[of, 1])
        blocks = lower[of] + np.column_stack([x, y])
        order = np.lexsort(blocks.T)
        blocks, of = blocks[order], of[order]
        starts = np.flatnonzero(np.append(True, (np.diff(blocks, axis=0) != 0).any(axis=1)))
        parts = np.split(of, starts[1:])
        return {(x, y): part for (x, y), part in zip(blocks[starts].tolist(), parts, strict=True)}


def _distance(segments: FloatArray, point: FloatArray) -> FloatArray:
    """Distances (k,) of segments (k, 4) from a point (2,)."""
    start, along = segments[:, :2], segments[:, 2:] - segments[:, :2]
    length_squared = np.maximum((along**2).sum(axis=1), np.finfo(float).tiny)
    share = (((point - start) * along).sum(axis=1) / length_squared).clip(0.0, 1.0)
    nearest = start + share[:, None] * along
    return np.asarray(np.hypot(*(nearest - point).T))

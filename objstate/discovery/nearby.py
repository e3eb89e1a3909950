"""Points by the squares of the floor in which they lie, so that what is near is found there."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from objstate.geometry import FloatArray, IntArray

SIDE = 0.5  # m, of a square


@dataclass(frozen=True, eq=False)
class Nearby:
    """The numbers of points, square after square."""

    corner: FloatArray  # (2,) m, of the first square
    shape: tuple[int, int]  # columns, rows
    order: IntArray = field(repr=False)  # (n,) numbers of the points
    begins: IntArray = field(repr=False)  # (squares + 1,) where those of each square begin

    @staticmethod
    def of(points: FloatArray) -> Nearby:
        """Those of points (n, 2) m."""
        if not len(points):
            return Nearby(np.zeros(2), (0, 0), np.empty(0, dtype=np.int64), np.zeros(1, dtype=int))
        corner = points.min(axis=0)
        column, row = np.floor((points - corner) / SIDE).astype(np.int64).T
        columns, rows = int(column.max()) + 1, int(row.max()) + 1
        square = row * columns + column
        order = np.argsort(square, kind="stable")
        begins = np.searchsorted(square[order], np.arange(columns * rows + 1))
        return Nearby(corner, (columns, rows), order, begins)

    def strip(self, start: FloatArray, end: FloatArray, near: float) -> IntArray:
        """Numbers (k,) of all points within ``near`` m of a straight line, and of some more."""
        columns = self.shape[0]
        ends = (np.array([start, end]) - self.corner) / SIDE
        reach = near / SIDE
        low = np.maximum(np.floor(ends.min(axis=0) - reach), 0.0).astype(int)
        high = np.minimum(np.floor(ends.max(axis=0) + reach) + 1, self.shape).astype(int)
        if (low >= high).any():
            return np.empty(0, dtype=np.int64)
        x, y = np.arange(low[0], high[0]) + 0.5, np.arange(low[1], high[1]) + 0.5
        way = ends[1] - ends[0]
        length = float(np.hypot(*way))
        unit = way / max(length, 1e-9)
        aside = np.abs(unit[0] * (y[:, None] - ends[0, 1]) - unit[1] * (x - ends[0, 0]))
        # a square's half diagonal; along a row the squares that a strip meets are neighbours
        met = aside <= reach + np.sqrt(0.5)
        parts = []
        for row, squares in zip(range(low[1], high[1]), met, strict=True):
            found = np.flatnonzero(squares)
            if len(found):
                first = row * columns + low[0] + int(found[0])
                last = row * columns + low[0] + int(found[-1])
                parts.append(self.order[self.begins[first] : self.begins[last + 1]])
        return np.concatenate(parts) if parts else np.empty(0, dtype=np.int64)

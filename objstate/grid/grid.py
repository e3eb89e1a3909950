"""The grid: cells over a floor that take percepts, drawings and other maps in, and age."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from objstate.errors import GridError
from objstate.grid.cells import CellModel, CountCells, Fields, Flat, Plane
from objstate.grid.drawing import UNKNOWN, Drawing
from objstate.grid.entropy import Method, entropy
from objstate.grid.layout import Layout
from objstate.grid.merging import Merge, resampled
from objstate.grid.percepts import Percepts
from objstate.lazy import Later
from objstate.records import NANOSECONDS

if TYPE_CHECKING:
    from objstate.grid import rasters
else:
    rasters = Later("objstate.grid.rasters")

OCCUPIED, FREE = 0.55, 0.45  # values from which a cell counts as such (Darmstadt, section 7.3)
ELLIPSE = 0.9  # of the Gaussian about an obstacle, how much of it is drawn
ROOM = 1 << 16  # cells of one sweep; more where it needs more
LAST_INDEX = np.iinfo(np.int32).max


class Grid:
    """Cells of a layout that change in place, since a copy of a large map takes longer than a scan.

    Times are stamps in integer nanoseconds; ages count from the first. Cells never updated, and
    those whose reliability has run out, have the value 0.5.
    """

    def __init__(self, layout: Layout, cells: CellModel | None = None) -> None:
        self.layout = layout
        self.cells: CellModel = CountCells() if cells is None else cells
        self._fields: Fields = self.cells.empty(layout.size)
        self._index: Flat = np.full(layout.size, -1, dtype=np.int32)
        self._next = 0  # the update index from which the next sweep counts
        self._start_ns: int | None = None
        self._where, self._evidence = np.empty(ROOM, np.int32), np.empty(ROOM, np.float32)

    @property
    def memory(self) -> int:
        """Bytes that the cells take."""
        return sum(each.nbytes for each in (*self._fields, self._index))

    def values(self, stamp_ns: int) -> NDArray[np.float32]:
        """(rows, columns) the probability at a time that each cell is occupied."""
        return self.cells.values(self._fields, self._at(stamp_ns)).reshape(self.layout.shape)

    def entropy(self, stamp_ns: int, method: Method = "series") -> NDArray[np.float32]:
        """(rows, columns) bits; 1 where nothing is known."""
        return entropy(self.values(stamp_ns), method)

    def ages(self, stamp_ns: int) -> NDArray[np.float32]:
        """(rows, columns) the lost share of each cell's reliability: 0 new, 1 unknown."""
        left = (self._fields[-1] - np.float32(self._at(stamp_ns))) / np.float32(
            self.cells.max_age_s
        )
        lost = np.float32(1.0) - np.clip(left, np.float32(0.0), np.float32(1.0))
        return np.asarray(lost.reshape(self.layout.shape))

    def sweep(
        self,
        percepts: Percepts,
        stamp_ns: int,
        reach: float,
        scale: float = 1.0,
        merge: Merge | None = None,
    ) -> Drawing:
        """Take what a sensor saw in: obstacles first, then free beams up to them, each cell once.

        Evidence falls to nothing at a distance of ``reach`` m, eq. (6.9), and counts by ``scale``,
        the thesis' ValueScaling: the reliability of localization, from 0 to 1. Cells take it by
        their own rule, or by a merge. Returns what was drawn.
        """
        self.layout.require_frame(percepts.frame)
        if not (math.isfinite(reach) and reach > 0.0):
            raise GridError(f"A sweep can't reach {reach:g} m; give a number above 0.")
        _check_scale(scale)
        drawing = self._swept(percepts, reach, scale)
        self._take(drawing.where, drawing.values, stamp_ns, merge)
        return drawing

    def draw(
        self,
        drawings: Drawing | Sequence[Drawing],
        stamp_ns: int,
        merge: Merge | None = None,
        scale: float = 1.0,
        ignored: float | None = None,
    ) -> None:
        """Take shapes in as one update: of several that cover a cell, the first counts.

        Cells take their values as evidence by their own rule, or by a merge. What has the value
        ``ignored`` is skipped (algorithm 1).
        """
        _check_scale(scale)
        each = [drawings] if isinstance(drawings, Drawing) else list(drawings)
        for drawing in each:
            if not self.layout.same_cells(drawing.layout):
                raise GridError("A drawing was made for another layout than that of the grid.")
        if not each:
            return
        where, first = np.unique(np.concatenate([one.where for one in each]), return_index=True)
        values = np.concatenate([one.scaled(scale).values for one in each])[first]
        kept = slice(None) if ignored is None else values != np.float32(ignored)
        self._take(where[kept], np.ascontiguousarray(values[kept]), stamp_ns, merge)

    def merge(
        self, other: Grid, stamp_ns: int, merge: Merge, ignored: float | None = UNKNOWN
    ) -> None:
        """Merge another grid into this one, whatever its cells, origin, heading and resolution.

        Where the other has the value ``ignored``, which means unknown, this one is kept.
        """
        values = resampled(other.values(stamp_ns), other.layout, self.layout).ravel()
        where = np.arange(self.layout.size, dtype=np.int32)
        if ignored is not None:
            where = where[values != np.float32(ignored)]
        self._take(where, values[where], stamp_ns, merge)

    def _swept(self, percepts: Percepts, reach: float, scale: float) -> Drawing:
        layout = self.layout
        cos, sin = math.cos(layout.origin[2]), math.sin(layout.origin[2])
        turn = np.array([[cos, sin], [-sin, cos]]) / layout.resolution
        covariances = turn @ percepts.covariances @ turn.T
        spreads = np.ascontiguousarray(covariances.reshape(-1, 4)[:, [0, 1, 3]])
        starts, ends = layout.to_cells(percepts.starts), layout.to_cells(percepts.ends)
        quantile, far = -2.0 * math.log(1.0 - ELLIPSE), reach / layout.resolution
        if self._next > LAST_INDEX - layout.size:
            self._renumber()
        cells = layout.columns, layout.rows
        while True:
            base, listed = self._next, (self._where, self._evidence)
            count = rasters.draw_obstacles(
                self._index,
                base,
                *cells,
                starts,
                ends,
                percepts.obstacle,
                percepts.shares,
                spreads,
                quantile,
                far,
                scale,
                *listed,
            )
            if count >= 0:
                count = rasters.draw_beams(
                    self._index, base, *cells, starts, ends, count, far, scale, *listed
                )
            if count >= 0:
                break
            self._renumber()
            room = 2 * len(self._where)
            self._where, self._evidence = np.empty(room, np.int32), np.empty(room, np.float32)
        self._next += count
        return Drawing(layout, self._where[:count].copy(), self._evidence[:count].copy())

    def _renumber(self) -> None:
        self._index[:] = -1
        self._next = 0

    def _take(self, where: Flat, values: Plane, stamp_ns: int, merge: Merge | None) -> None:
        at = self._at(stamp_ns)
        if merge is None:
            self.cells.update(self._fields, where, values, at)
            return
        before = self.cells.values(tuple(each[where] for each in self._fields), at)
        self.cells.assign(self._fields, where, merge(before, values), at)

    def _at(self, stamp_ns: int) -> float:
        """Seconds since the first stamp, so that single precision serves."""
        if self._start_ns is None:
            self._start_ns = stamp_ns
        return (stamp_ns - self._start_ns) / NANOSECONDS


def _check_scale(scale: float) -> None:
    if not 0.0 <= scale <= 1.0:
        raise GridError(f"Evidence can't be scaled by {scale:g}; give a share between 0 and 1.")

"""All free places in a building, and the ranges of a laser in all directions from each.

The inside of a large solid counts as free, too; no scan fits there.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import TYPE_CHECKING

import numpy as np

from objstate.config import BeamModelSettings, SearchSettings
from objstate.geometry import BoolArray, FloatArray, IntArray, compose
from objstate.lazy import Later, lazy
from objstate.records import Scan
from objstate.sensing import BeamModel

if TYPE_CHECKING:
    from objstate.localization import tables
else:
    tables = Later("objstate.localization.tables")

TURNS = 90  # bearings of the tabulated ranges, and headings that are tried
HEADINGS = np.linspace(0.0, 2.0 * np.pi, TURNS, endpoint=False)  # rad
MOST_CELLS = 1000  # largest number of cells along a side of the grid in which walls are found
LASERS_KEPT = 4
LEVEL = 0.1  # sine of a beam's slope up to which it counts as level
CLEARANCE = 0.15  # m around a robot's centre that must be free
FIRST_LOOKS = 4000  # places from which the free share of a large building is estimated
EVENLY = (
    0.7548776662466927,
    0.5698402909980532,
)  # steps of a low-discrepancy sequence (Roberts 2018)
SPARE = 1.1  # factor by which more may be free than estimated
ENCLOSED = 0.75  # share of bearings at which a place inside a building sees walls


@dataclass(frozen=True, eq=False)
class Places:
    """Free places on a grid over the floor, and the ranges expected from each."""

    spacing: float  # m
    corner: FloatArray  # (2,) of the first cell
    cells: IntArray  # (w, h) number of the place in each cell, -1 where it isn't free
    points: FloatArray  # (c, 2)
    nearest: FloatArray  # (c, TURNS) m, smallest range about each bearing
    farthest: FloatArray  # (c, TURNS) m, largest

    @staticmethod
    def of(walls: FloatArray, settings: SearchSettings) -> Places:
        """The free places between walls, segments (k, 4) at a laser's height.

        None where walls enclose nothing.
        """
        if len(walls) == 0:
            return Places.none(settings.spacing)
        ends = walls.reshape(-1, 2)
        corner, upper = ends.min(axis=0), ends.max(axis=0)
        size = upper - corner
        look_round, spacing = _look_round(ends - corner, size), settings.spacing
        if np.prod(size / spacing) > settings.max_places:
            *_, free = look_round(np.modf(np.outer(np.arange(FIRST_LOOKS), EVENLY))[0] * size)
            taken = SPARE * max(float(free.mean()), 1.0 / FIRST_LOOKS) * float(np.prod(size))
            spacing = max(spacing, math.sqrt(taken / settings.max_places))
        while True:
            shape = np.ceil(size / spacing).astype(int).clip(min=1)
            column, row = np.divmod(np.arange(shape.prod()), shape[1])
            points = (np.column_stack([column, row]) + 0.5) * spacing
            nearest, farthest, free = look_round(points)
            if free.sum() <= settings.max_places:
                break
            spacing *= math.sqrt(SPARE * free.sum() / settings.max_places)
        cells = np.full(len(points), -1)
        cells[free] = np.arange(free.sum())
        return Places(
            spacing,
            corner,
            cells.reshape(shape),
            corner + points[free],
            nearest[free],
            farthest[free],
        )

    @staticmethod
    def some(walls: FloatArray, count: int) -> FloatArray:
        """Ranges (c, TURNS) m in all directions from up to ``count`` evenly spread free places.

        ``walls`` are segments (k, 4).
        """
        if len(walls) == 0:
            return np.empty((0, TURNS))
        ends = walls.reshape(-1, 2)
        corner, size = ends.min(axis=0), np.ptp(ends, axis=0)
        look_round, ranges = _look_round(ends - corner, size), [np.empty((0, TURNS))]
        for tried in np.split(np.arange(FIRST_LOOKS), FIRST_LOOKS // count):
            nearest, _, free = look_round(np.modf(np.outer(tried, EVENLY))[0] * size)
            ranges.append(nearest[free])
            if sum(map(len, ranges)) >= count:
                break
        return np.concatenate(ranges)[:count]

    @staticmethod
    def none(spacing: float) -> Places:
        """The places of a building without walls."""
        unseen = np.empty((0, TURNS))
        return Places(spacing, np.zeros(2), np.full((1, 1), -1), np.empty((0, 2)), unseen, unseen)

    def log_likelihood(
        self,
        scan: Scan,
        beam_model: BeamModelSettings,
        beams: int,
        points: FloatArray,
        headings: FloatArray,
        step: FloatArray,
    ) -> FloatArray:
        """Approximate log p(o | l) (p, t) of a scan's walls by look-up.

        For robots at points (p, 2) in t headings each, (p, t), or (1, t) where all have the same.
        The laser stands at a ``step`` (3,) from them.
        """
        chosen, bins = _by_bearing(scan, beams)
        middle = scan.rays.origins[:, :2].mean(axis=0) if len(scan) else np.zeros(2)
        model = BeamModel(beam_model, self.spacing / 2.0)
        peak, per_sigma, anything, missing, hit, reach, *_ = model.parameters(
            scan.range_max
        ).tolist()
        measured = scan.ranges[chosen]
        floor = np.full(len(measured), anything)
        with np.errstate(divide="ignore"):
            rows = np.log(np.stack([floor, floor + model.short(measured)]).clip(min=1e-9))
        near, far, breadth = self._within(reach, hit, peak)
        found = tables.scores(
            np.ascontiguousarray(points),
            np.ascontiguousarray(headings),
            self.cells,
            self.corner,
            self.spacing,
            near,
            far,
            breadth,
            bins,
            np.vstack([measured, rows]),
            compose(step, np.array([*middle, 0.0])),
            reach,
            np.log(np.array([missing + hit, missing]).clip(min=1e-9)),
            per_sigma,
        )
        return np.asarray(found)

    @lazy
    def _within(self) -> Callable[[float, float, float], tuple[FloatArray, FloatArray, FloatArray]]:
        """``_between`` of these places, cached for a few lasers."""
        return lru_cache(maxsize=LASERS_KEPT)(partial(_between, self.nearest, self.farthest))


def _between(
    nearest: FloatArray, farthest: FloatArray, reach: float, hit: float, peak: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Smallest and largest ranges (c, TURNS) of a laser of some reach, and the log density between.

    ``hit`` is the probability of a hit, ``peak`` its largest density.
    """
    near, far = (np.minimum(each, reach) for each in (nearest, farthest))
    return near, far, np.log(hit / (far - near + hit / peak))


def _look_round(
    ends: FloatArray, size: FloatArray
) -> Callable[[FloatArray], tuple[FloatArray, FloatArray, BoolArray]]:
    """A function of points (c, 2): ranges about each bearing (c, TURNS), and which are free.

    Walls are given by their two ends (2 k, 2) in a rectangle of a ``size`` (2,) that begins at the
    origin.
    """
    walls = ends.reshape(-1, 4)
    side = max(float(np.sqrt(np.prod(size) / len(walls))), float(size.max()) / MOST_CELLS)
    columns, rows = (int(length / side) + 1 for length in size)
    numbers, first, last = tables.by_cell(walls, side, columns, rows)
    directions = np.column_stack([np.cos(HEADINGS), np.sin(HEADINGS)])

    def look(points: FloatArray) -> tuple[FloatArray, FloatArray, BoolArray]:
        nearest, farthest, free = tables.look_round(
            points, directions, walls, numbers, first, last, side, CLEARANCE, ENCLOSED
        )
        return nearest, farthest, free

    return look


def _by_bearing(scan: Scan, most: int) -> tuple[IntArray, IntArray]:
    """At most so many beams (n,) of a scan, evenly spread, and their bearings in steps (n,)."""
    level = np.abs(scan.rays.directions[:, 2]) <= LEVEL
    usable = np.flatnonzero(scan.valid & level)
    if len(usable) > most:
        usable = usable[np.arange(most) * len(usable) // most]
    bearings = np.arctan2(scan.rays.directions[usable, 1], scan.rays.directions[usable, 0])
    steps = np.round(bearings / (2.0 * np.pi) * TURNS).astype(np.int64)
    return usable, steps % TURNS

"""Every free place in a building, and what a laser would read all round from there.

The inside of something solid and large counts as free, too; no scan fits there.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import TYPE_CHECKING, Any

import numpy as np

from objstate.config import BeamModelSettings, SearchSettings
from objstate.geometry import BoolArray, FloatArray, IntArray, compose
from objstate.lazy import Later, lazy
from objstate.records import Scan
from objstate.sensing import BeamModel

if TYPE_CHECKING:
    from objstate.localization import search_kernels
else:
    search_kernels = Later("objstate.localization.search_kernels")

TURNS = 90  # bearings at which ranges are looked up, and headings that are tried
HEADINGS = np.linspace(0.0, 2.0 * np.pi, TURNS, endpoint=False)  # rad, those
MOST_CELLS = 1000  # of the grid in which walls are found, along a side
LASERS_KEPT = 4
LEVEL = 0.1  # sine of a beam's slope up to which it reads about what a level one does
CLEARANCE = 0.15  # m around a robot's middle that must be free
FIRST_LOOKS = 4000  # places that tell how much of a large building is free
EVENLY = (
    0.7548776662466927,
    0.5698402909980532,
)  # steps by which points cover a square (Roberts 2018)
SPARE = 1.1  # by which more may be free than a first look tells
ENCLOSED = 0.75  # of all bearings at which a place inside a building sees walls


@dataclass(frozen=True, eq=False)
class Places:
    """Free places on a grid over the floor, and what should be read from each."""

    spacing: float  # m
    corner: FloatArray  # (2,) of the first cell
    cells: IntArray  # (w, h) the place in each cell, -1 where none is free
    points: FloatArray  # (c, 2)
    nearest: FloatArray  # (c, TURNS) m, of the ranges about each bearing
    farthest: FloatArray  # (c, TURNS) m

    @staticmethod
    def of(walls: FloatArray, settings: SearchSettings) -> Places:
        """The free places between walls, segments (k, 4) at a laser's height; none where they enclose none."""
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
        """Ranges (c, TURNS) m all round from up to ``count`` free places, evenly spread between walls (k, 4)."""
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
        """Of a building without walls."""
        unseen = np.empty((0, TURNS))
        return Places(spacing, np.zeros(2), np.full((1, 1), -1), np.empty((0, 2)), unseen, unseen)

    def log_likelihood(
        self,
        scan: Scan,
        beam_model: BeamModelSettings,
        beams: int,
        poses: FloatArray,
        step: FloatArray,
    ) -> FloatArray:
        """About log p(o | l) (p,) of a scan's walls, by look-up, for a step (3,) on from robot poses (p, 3)."""
        looked_up = self._looked_up(scan, beam_model, beams, step)
        return np.asarray(search_kernels.scores(poses, *looked_up))

    def log_likelihoods(
        self,
        scan: Scan,
        beam_model: BeamModelSettings,
        beams: int,
        points: FloatArray,
        step: FloatArray,
    ) -> FloatArray:
        """The same (c, TURNS) of robots at points (c, 2) in every heading."""
        looked_up = self._looked_up(scan, beam_model, beams, step)
        return np.asarray(search_kernels.scores_all_round(points, HEADINGS, *looked_up))

    def _looked_up(
        self, scan: Scan, beam_model: BeamModelSettings, beams: int, step: FloatArray
    ) -> tuple[Any, ...]:
        """What the compiled loops need to know of these places and of a scan's beams."""
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
        return (
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

    @lazy
    def _within(self) -> Callable[[float, float, float], tuple[FloatArray, FloatArray, FloatArray]]:
        """``_between`` of these places, remembered for a few lasers."""
        return lru_cache(maxsize=LASERS_KEPT)(partial(_between, self.nearest, self.farthest))


def _between(
    nearest: FloatArray, farthest: FloatArray, reach: float, hit: float, peak: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """What a laser that sees so far should read (c, TURNS) at least and at most, and the log density between.

    ``hit`` is the probability of a hit, ``peak`` its highest density.
    """
    near, far = (np.minimum(each, reach) for each in (nearest, farthest))
    return near, far, np.log(hit / (far - near + hit / peak))


def _look_round(
    ends: FloatArray, size: FloatArray
) -> Callable[[FloatArray], tuple[FloatArray, FloatArray, BoolArray]]:
    """What is read at least and at most about each bearing (c, TURNS) from points (c, 2), and which are free and inside.

    Walls have their two ends (2 k, 2) in a rectangle of a ``size`` (2,) that begins in the origin.
    """
    walls = ends.reshape(-1, 4)
    side = max(float(np.sqrt(np.prod(size) / len(walls))), float(size.max()) / MOST_CELLS)
    columns, rows = (int(length / side) + 1 for length in size)
    numbers, first, last = search_kernels.by_cell(walls, side, columns, rows)
    directions = np.column_stack([np.cos(HEADINGS), np.sin(HEADINGS)])

    def look(points: FloatArray) -> tuple[FloatArray, FloatArray, BoolArray]:
        nearest, farthest, free = search_kernels.look_round(
            points, directions, walls, numbers, first, last, side, CLEARANCE, ENCLOSED
        )
        return nearest, farthest, free

    return look


def _by_bearing(scan: Scan, most: int) -> tuple[IntArray, IntArray]:
    """Which beams (n,) of a scan to look up, evenly spread, and their bearings in steps (n,)."""
    level = np.abs(scan.rays.directions[:, 2]) <= LEVEL
    usable = np.flatnonzero(scan.valid & level)
    if len(usable) > most:
        usable = usable[np.arange(most) * len(usable) // most]
    bearings = np.arctan2(scan.rays.directions[usable, 1], scan.rays.directions[usable, 0])
    steps = np.round(bearings / (2.0 * np.pi) * TURNS).astype(np.int64)
    return usable, steps % TURNS

"""Every free place in a building, and what a laser would read all round from there.

The inside of something solid and large counts as free, too; no scan fits there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache, partial

import numpy as np

from objstate.config import BeamModelSettings, SearchSettings
from objstate.geometry import BoolArray, FloatArray, IntArray, compose
from objstate.lazy import lazy
from objstate.records import Rays, Scan
from objstate.sensing import BeamModel, ExpectedRanges

TURNS = 90  # bearings at which ranges are looked up, and headings that are tried
AT_ONCE = 2000  # places cast together
LASERS_KEPT = 4
LEVEL = 0.1  # sine of a beam's slope up to which it reads about what a level one does
CLEARANCE = 0.15  # m around a robot's middle that must be free
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
    def of(expected: ExpectedRanges, height: float, settings: SearchSettings) -> Places:
        """The free places of a building, seen by a laser at a height; none where nothing encloses any."""
        corners = expected.building.walls.vertices[:, :2]
        if len(corners) == 0:
            return Places.none(settings.spacing)
        corner, upper = corners.min(axis=0), corners.max(axis=0)
        spacing = max(
            settings.spacing, float(np.sqrt(np.prod(upper - corner) / settings.max_places))
        )
        is_final = spacing == settings.spacing
        while True:  # in a large building, a first look tells how much of it is free
            shape = np.ceil((upper - corner) / spacing).astype(int).clip(min=1)
            column, row = np.divmod(np.arange(shape.prod()), shape[1])
            points = corner + (np.column_stack([column, row]) + 0.5) * spacing
            ranges, free = _look_round(expected, points, height)
            if is_final and free.sum() <= settings.max_places:
                break
            share = 1.1 * max(int(free.sum()), 1) / settings.max_places
            spacing, is_final = max(settings.spacing, spacing * float(np.sqrt(share))), True
        cells = np.full(len(points), -1)
        cells[free] = np.arange(free.sum())
        about = np.stack([np.roll(ranges[free], turn, axis=1) for turn in (-1, 0, 1)])
        return Places(
            spacing,
            corner,
            cells.reshape(shape),
            points[free],
            np.ascontiguousarray(about.min(axis=0)),
            np.ascontiguousarray(about.max(axis=0)),
        )

    @staticmethod
    def none(spacing: float) -> Places:
        """Of a building without walls."""
        unseen = np.empty((0, TURNS))
        return Places(spacing, np.zeros(2), np.full((1, 1), -1), np.empty((0, 2)), unseen, unseen)

    def everywhere(self) -> FloatArray:
        """Poses (c * TURNS, 3) at every place in every heading."""
        yaws = np.arange(TURNS) * (2.0 * np.pi / TURNS)
        count = len(self.points)
        return np.column_stack([np.repeat(self.points, TURNS, axis=0), np.tile(yaws, count)])

    def log_likelihood(
        self,
        scan: Scan,
        beam_model: BeamModelSettings,
        beams: int,
        poses: FloatArray,
        step: FloatArray,
    ) -> FloatArray:
        """About log p(o | l) (p,) of a scan's walls, by look-up, for a step (3,) on from robot poses (p, 3)."""
        from objstate.localization import search_kernels

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
        found = search_kernels.scores(
            poses,
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
    expected: ExpectedRanges, points: FloatArray, height: float
) -> tuple[FloatArray, BoolArray]:
    """Ranges (c, TURNS) all round from points (c, 2), and which of them are free and inside."""
    bearings = np.arange(TURNS) * (2.0 * np.pi / TURNS)
    directions = np.column_stack([np.cos(bearings), np.sin(bearings), np.zeros(TURNS)])
    rays = Rays(np.tile([0.0, 0.0, height], (TURNS, 1)), directions)
    poses = np.column_stack([points, np.zeros(len(points))])
    parts = [expected.walls(poses[k : k + AT_ONCE], rays) for k in range(0, len(poses), AT_ONCE)]
    ranges = np.concatenate(parts)
    enclosed = np.isfinite(ranges).mean(axis=1) >= ENCLOSED
    return ranges, enclosed & (ranges.min(axis=1) >= CLEARANCE)


def _by_bearing(scan: Scan, most: int) -> tuple[IntArray, IntArray]:
    """Which beams (n,) of a scan to look up, evenly spread, and their bearings in steps (n,)."""
    level = np.abs(scan.rays.directions[:, 2]) <= LEVEL
    usable = np.flatnonzero(scan.valid & level)
    if len(usable) > most:
        usable = usable[np.arange(most) * len(usable) // most]
    bearings = np.arctan2(scan.rays.directions[usable, 1], scan.rays.directions[usable, 0])
    steps = np.round(bearings / (2.0 * np.pi) * TURNS).astype(np.int64)
    return usable, steps % TURNS

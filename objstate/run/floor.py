"""The occupancy grid of obstacles that are not in the building, during a run."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from objstate.building.model import Building
from objstate.config import Settings
from objstate.estimator import Estimator
from objstate.geometry import BoolArray, FloatArray
from objstate.grid import (
    Candidates,
    CountCells,
    Drawing,
    Grid,
    Layout,
    Percepts,
    either,
    expected_occupancy,
    laser_percepts,
    overwrite,
)
from objstate.grid.grid import OCCUPIED
from objstate.localization import PoseBelief
from objstate.objects import ObjectBelief
from objstate.objects.covered import covered
from objstate.recording.candidates import write_candidates
from objstate.recording.grids import Clutter, ClutterWriter, write_map
from objstate.records import Estimate, Record, Scan
from objstate.run.candidates import found_of
from objstate.sensing import BeamModel, Sensing

if TYPE_CHECKING:
    from objstate.world.floor import FloorMemory

MARGIN = 0.5  # m around the walls
AROUND = 25.0  # m around the robot's first pose, where the building has no walls
MOMENTS_NS = 5_000_000_000  # between two moments that are written
OBJECTS_NS = 500_000_000  # between two drawings of what objects cover
SWEEPS = 3  # sweeps over a scan until the neighbours' states have converged
SURE = 2.0  # deviations of range and pose at the edge of what a belief covers


class Floor:
    """Adds every level scan with a narrow robot belief to the grid.

    The end of a beam counts as an obstacle by the probability that neither a wall nor an object of
    the building stopped it. While the robot is lost no scan is added, and cells age.
    """

    def __init__(self, building: Building, settings: Settings, writer: ClutterWriter) -> None:
        self.grid: Grid | None = None  # from the first scan on with a pose
        self.taken = 0  # scans
        self.candidates: Candidates | None = None  # for objects, likewise
        self._building = building
        self._settings = settings.in_building(building.error)
        self._sensing = Sensing(building, BeamModel(settings.beam_model))
        self._writer = writer
        self._written_ns: int | None = None
        self._drawn: dict[str, tuple[ObjectBelief, Drawing]] = {}
        self._drawn_ns: int | None = None
        self._objects = np.zeros(0, dtype=np.float32)  # (n,) P(cell is covered by an object)

    def note(self, record: Record, estimator: Estimator, estimates: Sequence[Estimate]) -> None:
        """Add a scan."""
        robot = estimator.robot
        if not isinstance(record, Scan) or robot is None or not len(record):
            return
        if not self._sensing.is_level(record):
            return
        if self.grid is None:
            self.grid = Grid(self._layout(record, robot), CountCells(self._settings.grid.max_age_s))
            self._objects = np.zeros(self.grid.layout.size, dtype=np.float32)
            self._fresh = np.zeros(self.grid.layout.size, dtype=bool)
            self.candidates = Candidates(self.grid.layout)
        scale = 1.0 - robot.position_std / self._settings.grid.max_position_std
        if scale > 0.0 and not estimator.is_lost and record.valid.any():
            self._draw_objects(record.stamp_ns, estimator.objects)
            percepts = self._percepts(record, robot, estimator.map_error)
            reach = self._settings.grid.reach_m
            self._fresh[self.grid.sweep(percepts, record.stamp_ns, reach, scale).where] = True
            self.taken += 1
        if self._written_ns is None or record.stamp_ns - self._written_ns >= MOMENTS_NS:
            self._written_ns = record.stamp_ns
            self._writer.write([self.clutter(record.stamp_ns)])
            self._look(record.stamp_ns)

    def clutter(self, stamp_ns: int) -> Clutter:
        """The cells that are occupied at a moment by something that isn't in the building.

        Where an object is believed to be now, earlier readings are attributed to it.
        """
        if self.grid is None:
            return Clutter(stamp_ns, np.empty((0, 2)), np.empty(0, dtype=np.uint8))
        values = self._unknown_at(stamp_ns)
        rows, columns = np.nonzero(values > OCCUPIED)
        places = self.grid.layout.to_frame(np.column_stack([columns, rows]).astype(float) + 0.5)
        return Clutter(stamp_ns, places, np.rint(100 * values[rows, columns]).astype(np.uint8))

    def _unknown_at(self, stamp_ns: int) -> NDArray[np.float32]:
        """(rows, columns) P(occupied by something that isn't in the building)."""
        assert self.grid is not None
        objects = self._objects.reshape(self.grid.layout.shape)
        return np.asarray(self.grid.values(stamp_ns) * (1.0 - objects), dtype=np.float32)

    def _look(self, stamp_ns: int) -> None:
        """Update the candidates by the scans since the last time."""
        if self.grid is None or self.candidates is None or not self._fresh.any():
            return
        fresh = self._fresh.reshape(self.grid.layout.shape)
        self.candidates = self.candidates.looked(self._unknown_at(stamp_ns), fresh, stamp_ns)
        self._fresh[:] = False

    def occupied(self, stamp_ns: int, estimator: Estimator) -> NDArray[np.float32] | None:
        """(rows, columns) P(occupied) by all that is known; None before any pose.

        The grid and the objects' beliefs count as independent, and walls overwrite both, as the
        thesis' static map objects do.
        """
        if self.grid is None:
            return None
        layout, values = self.grid.layout, self.grid.values(stamp_ns).ravel()
        for name in estimator.objects:
            drawn = covered(layout, estimator.object_at(name, stamp_ns))
            values[drawn.where] = either(values[drawn.where], drawn.values)
        walls = self._walls(layout)
        values[walls.where] = overwrite(values[walls.where], walls.values)
        return values.reshape(layout.shape)

    def memory(self, stamp_ns: int) -> FloorMemory | None:
        """What a world keeps of the grid; None before any pose."""
        if self.grid is None:
            return None
        from objstate.world.floor import FloorMemory

        return FloorMemory.of(self.grid, self._unknown_at(stamp_ns), stamp_ns)

    def write(self, folder: Path, stamp_ns: int, estimator: Estimator) -> None:
        """Write the candidates and the map of the last moment; nothing without any pose."""
        values = self.occupied(stamp_ns, estimator)
        if self.grid is not None and values is not None:
            write_map(folder, values, self.grid.layout.resolution, self.grid.layout.origin)
        if self.candidates is not None:
            self._look(stamp_ns)
            write_candidates(folder, found_of(self.candidates))

    def doubts(self) -> list[str]:
        """Why the grid holds no readings, where that is so."""
        if self.grid is None:
            return ["No grid was made: no level laser's scan had a pose of the robot."]
        if not self.taken:
            return [
                "The grid took no scan in: the robot was lost, or its position had a deviation of "
                f"{self._settings.grid.max_position_std:g} m or more; raise grid.max_position_std."
            ]
        return []

    def _layout(self, scan: Scan, robot: PoseBelief) -> Layout:
        self._height = float(scan.rays.origins[0, 2])
        segments = self._sensing.walls_at(self._height)
        resolution = self._settings.grid.resolution_m
        if len(segments):
            return Layout.around(segments.reshape(-1, 2), resolution, MARGIN)
        return Layout.around(robot.mean[None, :2], resolution, AROUND)

    def _walls(self, layout: Layout) -> Drawing:
        segments = self._sensing.walls_at(self._height).reshape(-1, 2, 2)
        drawn = expected_occupancy(layout, list(segments), np.ones(len(segments)))
        return Drawing(layout, drawn.where, np.ones_like(drawn.values))

    def _draw_objects(self, stamp_ns: int, beliefs: dict[str, ObjectBelief]) -> None:
        """Update the cells that objects cover, where beliefs have changed."""
        assert self.grid is not None
        if self._drawn_ns is not None and stamp_ns - self._drawn_ns < OBJECTS_NS:
            return
        self._drawn_ns = stamp_ns
        changed = [
            name
            for name, belief in beliefs.items()
            if name not in self._drawn or self._drawn[name][0] is not belief
        ]
        if not changed:
            return
        margin = SURE * self._settings.building_error.range_std_m
        for name in changed:
            drawn = covered(self.grid.layout, beliefs[name], margin)
            self._drawn[name] = beliefs[name], drawn
        self._objects[:] = 0.0
        for _, drawn in self._drawn.values():
            before = self._objects[drawn.where]
            self._objects[drawn.where] = either(before, drawn.values)

    def _percepts(self, scan: Scan, robot: PoseBelief, wall_std: float) -> Percepts:
        """Percepts of a scan, weighted by the probability of being unexplained."""
        assert self.grid is not None
        error = self._settings.building_error
        seen = laser_percepts(scan, robot.mean, robot.covariance, error.range_std_m)
        course = seen.ends - seen.starts
        ranges = np.hypot(course[:, 0], course[:, 1])
        along = course / np.maximum(ranges, 1e-9)[:, None]
        surfaces = self._sensing.surfaces(float(scan.rays.origins[0, 2]))
        walls, numbers = surfaces.meet(seen.starts, along, scan.range_max)
        cosines = np.abs(np.einsum("nd,nd->n", along, surfaces.normals[numbers]))
        spread = np.einsum("ni,nij,nj->n", along, seen.covariances, along)
        variances = spread + (wall_std / np.maximum(cosines, 0.1)) ** 2
        unknown = self._unknown(ranges, walls, variances, seen.obstacle, scan.range_max)
        ends = seen.starts + np.minimum(ranges, walls)[:, None] * along  # no beam passes a wall
        cells = self.grid.layout.to_cells(ends)
        inside = self.grid.layout.within(cells)
        column, row = cells[inside].astype(np.int64).T
        by_object = np.zeros(len(ranges))
        by_object[inside] = self._objects[row * self.grid.layout.columns + column]
        weights = np.clip(unknown * (1.0 - by_object), 0.0, 1.0)
        return Percepts(seen.starts, ends, seen.obstacle, seen.covariances, seen.frame, weights)

    def _unknown(
        self,
        ranges: FloatArray,
        walls: FloatArray,
        variances: FloatArray,
        returned: BoolArray,
        range_max: float,
    ) -> FloatArray:
        """The probability (n,) that something unknown stopped each beam.

        The densities are those of the beam model. What stops a beam mostly stops its neighbour at
        about the same range; and a beam at an edge may meet the wall that its neighbours should.
        """
        model = self._settings.beam_model
        expected = np.stack([walls, np.roll(walls, 1), np.roll(walls, -1)])
        with np.errstate(invalid="ignore"):
            off = np.where(np.isfinite(expected), ranges - expected, np.inf)
        wall = model.z_hit * _normal(off, variances).max(axis=0)
        none = model.z_rand / range_max
        beside = np.stack([np.roll(ranges, 1), np.roll(ranges, -1)])
        near = _normal(ranges - beside, model.short_std**2)
        first = model.lambda_short * np.exp(-model.lambda_short * ranges)
        prior = np.where(ranges < walls, model.z_short / model.short_run, 0.0)
        unknown = returned.astype(float)
        for _ in range(SWEEPS):
            stopped = np.stack([np.roll(unknown, 1), np.roll(unknown, -1)])
            short = prior * (first + (model.short_run - 1.0) * (near * stopped).max(axis=0))
            unknown = np.where(returned, short / (wall + short + none), 0.0)
        return np.asarray(unknown)


def _normal(off: FloatArray, variance: FloatArray | float) -> FloatArray:
    return np.asarray(np.exp(-(off**2) / (2.0 * variance)) / np.sqrt(2.0 * math.pi * variance))

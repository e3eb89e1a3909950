"""Distances of a scan's readings from the walls, as functions of its laser's pose.

A reading's error along the beam is its distance from the wall times the length of the expected
range's gradient over the position, 1 / cos(incidence). Divided by that length, all readings of a
wall that is off its place have equal errors, at any incidence.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from objstate.building.model import Building, Kind, MovableObject
from objstate.calibration.options import CalibrationOptions
from objstate.config import Settings
from objstate.estimator import Estimator
from objstate.geometry import BoolArray, FloatArray, IntArray, transform_from_pose
from objstate.records import Scan
from objstate.sensing import BeamModel, Sensing, cast_from

STEP = np.array([0.01, 0.01, 0.003])  # m, m, rad of the differences that give gradients
BENT = 0.01  # m by which forward and backward differences may disagree: elsewhere there is an edge
STEEPEST = 3.0  # gradient's length, 1 / cos(incidence): 70 degrees; larger ones are too sensitive
SWING = np.radians(10.0)  # rad between the states of a door that are considered
SLIDE = 0.1  # m, the same of sliding doors and furniture
FITTING = 0.5  # m from the walls, within which most readings of a robot lie that isn't lost
MOST = 0.5  # of the readings
SECTORS = 8  # number of directions by which walls are distinguished
MOST_SQUARES = 1 << 24  # along one side of a building
STRAY = 0.3  # m around its place within which furniture is considered


@dataclass(frozen=True, eq=False)
class WallReadings:
    """Readings of walls in one scan, linear about a pose of the robot."""

    distances: FloatArray  # (n,) m from the wall, positive behind it
    gradients: FloatArray  # (n, 3) of the distances over the robot's x, y, yaw
    points: FloatArray  # (n, 2) m, of the walls, in the building
    scan: IntArray  # (n,) number of the scan

    @staticmethod
    def joined(parts: Sequence[WallReadings]) -> WallReadings:
        """Readings of several scans, numbered in their order."""
        return WallReadings(
            np.concatenate([part.distances for part in parts]),
            np.concatenate([part.gradients for part in parts]),
            np.concatenate([part.points for part in parts]),
            np.repeat(np.arange(len(parts)), [len(part.distances) for part in parts]),
        )

    def pieces(self, size: float) -> IntArray:
        """(n,) labels of pieces of wall: of one square of ``size`` m, facing the same way."""
        x, y = np.floor(self.points.T / size).astype(np.int64)
        facing = np.arctan2(self.gradients[:, 1], self.gradients[:, 0])
        sector = np.round(facing / (2.0 * np.pi / SECTORS)).astype(np.int64) % SECTORS
        return np.asarray((x * MOST_SQUARES + y) * SECTORS + sector)


class WallReader:
    """Reads scans against the walls of a building."""

    def __init__(self, building: Building, settings: Settings, options: CalibrationOptions) -> None:
        self._sensing = Sensing(building, BeamModel(settings.beam_model))
        self._beams = options.beams
        self._states = {name: _states(item) for name, item in building.objects.items()}
        self._places = {
            name: item.transforms(item.home[None])[0, :2, 3]
            for name, item in building.objects.items()
        }

    @staticmethod
    def of(estimator: Estimator, options: CalibrationOptions) -> WallReader:
        """With an estimator's building and settings."""
        return WallReader(estimator.building, estimator.settings, options)

    def beams_on_walls(self, scan: Scan, pose: FloatArray) -> BoolArray:
        """(n,) which beams return something, and meet no object in any state before a wall."""
        returned = np.isfinite(scan.ranges)
        view = self._sensing.view(scan, returned)
        walls = view.walls(pose[None])[0]
        free = np.isfinite(walls)
        for name, states in self._states.items():
            if np.hypot(*(self._places[name] - pose[:2])) < 2.0 * scan.range_max:
                free &= ~_widened((view.object(name, states, pose[None])[0] < walls).any(axis=0))
        usable = np.flatnonzero(returned)[free]
        chosen = np.zeros(len(scan), dtype=bool)
        chosen[usable[:: max(1, len(usable) // self._beams)]] = True
        return chosen

    def is_level(self, scan: Scan) -> bool:
        """Whether a laser sees walls at one height."""
        return self._sensing.is_level(scan)

    def fits(self, scan: Scan, pose: FloatArray, beams: BoolArray) -> bool:
        """Whether most readings of ``beams`` (n,) on walls, from a pose (3,), lie near them."""
        if not beams.any():
            return False
        walls = self._sensing.view(scan, beams).walls(pose[None])[0]
        near = np.abs(scan.ranges[beams] - walls) < FITTING
        return bool(near.mean() >= MOST)

    def read(self, scan: Scan, beams: BoolArray, pose: FloatArray) -> WallReadings:
        """The readings of ``beams`` (n,) near a robot pose (3,), without edges and grazed walls."""
        steps = np.vstack([np.zeros(3), np.diag(STEP), -np.diag(STEP)])
        walls = self._sensing.view(scan, beams).walls(pose + steps)
        expected, ahead, back = walls[0], walls[1:4], walls[4:7]
        with np.errstate(invalid="ignore"):
            slope = (ahead - back).T / (2.0 * STEP)
            bend = np.abs(ahead + back - 2.0 * expected).max(axis=0)
        steep = np.hypot(slope[:, 0], slope[:, 1])
        good = (bend < BENT) & (steep < STEEPEST) & (steep > 0.0) & np.isfinite(expected)
        off = (scan.ranges[beams] - expected)[good] / steep[good]
        origins, directions = cast_from(transform_from_pose(pose), scan.rays.take(beams))
        points = (origins[good] + expected[good, None] * directions[good])[:, :2]
        gradients = -slope[good] / steep[good, None]
        return WallReadings(off, gradients, points, np.zeros(len(off), dtype=np.int64))


def _states(item: MovableObject) -> FloatArray:
    """States (k, d) so close together that no beam can meet the object in another one only."""
    if item.kind is Kind.PLANAR:
        shifts = np.arange(-STRAY, STRAY + SLIDE / 2, SLIDE)
        x, y = (grid.ravel() for grid in np.meshgrid(shifts, shifts))
        return np.asarray(item.home + np.column_stack([x, y, np.zeros(len(x))]))
    step = SWING if item.kind is Kind.HINGED else SLIDE
    count = int(np.ceil((item.upper - item.lower) / step)) + 1
    return np.linspace(item.lower, item.upper, max(count, 2))[:, None]


def _widened(beams: BoolArray) -> BoolArray:
    """The beams (n,) and their neighbours."""
    out = beams.copy()
    out[1:] |= beams[:-1]
    out[:-1] |= beams[1:]
    return out

"""The walls and objects that one scan may meet, from the robot's estimated pose."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from objstate.estimator.surroundings import Surroundings
from objstate.geometry import BoolArray, FloatArray
from objstate.lazy import lazy
from objstate.localization import PoseBelief
from objstate.records import Scan
from objstate.sensing import ScanView, Sensing, circles


class Near(NamedTuple):
    """The objects near a robot, and the beams that may meet them.

    All other beams have the same likelihood in every state of the objects (section 3 of the paper).
    """

    names: list[str]
    pointed_at: list[str]  # those of them that some beam may touch
    beams: BoolArray  # (n,) that may touch one of them


@dataclass(frozen=True, eq=False)
class Sight:
    """One scan from the mean of a robot belief; objects are represented by their circles."""

    scan: Scan
    robot: PoseBelief
    whole: ScanView  # of all valid beams
    surroundings: Surroundings

    @staticmethod
    def of(scan: Scan, robot: PoseBelief, sensing: Sensing, surroundings: Surroundings) -> Sight:
        """A scan from the mean of a robot belief."""
        return Sight(scan, robot, sensing.view(scan), surroundings)

    def by(self, robot: PoseBelief) -> Sight:
        """The same scan from another robot belief."""
        if robot is self.robot:
            return self
        return Sight(self.scan, robot, self.whole, self.surroundings)

    @lazy
    def walls(self) -> FloatArray:
        """Range (n,) m of the walls for each beam; NaN for invalid beams."""
        walls: FloatArray = self.whole.walls(self.robot.mean[None])[0]
        if len(walls) == len(self.scan):
            return walls
        out = np.full(len(self.scan), np.nan)
        out[self.valid] = walls
        return out

    @property
    def height(self) -> float:
        """Height of the laser above the floor, m."""
        return float(self.scan.rays.origins[0, 2])

    @property
    def valid(self) -> BoolArray:
        """Which beams (n,) are valid."""
        return self.scan.valid

    def view(self, beams: BoolArray) -> ScanView:
        """The view of some of the valid beams (n,)."""
        return self.whole.take(beams[self.valid])

    @property
    def names(self) -> list[str]:
        """The objects that come within the laser's range."""
        return self._in_range[0]

    @lazy
    def _in_range(self) -> tuple[list[str], FloatArray]:
        """These, and the circles (m, 3) in which each of them can be."""
        return self.surroundings.within(self.robot.mean, self.scan.range_max)

    @lazy
    def _crossings(self) -> FloatArray:
        """Ranges (2, m, n) at which each beam enters and leaves each object's circle."""
        robot, rays = self.robot, self.scan.rays
        yaw_std = math.sqrt(robot.covariance[2, 2])
        found = circles.crossings(
            self._in_range[1], robot.mean, robot.position_std, yaw_std, rays.origins, *rays.courses
        )
        return np.asarray(found)

    @property
    def entries(self) -> FloatArray:
        """Range (m, n) at which each beam enters each object's circle; inf where it misses it.

        The circles are widened by the robot's own uncertainty.
        """
        return np.asarray(self._crossings[0])

    @property
    def ends_behind(self) -> BoolArray:
        """Whether each beam (m, n) ends behind the circle, so that no object in it stopped it."""
        ranges = self.scan.ranges
        return np.asarray(np.isfinite(ranges) & (ranges > self._crossings[1]))

    def entered(self, name: str) -> FloatArray:
        """Range (n,) at which each beam enters an object's circle; inf where it misses it."""
        if name not in self.names:
            return np.full(len(self.scan), np.inf)
        return np.asarray(self.entries[self.names.index(name)])

    def near(self, distance: float, beams: BoolArray) -> Near:
        """The objects within a distance, and which of the beams (n,) may meet them."""
        (names, around), (x, y, _) = self._in_range, self.robot.mean.tolist()
        found, pointed_at, used = circles.near(around, x, y, distance, self.entries, beams)
        return Near(
            [names[k] for k in found.tolist()], [names[k] for k in pointed_at.tolist()], used
        )

    def seen_by(self, beams: BoolArray) -> list[str]:
        """Objects that some of the beams (n,) may reach before a wall."""
        robot, rays, every = self.robot, self.scan.rays, self.surroundings
        seen = circles.seen(
            every.all_circles,
            robot.mean,
            robot.position_std,
            math.sqrt(robot.covariance[2, 2]),
            self.scan.range_max,
            rays.origins,
            *rays.courses,
            beams,
            self.walls[beams],
        )
        return [every.names[k] for k in seen.tolist()]

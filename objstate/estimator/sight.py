"""What one scan may see from where the robot thinks it is: walls, and the objects before them."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from objstate.estimator import kernels
from objstate.estimator.kernels import SPREAD_SIGMAS
from objstate.estimator.surroundings import Surroundings
from objstate.geometry import BoolArray, FloatArray, IntArray
from objstate.lazy import lazy
from objstate.localization import PoseBelief
from objstate.records import Scan
from objstate.sensing import ScanView


@dataclass(frozen=True, eq=False)
class Sight:
    """One scan from the mean of a robot belief; every object counts with the circle that holds it."""

    scan: Scan
    robot: PoseBelief
    whole: ScanView  # of all beams that say anything
    surroundings: Surroundings

    def by(self, robot: PoseBelief) -> Sight:
        """The same scan by another robot belief."""
        return Sight(self.scan, robot, self.whole, self.surroundings)

    @lazy
    def walls(self) -> FloatArray:
        """Range (n,) m of the walls for each beam; not a number for beams that say nothing."""
        out = np.full(len(self.scan), np.nan)
        out[self.valid] = self.whole.walls(self.robot.mean[None])[0]
        return out

    @property
    def valid(self) -> BoolArray:
        """Which beams (n,) say anything."""
        return self.scan.valid

    def view(self, beams: BoolArray) -> ScanView:
        """The view of some of the beams (n,) that say anything."""
        return self.whole.take(beams[self.valid])

    @lazy
    def names(self) -> list[str]:
        """The objects that come within the laser's range."""
        return [self.surroundings.names[k] for k in self._numbers.tolist()]

    @lazy
    def _numbers(self) -> IntArray:
        return self.surroundings.within(self.robot.mean, self.scan.range_max)

    @lazy
    def _circles(self) -> FloatArray:
        """(m, 3) in which each of them can be."""
        return self.surroundings.numbered(self._numbers)

    @lazy
    def entries(self) -> FloatArray:
        """Range (m, n) at which each beam enters each object's circle; inf where it passes by.

        The circles are widened by what the robot's own uncertainty may shift them.
        """
        robot, rays = self.robot, self.scan.rays
        yaw_std = math.sqrt(robot.covariance[2, 2])
        found = kernels.entries(
            self._circles, robot.mean, robot.position_std, yaw_std, rays.origins, *rays.courses
        )
        return np.asarray(found)

    def near(self, distance: float, beams: BoolArray) -> tuple[list[str], BoolArray]:
        """The objects within a distance, and which of the beams (n,) may touch each of them (m, n).

        The other beams are the same whatever the object does (section 3 of the paper).
        """
        x, y, _ = self.robot.mean
        chosen = kernels.within(self._circles, x, y, distance)
        towards = np.isfinite(self.entries[chosen]) & beams
        return [self.names[k] for k in chosen.tolist()], towards

    def seen_by(self, beams: BoolArray, but: Collection[str] = ()) -> list[str]:
        """Objects, but those named, that some of the beams (n,) may reach before they meet a wall."""
        margin = SPREAD_SIGMAS * self.robot.position_std
        reached = kernels.reached(self.entries, beams, self.walls, margin)
        return [name for k in reached.tolist() if (name := self.names[k]) not in but]

    @property
    def bare(self) -> BoolArray:
        """Which beams (n,) return from where no object can be."""
        return np.isfinite(self.scan.ranges) & ~np.isfinite(self.entries).any(axis=0)

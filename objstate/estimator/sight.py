"""What one scan may see from where the robot thinks it is: walls, and the objects before them."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from objstate.estimator.surroundings import SPREAD_SIGMAS, Surroundings
from objstate.geometry import BoolArray, FloatArray
from objstate.lazy import lazy
from objstate.localization import PoseBelief
from objstate.records import Scan
from objstate.sensing import ScanView, Sensing


@dataclass(frozen=True, eq=False)
class Sight:
    """One scan from the mean of a robot belief; every object counts with the circle that holds it."""

    scan: Scan
    robot: PoseBelief
    sensing: Sensing
    surroundings: Surroundings

    @lazy
    def walls(self) -> FloatArray:
        """Range (n,) m of the walls for each beam; not a number for beams that say nothing."""
        out = np.full(len(self.scan), np.nan)
        out[self.valid] = self._whole.walls(self.robot.mean[None])[0]
        return out

    @lazy
    def valid(self) -> BoolArray:
        """Which beams (n,) say anything."""
        return self.scan.valid

    @lazy
    def _whole(self) -> ScanView:
        return self.sensing.view(self.scan)

    def view(self, beams: BoolArray) -> ScanView:
        """The view of some of the beams (n,) that say anything."""
        return self._whole.take(beams[self.valid])

    @lazy
    def names(self) -> list[str]:
        """The objects that come within the laser's range."""
        return self.surroundings.within(self.robot, self.scan.range_max)

    @lazy
    def entries(self) -> FloatArray:
        """Range (m, n) at which each beam enters each object's circle; inf where it passes by."""
        return self.surroundings.entries(self.names, self.robot, self.scan.rays)

    def near(self, distance: float, beams: BoolArray) -> tuple[list[str], BoolArray]:
        """The objects within a distance, and which of the beams (n,) may touch each of them (m, n).

        The other beams are the same whatever the object does (section 3 of the paper).
        """
        near = set(self.surroundings.within(self.robot, distance, self.names))
        chosen = [k for k, name in enumerate(self.names) if name in near]
        towards = np.isfinite(self.entries[chosen]) & beams
        return [self.names[k] for k in chosen], towards

    def seen_by(self, beams: BoolArray, but: Collection[str] = ()) -> list[str]:
        """Objects, but those named, that some of the beams (n,) may reach before they meet a wall."""
        farthest = self.walls[beams] + SPREAD_SIGMAS * self.robot.position_std
        reached = np.flatnonzero((self.entries[:, beams] < farthest).any(axis=1))
        return [self.names[k] for k in reached if self.names[k] not in but]

    @property
    def bare(self) -> BoolArray:
        """Which beams (n,) return from where no object can be."""
        return np.isfinite(self.scan.ranges) & ~np.isfinite(self.entries).any(axis=0)

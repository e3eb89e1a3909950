"""The sector model, by which the robots knew obstacles before (section 4.2).

Each sector about the robot holds the nearest obstacle of the latest picture that showed one there, with
a confidence that falls with time, five times as fast in view. There is neither a filter nor free space.
The robot stands still in the experiments that compare it, so that no odometry moves the points.
"""

from __future__ import annotations

import numpy as np

from objstate.experiments.darmstadt.camera import OPTICS, Lines
from objstate.geometry import BoolArray, FloatArray, wrap

SECTORS = 36
MAX_AGE_S = 10.0  # until the confidence is zero
IN_VIEW = 5.0  # times faster, within the field of view


class Sectors:
    """A robot's sectors, which change in place."""

    def __init__(self) -> None:
        self.points: FloatArray = np.zeros((SECTORS, 2))  # m, in the robot's frame
        self.confidence: FloatArray = np.zeros(SECTORS)
        self._bearings = (np.arange(SECTORS) + 0.5) * 2.0 * np.pi / SECTORS

    @property
    def occupied(self) -> BoolArray:
        """(sectors,) which hold an obstacle."""
        return self.confidence > 0.0

    def update(self, seen: Lines, pan: float, seconds: float) -> None:
        """Age by the seconds since the last picture, then take in the obstacles of this one."""
        viewed = np.abs(wrap(self._bearings - pan)) <= OPTICS.wide / 2.0
        self.confidence -= seconds / MAX_AGE_S * np.where(viewed, IN_VIEW, 1.0)
        self.confidence = np.maximum(self.confidence, 0.0)
        points = seen.ends[seen.obstacle]
        away = np.hypot(points[:, 0], points[:, 1])
        bearing = np.mod(np.arctan2(points[:, 1], points[:, 0]), 2.0 * np.pi)
        sector = np.minimum((bearing / (2.0 * np.pi) * SECTORS).astype(np.int64), SECTORS - 1)
        for k in np.argsort(-away, kind="stable"):  # the nearest last
            self.points[sector[k]], self.confidence[sector[k]] = points[k], 1.0

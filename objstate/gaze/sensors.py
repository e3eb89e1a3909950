"""What a sensor can see, and how well it measures."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from objstate.geometry import BoolArray, FloatArray, wrap
from objstate.records import Rays

ALL_ROUND = 2.0 * np.pi


@dataclass(frozen=True)
class Sensor:
    """A sensor on the robot: a laser where it has beams, else a detector of whole objects."""

    name: str
    range_min: float = 0.05  # m
    range_max: float = 8.0  # m
    field_of_view: float = np.pi  # rad, about the robot's heading
    sigma: float = 0.03  # m: of a laser's range, or of each coordinate of a detected position
    beams: int = 181  # of a laser
    height: float = 0.3  # m above the floor

    def sees(self, pose: FloatArray, places: FloatArray) -> BoolArray:
        """Which places (n, 2) lie within range and field of view from a pose (3,); walls aside."""
        off = places - pose[:2]
        distance = np.hypot(off[:, 0], off[:, 1])
        near = (distance >= self.range_min) & (distance <= self.range_max)
        if self.field_of_view >= ALL_ROUND:
            return np.asarray(near)
        turn = wrap(np.arctan2(off[:, 1], off[:, 0]) - pose[2])
        return np.asarray(near & (np.abs(turn) <= self.field_of_view / 2.0))

    def rays(self) -> Rays:
        """A laser's beams in the robot's frame."""
        half = self.field_of_view / 2.0
        closed = self.field_of_view >= ALL_ROUND  # the last beam would be the first again
        bearings = np.linspace(-half, half, self.beams, endpoint=not closed)
        ahead = np.column_stack([np.cos(bearings), np.sin(bearings), np.zeros(self.beams)])
        return Rays(np.tile([0.0, 0.0, self.height], (self.beams, 1)), ahead)

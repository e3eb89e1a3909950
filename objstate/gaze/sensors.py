"""What a sensor can see, and how well it measures."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from objstate.errors import SettingsError
from objstate.geometry import BoolArray, FloatArray, wrap
from objstate.records import Rays

ALL_ROUND = 2.0 * np.pi
MOST_BEAMS = 100_000  # of a laser; those on the market have up to 30,000 a turn


@dataclass(frozen=True)
class Sensor:
    """A sensor on the robot: a laser where it has beams, else a detector of whole objects.

    Raises SettingsError for figures that no sensor has.
    """

    name: str
    range_min: float = 0.05  # m
    range_max: float = 8.0  # m
    field_of_view: float = np.pi  # rad, about the sensor's heading
    sigma: float = 0.03  # m: of a laser's range, or of each coordinate of a detected position
    beams: int = 181  # of a laser
    height: float = 0.3  # m above the floor
    x: float = 0.0  # m ahead of the robot's middle
    y: float = 0.0  # m to the left of it
    yaw: float = 0.0  # rad, of the sensor's heading from the robot's

    def __post_init__(self) -> None:
        positive = (self.range_min, self.range_max, self.field_of_view, self.sigma, self.height)
        if not all(math.isfinite(value) and value > 0.0 for value in positive):
            raise SettingsError(
                f"Sensor '{self.name}': ranges, field of view, sigma and height must be finite "
                "and above 0."
            )
        if self.field_of_view > ALL_ROUND:
            raise SettingsError(
                f"Sensor '{self.name}': a field of view of {math.degrees(self.field_of_view):g} "
                "degrees; give at most 360."
            )
        if not all(math.isfinite(value) for value in (self.x, self.y, self.yaw)):
            raise SettingsError(f"Sensor '{self.name}': x, y and yaw must be finite.")
        if self.range_min >= self.range_max:
            raise SettingsError(
                f"Sensor '{self.name}': its least range of {self.range_min:g} m must be below the "
                f"largest of {self.range_max:g} m."
            )
        if not 1 <= self.beams <= MOST_BEAMS:
            raise SettingsError(
                f"Sensor '{self.name}': {self.beams} beams; give from 1 to {MOST_BEAMS}."
            )

    def poses(self, robot: FloatArray) -> FloatArray:
        """Poses (..., 3) of the sensor on a robot at poses (..., 3)."""
        cos, sin = np.cos(robot[..., 2]), np.sin(robot[..., 2])
        x = robot[..., 0] + cos * self.x - sin * self.y
        y = robot[..., 1] + sin * self.x + cos * self.y
        return np.stack([x, y, robot[..., 2] + self.yaw], axis=-1)

    def sees(self, robot: FloatArray, places: FloatArray) -> BoolArray:
        """Which places (n, 2) are in range and view of a robot at a pose (3,), ignoring walls."""
        pose = self.poses(robot)
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
        bearings = bearings + self.yaw
        ahead = np.column_stack([np.cos(bearings), np.sin(bearings), np.zeros(self.beams)])
        return Rays(np.tile([self.x, self.y, self.height], (self.beams, 1)), ahead)

"""A sensor that can be turned: on a pan axis, or on a base that turns."""

from __future__ import annotations

import math
from dataclasses import dataclass

from objstate.errors import SettingsError
from objstate.gaze.sensors import Sensor


@dataclass(frozen=True)
class Head:
    """A sensor whose heading can be chosen. Raises SettingsError for figures that no head has.

    ``sensor.yaw`` is where it looks now, from the robot's heading.
    """

    sensor: Sensor
    turn: float = math.pi  # rad to either side of the robot's heading; pi: all round
    speed: float = math.pi / 2.0  # rad/s

    def __post_init__(self) -> None:
        if not 0.0 <= self.turn <= math.pi:
            raise SettingsError(
                f"Head '{self.sensor.name}' can't turn {math.degrees(self.turn):g} degrees to "
                "either side; give 0 to 180."
            )
        if not (math.isfinite(self.speed) and self.speed > 0.0):
            raise SettingsError(
                f"Head '{self.sensor.name}' can't turn with {math.degrees(self.speed):g} degrees "
                "a second; give a number above 0."
            )
        if abs(self.sensor.yaw) > self.turn and not self.turns_round:
            raise SettingsError(
                f"Head '{self.sensor.name}' can't look {math.degrees(self.sensor.yaw):g} degrees "
                f"aside: it turns no farther than {math.degrees(self.turn):g}."
            )

    @property
    def turns_round(self) -> bool:
        """Whether it can turn on for ever, as a base does."""
        return self.turn >= math.pi

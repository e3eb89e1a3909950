"""The set-up of section 7 of Elfring et al. 2014, and what the paper leaves open."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from objstate.gaze.gaussian import Counted, Counting
from objstate.gaze.sensors import Sensor

Strategy = Literal["coordinator", "fixed path"]
KINECT = np.radians(
    57.0
)  # rad, the horizontal field of view of the sensor that inspired the paper's


@dataclass(frozen=True)
class Assumptions:
    """What section 7 doesn't say. With the defaults, most of its figures come out."""

    speed: float = 1.45  # m/s; with it the fixed path takes as many actions as the paper's
    step: float = 0.5  # s, of the filters, the sensor and the decisions
    field_of_view: float = KINECT  # rad
    order: Literal["random", "shortest"] = "random"  # of the fixed path, along the objects
    coordinates: int = 3  # of an object's position: section 6 speaks of 3D positions
    counting: Counting = "every update"  # what of a way counts as its gain
    counted: Counted = "own object"  # whose gains: that of the action's object, as eq. (6) has it
    updates_when_idle: bool = False  # whether a robot that waits updates what it sees


@dataclass(frozen=True)
class Setup:
    """One simulation, but for its random numbers."""

    strategy: Strategy = "coordinator"
    gain_threshold: float = 8.0  # nats, IG_thr
    cost_weight: float = 0.75  # alpha
    gain_norm: float = 5.0  # nats, IG_norm
    room: float = 10.0  # m
    objects: int = 10
    duration: float = 1000.0  # s
    range_min: float = 0.4  # m
    range_max: float = 2.0  # m
    largest_drift: float = 0.01  # m^2 a time step: sigma_P is uniform below it
    noise: float = 0.01  # m^2, sigma_M
    assumptions: Assumptions = Assumptions()

    @property
    def sensor(self) -> Sensor:
        return Sensor(
            "detector",
            range_min=self.range_min,
            range_max=self.range_max,
            field_of_view=self.assumptions.field_of_view,
            sigma=float(np.sqrt(self.noise)),
        )

    @property
    def steps(self) -> int:
        return round(self.duration / self.assumptions.step)

    @property
    def stride(self) -> float:
        """m, driven in a time step."""
        return self.assumptions.speed * self.assumptions.step

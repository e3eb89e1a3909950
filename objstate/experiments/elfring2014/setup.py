"""The set-up of section 7 of Elfring et al. 2014, and what the paper leaves open."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from objstate.gaze.sensors import ALL_ROUND, Sensor

Strategy = Literal["coordinator", "fixed path"]


@dataclass(frozen=True)
class Assumptions:
    """What section 7 doesn't say. The defaults come nearest to the counts that it gives."""

    speed: float = 0.75  # m/s
    step: float = 1.0  # s, of the filters, the sensor and the decisions
    field_of_view: float = ALL_ROUND  # rad
    order: Literal["shortest", "random"] = "shortest"  # of the fixed path
    stop_at: float = 0.0  # m before an object, where an action ends
    replans: bool = False
    updates_when_idle: bool = True  # whether a robot that waits updates what it sees


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

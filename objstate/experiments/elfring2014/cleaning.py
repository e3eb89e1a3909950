"""Section 8.2 of Elfring et al. 2014: which sensor verifies the can that is about to be grabbed.

A robot stands before a can with two sensors: a laser on its torso, which goes no lower than 0.7 m,
and a camera with depth. Both cost nothing, as neither needs a way. Objects move only when the robot
moves them, so no update is worth it for its gain; the trigger of Table 1 asks for one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from objstate.gaze.entropy import diagonal_entropy
from objstate.maintenance.choice import ChoiceSettings, best, costs, utilities

LOWEST = 0.7  # m, height at which the torso laser can be brought
LASER = 0.005  # m, sigma of a position by the laser
CAMERA = 0.02  # m, by the camera, whose depth is coarser
SEEN_FIRST = 0.03  # m, by the recognition that found the object
DRIFT = 1e-4  # m in a second: what the robot doesn't move stays
PLACES = {"2: cabinet": 0.9, "4: table": 0.6}  # m, height of what the can stands on, by location
WAIT = 20.0  # s between recognition and grabbing
UPDATES = ChoiceSettings(gain_threshold=8.0, counting="gain", least_utility=-np.inf)


@dataclass(frozen=True)
class Verification:
    """What is done before a can is grabbed."""

    location: str
    height: float  # m
    gains: dict[str, float]  # nats, by sensor that can see it
    worth_by_gain: bool  # whether an update would be made without a trigger
    sensor: str  # that the trigger's update uses
    before: float  # nats
    after: float


def verifications() -> list[Verification]:
    """At the locations of Table 2 at which the robot grabs a can."""
    return [_verification(location, height) for location, height in PLACES.items()]


def _verification(location: str, height: float) -> Verification:
    variance = np.full(3, SEEN_FIRST**2 + WAIT * DRIFT**2)
    sensors = {"camera": CAMERA} | ({"torso laser": LASER} if height >= LOWEST else {})
    before = float(diagonal_entropy(variance))
    after = {
        name: float(diagonal_entropy(variance * sigma**2 / (variance + sigma**2)))
        for name, sigma in sensors.items()
    }
    gains = np.array([before - each for each in after.values()])
    cost = costs(np.zeros(len(gains)), UPDATES)
    utility = utilities(gains, cost, UPDATES)
    chosen = list(after)[int(utility.argmax())]
    return Verification(
        location,
        height,
        dict(zip(after, gains.tolist(), strict=True)),
        best(gains, utility, UPDATES) is not None,
        chosen,
        before,
        after[chosen],
    )

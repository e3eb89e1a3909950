"""The robot's head, which turns to where a behaviour wants it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from objstate.experiments.darmstadt.camera import Aim
from objstate.experiments.darmstadt.setting import NECK, Noise

ARRIVED = math.radians(0.5)  # rad


@dataclass(frozen=True)
class Head:
    """Angles, rad, as the joints have them, and the rates, rad/s, with which they change."""

    pan: float = 0.0
    tilt: float = math.radians(30.0)
    pan_rate: float = 0.0
    tilt_rate: float = 0.0

    def towards(self, pan: float, tilt: float, seconds: float) -> Head:
        """The head some time later; both axes run at their full speed up to the aim."""
        pan, tilt = clamped(pan, tilt)
        most = NECK.pan_speed * seconds, NECK.tilt_speed * seconds
        by_pan = float(np.clip(pan - self.pan, -most[0], most[0]))
        by_tilt = float(np.clip(tilt - self.tilt, -most[1], most[1]))
        return Head(self.pan + by_pan, self.tilt + by_tilt, by_pan / seconds, by_tilt / seconds)

    def at(self, pan: float, tilt: float) -> bool:
        """Whether it looks where it was to look."""
        pan, tilt = clamped(pan, tilt)
        return abs(pan - self.pan) <= ARRIVED and abs(tilt - self.tilt) <= ARRIVED

    def shaken(self, noise: Noise, rng: np.random.Generator) -> Aim:
        """Where the camera really looks, when the joints are read like this."""
        pan, tilt, roll = rng.standard_normal(3)
        return Aim(
            self.pan + noise.angular(self.pan_rate) * pan,
            self.tilt + noise.angular(self.tilt_rate) * tilt,
            noise.roll_std * roll,
        )


def clamped(pan: float, tilt: float) -> tuple[float, float]:
    """The nearest angles that the neck allows."""
    return (
        min(NECK.turn, max(-NECK.turn, pan)),
        min(NECK.lowest, max(NECK.highest, tilt)),
    )

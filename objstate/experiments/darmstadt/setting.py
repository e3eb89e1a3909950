"""The setting of the thesis: the field of RoboCup's KidSize league, what stands on it, and the robot.

Frame ``map``: origin at the middle of the field, x along it. Dimensions are those of table 2.1. The
thesis states neither the camera's height and opening angles, nor the neck's limits and speeds, nor the
deviations; here they are those of a robot of 0.6 m with a webcam and hobby servos.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from objstate.geometry import FloatArray
from objstate.grid import CountCells, Layout

LENGTH, WIDTH = 6.0, 4.0  # m
PENALTY_MARK = 1.2  # m from the middle of the field; there are crosses, and one in the middle
POLE_BESIDE = 0.4  # m, distance of the field's own poles to the touch line
POLE_RADIUS, POLE_HEIGHT = 0.05, 0.45  # m
BOX = (0.3, 0.2, 0.3)  # m
BALL_RADIUS = 0.065  # m
LAYOUT = Layout(0.05, 80, 120, np.array([-LENGTH / 2.0, -WIDTH / 2.0, 0.0]))
CELLS = CountCells(max_age_s=10.0)
REACH = 4.5  # m, at which evidence has fallen to nothing, eq. (6.9)
OUTLIERS_WITHIN = 0.1  # m, within which the scan line before has to show the obstacle, too
LANDMARKS = np.array(
    [
        [-PENALTY_MARK, 0.0],
        [0.0, 0.0],
        [PENALTY_MARK, 0.0],
        [0.0, WIDTH / 2.0 + POLE_BESIDE],
        [0.0, -WIDTH / 2.0 - POLE_BESIDE],
    ]
)  # (n, 2) m, what localization uses


@dataclass(frozen=True, eq=False)
class Scene:
    """What stands on the field."""

    poles: FloatArray = field(repr=False)  # (n, 2) m
    boxes: FloatArray = field(default_factory=lambda: np.empty((0, 2)), repr=False)  # (b, 2) m

    def distances(self, points: FloatArray) -> FloatArray:
        """(m,) m from points (m, 2) to the nearest outline; negative inside of it."""
        off = points[:, None] - self.poles
        nearest = (np.hypot(off[..., 0], off[..., 1]) - POLE_RADIUS).min(axis=1, initial=np.inf)
        beyond = np.abs(points[:, None] - self.boxes) - np.array(BOX[:2]) / 2.0
        outside = np.maximum(beyond, 0.0)
        boxes = np.hypot(outside[..., 0], outside[..., 1]) + np.minimum(beyond.max(axis=-1), 0.0)
        return np.asarray(np.minimum(nearest, boxes.min(axis=1, initial=np.inf)))


@dataclass(frozen=True)
class Noise:
    """Deviations of a robot's head: of a reading at rest, of its time, and of the body's sway."""

    angle_std: float = math.radians(0.25)  # rad, of pan and tilt
    delay_std: float = 0.008  # s, by which readings and pictures are apart
    roll_std: float = math.radians(2.0)  # rad

    def angular(self, rate: float) -> float:
        """rad, the deviation of an axis that turns with a rate, rad/s (section 6.1.6)."""
        return math.hypot(self.angle_std, rate * self.delay_std)


STANDING = Noise()
WALKING = Noise(angle_std=math.radians(0.6), roll_std=math.radians(4.0))


@dataclass(frozen=True)
class Neck:
    """How the head turns."""

    turn: float = math.radians(135.0)  # rad to either side
    highest: float = math.radians(12.0)  # rad below the horizon
    lowest: float = math.radians(75.0)  # rad
    pan_speed: float = math.radians(150.0)  # rad/s
    tilt_speed: float = math.radians(100.0)  # rad/s


NECK = Neck()

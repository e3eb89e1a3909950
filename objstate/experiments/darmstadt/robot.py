"""The robot: what it makes of each picture. Its pose is known to it, as the thesis assumes."""

from __future__ import annotations

import numpy as np

from objstate.experiments.darmstadt.camera import Aim, lines, shows, take
from objstate.experiments.darmstadt.head import Head
from objstate.experiments.darmstadt.sectors import Sectors
from objstate.experiments.darmstadt.setting import CELLS, LANDMARKS, LAYOUT, REACH, Noise, Scene
from objstate.geometry import FloatArray
from objstate.grid import Grid
from objstate.records import NANOSECONDS

FRAMES_A_SECOND = 30
FRAME_S = 1.0 / FRAMES_A_SECOND
BALL_S, POSE_S = 8.0, 10.0  # until nothing is known of a ball, or of the pose, that isn't seen
SEEN = 0.1  # of the pose's reliability, that one landmark in one picture gives back
BALL_STD = 0.03  # m
BALL_REACH = 4.0  # m, from where a ball is found in a picture


class Robot:
    """Grid, sector model, ball model and the reliability of localization; changes in place."""

    def __init__(self, scene: Scene, noise: Noise, rng: np.random.Generator) -> None:
        self.scene, self.noise, self.head = scene, noise, Head()
        self.grid, self.sectors = Grid(LAYOUT, CELLS), Sectors()
        self.ball: FloatArray | None = None  # (2,) m, where it is believed
        self.ball_validity, self.reliability = 0.0, 1.0
        self.frames = 0
        self._rng = rng

    @property
    def time(self) -> float:
        """Seconds since the first picture."""
        return self.frames * FRAME_S

    @property
    def stamp_ns(self) -> int:
        """The same as the grid counts it."""
        return self.frames * int(NANOSECONDS) // FRAMES_A_SECOND

    def step(
        self, pose: FloatArray, target: tuple[float, float], ball: FloatArray | None = None
    ) -> None:
        """Turn the head towards pan and tilt, rad, for one frame, and take a picture from a pose (3,)."""
        self.frames += 1
        self.head = self.head.towards(*target, FRAME_S)
        aim = self.head.shaken(self.noise, self._rng)
        seen = lines(take(self.scene, pose, aim), Aim(self.head.pan, self.head.tilt), REACH)
        pan_std = self.noise.angular(self.head.pan_rate)
        tilt_std = self.noise.angular(self.head.tilt_rate)
        self.grid.sweep(seen.percepts(pose, pan_std, tilt_std), self.stamp_ns, REACH)
        self.sectors.update(seen, self.head.pan, FRAME_S)
        self.ball_validity = max(0.0, self.ball_validity - FRAME_S / BALL_S)
        if ball is not None and shows(pose, aim, ball, self.scene, BALL_REACH):
            self.ball = ball + BALL_STD * self._rng.standard_normal(2)
            self.ball_validity = 1.0
        marks = sum(shows(pose, aim, mark, self.scene, REACH) for mark in LANDMARKS)
        self.reliability = min(1.0, max(0.0, self.reliability - FRAME_S / POSE_S) + SEEN * marks)

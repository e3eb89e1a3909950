"""Active gaze control as the thesis has it (section 6.3), with and without the entropy of views."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from objstate.experiments.darmstadt.behaviours import Target
from objstate.experiments.darmstadt.camera import OPTICS
from objstate.experiments.darmstadt.robot import Robot
from objstate.experiments.darmstadt.setting import LANDMARKS, LAYOUT, NECK, REACH
from objstate.gaze.field import Focus, FocusGazer, PanTilt
from objstate.geometry import FloatArray, compose
from objstate.grid import Drawing, entropy, gaussian
from objstate.grid.entropy import Method, Values

CAMERA = PanTilt(
    OPTICS.height,
    OPTICS.wide,
    OPTICS.high,
    turn=NECK.turn,
    reach=REACH,
    turn_cost=math.radians(120.0),
    reach_cost=REACH,
)
PARTICLES, APART = 10, 0.4  # m
BALL_STD, MARK_STD = 0.3, 0.2  # m, of the Gaussians that stand for their entropies
FADE_S, LOOKED_STD = 4.0, 0.5  # s and m, of where it has looked, with inhibition
PATIENCE_S = 1.0  # after which a gaze that wasn't reached is given up
AHEAD = np.array([0.6, 0.0, 0.0])  # m, the place before the robot that is always a candidate

Choice = Callable[[FocusGazer, Values, FloatArray, FloatArray, list[FloatArray]], Focus]


class ActiveGaze:
    """Looks where the entropy is; chooses anew when it has arrived."""

    def __init__(self, choose: Choice, *, inhibited: bool = False) -> None:
        self._gazer = FocusGazer(LAYOUT, CAMERA, PARTICLES, APART)
        self._choose, self._inhibited = choose, inhibited
        self._looked: list[tuple[float, FloatArray]] = []  # when, and at which places (2,)
        self._focus: Focus | None = None
        self._since = 0.0
        spread = np.eye(2) * MARK_STD**2
        self._marks = [gaussian(LAYOUT, mark, spread, 1.0, about=0.0) for mark in LANDMARKS]

    def target(self, robot: Robot, pose: FloatArray) -> Target:
        """As the protocol of behaviours has it."""
        last = self._focus
        late = robot.time - self._since > PATIENCE_S
        if last is None or late or robot.head.at(last.pan, last.tilt):
            at = pose[:2] if last is None else last.place
            seeds = [compose(pose, AHEAD)[:2]]
            if robot.ball is not None:
                seeds.insert(0, robot.ball)
            bits = self.bits(robot)
            if self._inhibited:
                self._inhibit(bits, robot.time)
            self._focus = last = self._choose(self._gazer, bits, pose, at, seeds)
            self._since = robot.time
            self._looked.append((robot.time, last.place))
        return last.pan, last.tilt

    def bits(self, robot: Robot, method: Method = "table") -> Values:
        """(rows, columns) of the grid, the ball and the landmarks, which add up."""
        bits = entropy(robot.grid.values(robot.stamp_ns), method)
        self.add_objects(bits, robot)
        return bits

    def add_objects(self, bits: Values, robot: Robot) -> None:
        """Add landmarks and ball to bits (rows, columns) by how unsure the pose and the ball are."""
        for mark in self._marks:
            _add(bits, mark, 1.0 - robot.reliability)
        if robot.ball is not None:
            spread = np.eye(2) * BALL_STD**2
            ball = gaussian(LAYOUT, robot.ball, spread, 1.0, about=0.0)
            _add(bits, ball, 1.0 - robot.ball_validity)

    def _inhibit(self, bits: Values, time: float) -> None:
        """Take bits off where it has looked, the less the longer ago: section 6.3.4's proposal."""
        self._looked = [(at, place) for at, place in self._looked if time - at < FADE_S]
        for at, place in self._looked:
            drawn = gaussian(LAYOUT, place, np.eye(2) * LOOKED_STD**2, 1.0, about=0.0)
            _add(bits, drawn, (time - at) / FADE_S - 1.0)
        np.maximum(bits, 0.0, out=bits)


def with_views(seed: int) -> ActiveGaze:
    """Particles, ranked by the entropy of the field of view."""
    return _by_particles(seed, views=True)


def with_inhibition(seed: int) -> ActiveGaze:
    """The same, with less entropy where it has just looked."""
    return _by_particles(seed, views=True, inhibited=True)


def without_views(seed: int) -> ActiveGaze:
    """Particles, ranked by single cells."""
    return _by_particles(seed, views=False)


def best_of_all(seed: int) -> ActiveGaze:
    """The best window of the panorama."""
    return ActiveGaze(lambda gazer, bits, pose, at, seeds: gazer.by_windows(bits, pose, at)[0])


def _by_particles(seed: int, *, views: bool, inhibited: bool = False) -> ActiveGaze:
    rng = np.random.default_rng([seed, 1])

    def choose(
        gazer: FocusGazer, bits: Values, pose: FloatArray, at: FloatArray, seeds: list[FloatArray]
    ) -> Focus:
        return gazer.by_particles(bits, pose, at, rng, seeds, views=views)[0]

    return ActiveGaze(choose, inhibited=inhibited)


def _add(bits: Values, drawing: Drawing, weight: float) -> None:
    bits.reshape(-1)[drawing.where] += np.float32(weight) * drawing.values

"""Where the head looks: fixed trajectories that the robots had before (sections 4.4 and 7.4)."""

from __future__ import annotations

import math
from typing import Protocol

from objstate.experiments.darmstadt.camera import OPTICS
from objstate.experiments.darmstadt.robot import Robot
from objstate.experiments.darmstadt.setting import NECK
from objstate.geometry import FloatArray, wrapped

Target = tuple[float, float]  # rad, pan to the left and tilt down

FAR, NEAR = math.radians(20.0), math.radians(50.0)  # rad, tilts of a sweep
CORNER = 0.7  # of half the opening angles, by which the ball lies beside the middle of the picture
CLOSE = 1.0  # m, up to which a ball is close
ASIDE = math.radians(60.0)  # rad, of a look to the side


class Behaviour(Protocol):
    """Says where to look."""

    def target(self, robot: Robot, pose: FloatArray) -> Target:
        """Pan and tilt to turn to from a pose (3,)."""


class Route:
    """Targets one after another, round and round; the next when one is reached."""

    def __init__(self) -> None:
        self._at = 0

    def follow(self, targets: list[Target], robot: Robot) -> Target:
        """The target that is due."""
        self._at %= len(targets)
        if robot.head.at(*targets[self._at]):
            self._at = (self._at + 1) % len(targets)
        return targets[self._at]


class Sweep:
    """The localization behaviour: along the horizon to one side, and near the feet back."""

    def __init__(self) -> None:
        self._route = Route()

    def target(self, robot: Robot, pose: FloatArray) -> Target:
        """As the protocol has it."""
        turn = NECK.turn
        return self._route.follow([(turn, FAR), (-turn, FAR), (-turn, NEAR), (turn, NEAR)], robot)


class BallTracking:
    """Figures 4.4 and 4.5: the ball in one corner of the picture after another, or looks aside from it.

    A ball that was never seen is searched by sweeping.
    """

    def __init__(self) -> None:
        self._route, self._search = Route(), Sweep()

    def target(self, robot: Robot, pose: FloatArray) -> Target:
        """As the protocol has it."""
        if robot.ball is None or robot.ball_validity <= 0.0:
            return self._search.target(robot, pose)
        pan, tilt, away = bearing_of(robot.ball, pose)
        if away <= CLOSE:
            up = tilt - OPTICS.high / 2.0
            aside = [(pan, tilt), (pan + ASIDE, up), (pan, tilt), (pan - ASIDE, up)]
            return self._route.follow(aside, robot)
        wide, high = CORNER * OPTICS.wide / 2.0, CORNER * OPTICS.high / 2.0
        corners = [
            (pan + i * wide, tilt + j * high) for i, j in ((1, -1), (-1, -1), (-1, 1), (1, 1))
        ]
        return self._route.follow(corners, robot)


class LookAtBall:
    """The behaviour of table 7.7: straight at the ball."""

    def __init__(self) -> None:
        self._search = Sweep()

    def target(self, robot: Robot, pose: FloatArray) -> Target:
        """As the protocol has it."""
        if robot.ball is None or robot.ball_validity <= 0.0:
            return self._search.target(robot, pose)
        return bearing_of(robot.ball, pose)[:2]


def bearing_of(place: FloatArray, pose: FloatArray) -> tuple[float, float, float]:
    """Pan and tilt, rad, from a pose (3,) to a place (2,) on the floor, and its distance, m."""
    off = place - pose[:2]
    away = math.hypot(*off)
    return (
        wrapped(math.atan2(off[1], off[0]) - pose[2]),
        math.atan2(OPTICS.height, away),
        away,
    )

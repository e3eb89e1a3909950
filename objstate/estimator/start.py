"""The robot's start, from the caller or the log."""

from __future__ import annotations

import math

import numpy as np

from objstate.errors import SettingsError
from objstate.estimator.admission import are_finite
from objstate.estimator.monitor import Monitor
from objstate.estimator.robot import Robot
from objstate.geometry import FloatArray
from objstate.records import GaussianRobotBelief, InitialPose, RobotBelief


class Start:
    """The robot's start: a pose that the caller gives, else the log's.

    Raises SettingsError for a pose that is none, where one is given for a robot that may be
    anywhere, and where it isn't said by True or False whether it may be.
    """

    def __init__(self, robot: Robot, pose: FloatArray | None, *, is_global: bool) -> None:
        if not isinstance(is_global, (bool, np.bool_)):
            raise SettingsError(f"global_start is {is_global!r}; give True or False.")
        self._robot = robot
        self._is_given = pose is not None or is_global
        self.warnings: list[str] = []
        if pose is not None:
            if is_global:
                raise SettingsError("--initial-pose and --global exclude each other; give one.")
            robot.start(checked_pose(pose))

    def take(
        self, record: InitialPose | GaussianRobotBelief | RobotBelief, monitor: Monitor
    ) -> None:
        """Take a pose belief from outside: as the start, or as the recorded belief."""
        robot, is_start = self._robot, isinstance(record, InitialPose)
        if is_start and self._is_given:
            return
        if robot.localizes and not is_start:
            if robot.belief is not None or monitor.is_anywhere:
                return
            self.warnings.append(
                "The log holds no /initialpose; localization started from its first recorded "
                "robot belief."
            )
        robot.take(record)
        monitor.restart(record.stamp_ns, is_start=is_start)


def check_seed(seed: object) -> None:
    """Raise SettingsError for what seeds no random numbers."""
    if not isinstance(seed, (int, np.integer)) or seed < 0:
        raise SettingsError(f"The seed {seed!r} is none; give a whole number, 0 or more.")


def checked_pose(pose: FloatArray) -> FloatArray:
    """The pose (3,) of a start; raises SettingsError for what is none."""
    values = np.asarray(pose)
    if not are_finite(values, (3,)):
        raise SettingsError(
            f"The initial pose {pose!r} is none; give x, y in metres and yaw in radians, as "
            "np.array([2.0, 0.0, 0.0])."
        )
    if abs(values[2]) > math.tau:
        raise SettingsError(
            f"The initial pose's yaw of {values[2]:g} rad is more than a turn; if it is in degrees, "
            f"give math.radians({values[2]:g}), or {values[2]:g}deg on the command line."
        )
    return values

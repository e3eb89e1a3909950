"""Laws of the Gaussian filter of the robot's pose."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from objstate.config import BeamModelSettings, BuildingErrorSettings
from objstate.geometry import FloatArray, compose, wrap
from objstate.localization import PoseBelief, PoseFilter
from objstate.localization.motion import Variances
from objstate.particles import Weights

METRES = st.floats(-2.0, 2.0)
TURNS = st.floats(-3.0, 3.0)
POSES = st.tuples(METRES, METRES, TURNS).map(np.array)


def filter_at(pose: FloatArray, std: FloatArray) -> PoseFilter:
    about = np.sqrt(3.0) * np.concatenate([np.eye(3), -np.eye(3)]) * std
    belief = PoseBelief(pose + about, Weights.uniform(6))
    return PoseFilter(belief, BuildingErrorSettings(), BeamModelSettings(), 30.0)


@given(POSES, st.lists(POSES, min_size=1, max_size=5))
def test_the_mean_goes_where_the_odometry_says_however_large_its_steps(
    start: FloatArray, steps: list[FloatArray]
) -> None:
    robot, pose = filter_at(start, np.full(3, 1e-6)), start
    for step in steps:
        robot.drive(step, Variances(0.0, 0.0), 0.1)
        pose = compose(pose, step)
    np.testing.assert_allclose(robot.mean[:2], pose[:2], atol=1e-9)
    np.testing.assert_allclose(wrap(robot.mean[2] - pose[2]), 0.0, atol=1e-9)


@given(POSES, POSES)
def test_a_step_carries_the_covariance_as_it_carries_samples(
    start: FloatArray, step: FloatArray
) -> None:
    std = np.array([1e-4, 2e-4, 3e-4])
    robot = filter_at(start, std)
    about = np.sqrt(3.0) * np.concatenate([np.eye(3), -np.eye(3)]) * std
    robot.drive(step, Variances(0.0, 0.0), 0.1)
    ends = compose(start + about, np.tile(step, (6, 1)))
    ends[:, 2] = start[2] + step[2] + wrap(ends[:, 2] - start[2] - step[2])
    off = ends - ends.mean(axis=0)
    np.testing.assert_allclose(robot.covariance, off.T @ off / 6.0, rtol=1e-2, atol=1e-12)

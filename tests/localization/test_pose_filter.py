"""Laws of the Gaussian filter of the robot's pose."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from objstate.config import BeamModelSettings, BuildingErrorSettings
from objstate.geometry import FloatArray, compose, wrap
from objstate.localization import PoseBelief, PoseFilter, WallErrors
from objstate.localization.motion import Variances
from objstate.localization.pose_update import agreement
from objstate.particles import Weights
from objstate.records import Rays, Scan
from objstate.sensing.surfaces import Surfaces
from objstate.sensing.sweeps import Scenery

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


@given(
    st.tuples(st.floats(-0.05, 0.05), st.floats(-0.05, 0.05)).map(np.array),
    st.floats(-0.05, 0.05),
    st.floats(0.0, 6.2),
)
def test_walls_are_expected_where_they_are_believed_to_stand(
    shift: FloatArray, offset: float, bearing: float
) -> None:
    half = 4.0
    corners = np.array([[-half, -half], [half, -half], [half, half], [-half, half]])
    sides = np.column_stack([corners, np.roll(corners, -1, axis=0)])
    surfaces = Surfaces(sides)
    count = len(surfaces.pieces)
    off = WallErrors.unknown(count, 0.01)._replace(shift=shift, offsets=np.full(count, offset))
    directions = np.array([[np.cos(bearing), np.sin(bearing)]])
    ranges, variances, numbers = off.meet(surfaces, np.zeros((1, 2)), directions, 20.0)
    moved = surfaces.pieces + np.tile(offset * surfaces.normals - shift, 2)
    exact, met = Surfaces(moved).meet(np.zeros((1, 2)), directions, 20.0)
    if met == numbers:  # else at a corner
        cosine = surfaces.cosines(numbers, directions)
        if abs(cosine) > 0.2:
            np.testing.assert_allclose(ranges, exact, atol=1e-9)
        across = 0.01**2 * (1.0 + 0.5**2)  # of its own, and of the shift, along the normal
        np.testing.assert_allclose(variances, across / cosine**2)


NO_NUMBERS = np.empty(0, dtype=np.int64)
NO_OBJECTS = Scenery(
    np.empty((0, 4)), NO_NUMBERS, NO_NUMBERS, np.empty((0, 4)), NO_NUMBERS, np.empty(0)
)
ROOM = np.array([[-4.0, -3.0], [4.0, -3.0], [4.0, 3.0], [-4.0, 3.0]])  # m
BEARINGS = np.radians(np.arange(360) - 180.0)
SWEEP, SIGMA, SLANT = 0.1, 0.005, 0.004  # s, m, and m for each m of range and unit of slope
PERIOD = 0.1  # s between scans


def read_in_the_room(
    poses: FloatArray, rng: np.random.Generator
) -> FloatArray:  # poses (n, 3), one for each beam
    direction = poses[:, 2] + BEARINGS
    dx, dy = np.cos(direction), np.sin(direction)
    of_x = (np.where(dx > 0.0, 4.0, -4.0) - poses[:, 0]) / dx
    of_y = (np.where(dy > 0.0, 3.0, -3.0) - poses[:, 1]) / dy
    ranges = np.minimum(of_x, of_y)
    cosine = np.where(of_x < of_y, np.abs(dx), np.abs(dy))
    slope = np.sqrt(1.0 / cosine**2 - 1.0)
    return np.asarray(ranges + rng.normal(0.0, np.hypot(SIGMA, SLANT * ranges * slope)))


def filter_that_turned_in_the_room(sweep: float) -> PoseFilter:
    """A robot that drives a circle, with a lidar whose log doesn't tell that it sweeps."""
    rng, walls = np.random.default_rng(5), Surfaces(np.hstack([ROOM, np.roll(ROOM, -1, axis=0)]))
    velocity = np.array([0.3, 0.0, 0.6])  # m/s, m/s, rad/s
    pose = np.array([0.2, -0.5, 0.3])
    robot = filter_at(pose, np.array([5e-3, 5e-3, 5e-3]))
    directions = np.column_stack([np.cos(BEARINGS), np.sin(BEARINGS), np.zeros(360)])
    rays, far = Rays(np.tile([0.0, 0.0, 0.3], (360, 1)), directions), np.full(360, np.inf)
    times = sweep * np.arange(360) / 359.0
    for number in range(60):
        robot.drive(PERIOD * velocity, Variances(1e-6, 1e-6), PERIOD)
        pose = compose(pose, PERIOD * velocity)
        poses = compose(np.tile(pose, (360, 1)), times[:, None] * velocity)
        ranges = read_in_the_room(poses, rng)
        scan = Scan(round(number * PERIOD * 1e9), "lidar", ranges, rays, 0.05, 20.0)
        robot.correct(scan, walls, far, far, NO_OBJECTS, NO_OBJECTS)
    return robot


def test_a_sweep_that_the_log_does_not_tell_is_learnt() -> None:
    for sweep in (0.0, SWEEP):
        mean, covariance = filter_that_turned_in_the_room(sweep).learnt.lasers["lidar"]
        std = np.sqrt(np.diag(covariance))
        assert std[5] < 0.004
        assert abs(mean[5] - sweep) < 3.0 * std[5]
        assert abs(mean[4] - 0.5 * sweep) < 3.0 * std[4]  # stamps are of the first beam


def test_noise_that_grows_with_the_incidence_is_learnt() -> None:
    noise = filter_that_turned_in_the_room(0.0).range_noise("lidar")
    assert abs(np.sqrt(noise.variance) - SIGMA) < 0.001
    assert abs(np.sqrt(noise.slant) - SLANT) < 0.001
    assert np.sqrt(noise.growth) < 0.0015


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_noise_is_averaged_over_the_beams_that_tell_it(seed: int) -> None:
    """A robot stands, and all but 13 of its beams may meet an object."""
    rng, walls = np.random.default_rng(seed), Surfaces(np.hstack([ROOM, np.roll(ROOM, -1, axis=0)]))
    pose, noise = np.array([0.1, 0.1, 0.005]), []
    robot = filter_at(pose, np.full(3, 5e-3))
    directions = np.column_stack([np.cos(BEARINGS), np.sin(BEARINGS), np.zeros(360)])
    rays, far = Rays(np.tile([0.0, 0.0, 0.3], (360, 1)), directions), np.full(360, np.inf)
    entered = np.where(np.abs(BEARINGS) < np.radians(6.0), np.inf, 0.5)
    for number in range(900):
        robot.drive(np.zeros(3), Variances(0.0, 0.0), PERIOD)
        ranges = read_in_the_room(np.tile(pose, (360, 1)), rng)
        scan = Scan(round(number * PERIOD * 1e9), "lidar", ranges, rays, 0.05, 20.0)
        robot.correct(scan, walls, far, entered, NO_OBJECTS, NO_OBJECTS)
        noise.append(robot.range_noise("lidar"))
    at_2_m = [np.sqrt(each.variance + 4.0 * each.growth) for each in noise[500::100]]
    np.testing.assert_allclose(at_2_m, SIGMA, atol=3e-4)


@given(st.integers(-3, 3), st.integers(0, 100))
def test_errors_that_repeat_are_noticed_though_the_number_of_beams_changes(
    more: int, seed: int
) -> None:
    before = np.random.default_rng(seed).standard_normal(200)
    now = np.resize(before, 200 + more)
    sums = np.zeros(4)
    agreement(now, before, sums)
    assert sums[0] > 0.95 * sums[1] > 0.0
    assert abs(sums[2]) < 0.5 * sums[3]


@pytest.mark.parametrize(("read", "least", "most"), [(4.99, 0.0, 0.135), (4.7, 0.14, 0.2)])
def test_a_beam_that_hardly_met_a_wall_tells_little(read: float, least: float, most: float) -> None:
    wall, std = np.array([[5.0, -1.0, 5.0, 1.0]]), 0.15
    robot = filter_at(np.zeros(3), np.array([std, 0.01, 0.001]))
    rays = Rays(np.array([[0.0, 0.0, 0.3]]), np.array([[1.0, 0.0, 0.0]]))
    scan = Scan(0, "laser", np.array([read]), rays, 0.05, 20.0)
    far, entered = np.array([np.inf]), np.array([2.0])  # from where on an object may stand
    robot.correct(scan, Surfaces(wall), far, entered, NO_OBJECTS, NO_OBJECTS)
    assert least < np.sqrt(robot.covariance[0, 0]) < most

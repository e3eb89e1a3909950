"""Sensor models: lasers, and cameras with their outlier rule (section 6.1.6)."""

from __future__ import annotations

import math

import numpy as np
import pytest

from objstate.errors import GridError
from objstate.geometry import compose
from objstate.grid import Camera, laser_percepts
from tests import rooms

CAMERA = Camera(height=0.6, pan_std=0.02, tilt_std=0.01, within=0.3)


def test_a_scan_ends_where_its_beams_do() -> None:
    rays = rooms.fan(3)
    scan = rooms.scan_of(np.array([2.0, np.nan, 9.0]), rays, range_max=8.0)
    pose = np.array([1.0, 2.0, math.pi / 2])
    seen = laser_percepts(scan, pose)
    assert seen.obstacle.tolist() == [True, False]
    assert seen.ends == pytest.approx(np.array([[3.0, 2.0], [-7.0, 2.0]]))


def test_ends_have_the_uncertainty_of_range_and_robot() -> None:
    rng = np.random.default_rng(5)
    scan = rooms.scan_of(np.full(5, 3.0), rooms.fan(5))
    pose = np.array([1.0, -2.0, 0.4])
    root = rng.normal(size=(3, 3)) * [[0.02], [0.03], [0.01]]
    covariance = root @ root.T
    seen = laser_percepts(scan, pose, covariance, range_std=0.03)
    drawn = pose + rng.standard_normal((40_000, 3)) @ root.T
    for beam in range(5):
        bearing = -np.pi / 2 + beam * np.pi / 4
        ranges = 3.0 + 0.03 * rng.standard_normal(len(drawn))
        points = np.column_stack(
            [ranges * np.cos(bearing), ranges * np.sin(bearing), np.zeros(len(drawn))]
        )
        sampled = np.cov(compose(drawn, points)[:, :2].T)
        assert seen.covariances[beam] == pytest.approx(sampled, rel=0.06, abs=2e-5)


def test_cameras_see_far_ends_less_surely_than_near_ones() -> None:
    away = np.array([[1.0, 0.0], [1.1, 0.0], [3.0, 0.0], [3.1, 0.0]])
    seen = CAMERA.percepts(np.zeros((4, 2)), away, np.ones(4, bool), np.zeros(3))
    assert len(seen) == 2
    radial, lateral = np.sqrt(seen.covariances[:, 0, 0]), np.sqrt(seen.covariances[:, 1, 1])
    assert lateral == pytest.approx(np.array([1.1, 3.1]) * math.tan(0.02))
    for found, distance in zip(radial, (1.1, 3.1), strict=True):
        tilt = math.atan2(0.6, distance)
        slope = 0.6 / math.sin(tilt) ** 2  # m per rad
        assert found == pytest.approx(slope * 0.01, rel=0.01)


def test_deviations_turn_with_the_bearing() -> None:
    ends = np.array([[0.0, 2.0], [0.0, 2.0]])
    ahead = CAMERA.percepts(np.zeros((2, 2)), ends, np.ones(2, bool), np.zeros(3))
    turned = CAMERA.percepts(
        np.zeros((2, 2)), ends[:, ::-1], np.ones(2, bool), np.array([0.0, 0.0, math.pi / 2])
    )
    assert ahead.covariances == pytest.approx(turned.covariances)
    assert ahead.ends == pytest.approx(turned.ends)


def test_an_obstacle_needs_one_close_by_before_it() -> None:
    ends = np.array([[2.0, 0.0], [2.0, 0.1], [2.9, 0.2], [4.0, 0.0], [2.0, 0.4], [2.1, 0.45]])
    obstacle = np.array([True, True, True, False, True, True])
    seen = CAMERA.percepts(np.zeros((6, 2)), ends, obstacle, np.zeros(3))
    assert seen.ends == pytest.approx(ends[[1, 3, 5]])
    assert seen.obstacle.tolist() == [True, False, True]


def test_percepts_that_cant_be_are_refused() -> None:
    scan = rooms.scan_of(np.full(3, 2.0), rooms.fan(3))
    with pytest.raises(GridError, match="finite pose"):
        laser_percepts(scan, np.array([0.0, np.nan, 0.0]))
    with pytest.raises(GridError, match="covariance"):
        laser_percepts(scan, np.zeros(3), np.eye(2))
    with pytest.raises(GridError, match="deviation of -1"):
        laser_percepts(scan, np.zeros(3), range_std=-1.0)
    with pytest.raises(GridError, match="height 0"):
        Camera(0.0, 0.01, 0.01)
    with pytest.raises(GridError, match="tilt_std"):
        Camera(1.0, 0.01, math.nan)
    with pytest.raises(GridError, match="finite places"):
        CAMERA.percepts(np.zeros((1, 2)), np.full((1, 2), np.inf), np.ones(1, bool), np.zeros(3))

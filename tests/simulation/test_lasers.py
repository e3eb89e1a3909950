"""Sensor faults are of the size that the scene says; moving robots cast moving beams."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from objstate.building import load_building
from objstate.building.model import Mesh
from objstate.geometry import transform_from_pose
from objstate.records import Rays
from objstate.sensing.embree import EmbreeCaster
from objstate.sensing.expected import cast_from
from objstate.simulation.crowd import Crowd
from objstate.simulation.lasers import Scanner, World, reading
from objstate.simulation.route import drive
from objstate.simulation.scene import Laser, ObjectRule, Route, Waypoint
from objstate.simulation.states import histories

PERFECT = {"sigma": 0.0, "quantization": 0.0}
NOBODY = Crowd([], Mesh.empty())


def read(distances: np.ndarray, **faults: float) -> np.ndarray:
    return reading(distances, Laser(**{**PERFECT, **faults}), np.random.default_rng(0))


def test_a_perfect_laser_reads_the_truth_within_its_limits() -> None:
    truth = np.array([0.01, 0.05, 4.0, 8.0, 8.1, np.inf])
    np.testing.assert_array_equal(read(truth), [-np.inf, 0.05, 4.0, 8.0, np.inf, np.inf])


def test_faults_have_the_size_that_is_set() -> None:
    truth = np.full(20_000, 4.0)
    noisy = read(truth, sigma=0.03)
    assert noisy.mean() == pytest.approx(4.0, abs=0.002)
    assert noisy.std() == pytest.approx(0.03, rel=0.05)
    false = read(truth, false_share=0.1)
    assert np.mean(false != 4.0) == pytest.approx(0.1, abs=0.01)
    assert false[false != 4.0].mean() == pytest.approx((0.05 + 8.0) / 2, abs=0.2)
    assert np.mean(np.isposinf(read(truth, no_return_share=0.2))) == pytest.approx(0.2, abs=0.01)
    steps = read(truth + 0.0123, quantization=0.01) / 0.01
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-9)


def test_beams_are_cast_from_where_the_robot_is_at_their_time(room: Path) -> None:
    building = load_building(room)
    rules = (ObjectRule(name="*"),)
    world = World(building, histories(building, rules, np.random.default_rng(0)), NOBODY)
    motion = drive(Route(waypoints=(Waypoint(x=-4, y=0), Waypoint(x=4, y=0)), speed=1.0))
    laser = Laser(beams=3, angle_min=-0.01, angle_max=0.01, rate=1.0, range_max=20.0,
                  time_increment=0.3)  # fmt: skip
    seen = Scanner(laser, np.eye(4) @ np.diag([1, 1, 1, 1.0])).sweep(4.0, motion, world)
    moments = 4.0 + 0.3 * np.arange(3)
    expected = (5.0 - motion.at(moments)[:, 0]) / np.cos([-0.01, 0.0, 0.01])
    np.testing.assert_allclose(seen, expected, atol=1e-5)
    assert seen[0] - seen[2] == pytest.approx(0.6, abs=1e-3)


@pytest.mark.parametrize("reach", [2.0, 8.0, 100.0])
def test_world_equals_one_combined_mesh_as_far_as_it_reaches(room: Path, reach: float) -> None:
    building = load_building(room)
    rng = np.random.default_rng(5)
    history = histories(building, (ObjectRule(name="*", initial="random"),), rng)
    world = World(building, history, NOBODY)
    parts = [
        item.object.mesh.moved(item.object.transforms(item.at(0.0)[None])[0])
        for item in history.values()
    ]
    combined = EmbreeCaster(Mesh.joined([building.walls, *parts]))
    for pose in rng.uniform([-4, -2, -3], [4, 2, 3], (20, 3)):
        bearings = np.linspace(-np.pi, np.pi, 400)
        ahead = np.column_stack([np.cos(bearings), np.sin(bearings), np.full(400, 0.05)])
        rays = Rays(np.tile([0.1, 0.0, 0.4], (400, 1)), ahead / np.linalg.norm(ahead[0]))
        expected = combined.distances(*cast_from(transform_from_pose(pose), rays))
        seen = world.distances(0.0, pose, rays, reach + 0.5)
        within = expected < reach
        np.testing.assert_allclose(seen[within], expected[within], atol=1e-4)

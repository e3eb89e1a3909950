"""Dead reckoning: exact without errors, and with errors independent of its rate."""

from __future__ import annotations

import numpy as np
import pytest

from objstate.geometry import between, compose
from objstate.simulation.odometry import dead_reckoning
from objstate.simulation.route import Motion, drive
from objstate.simulation.scene import OdometryNoise, PlanarState, Route, Waypoint

EXACT = {
    "translation_noise": 0.0,
    "rotation_noise": 0.0,
    "drift_noise": 0.0,
    "translation_scale": 0.0,
    "rotation_scale": 0.0,
}


def bend() -> Motion:
    points = tuple(Waypoint(x=x, y=y) for x, y in ((1, 1), (5, 1), (5, 5)))
    return drive(Route(waypoints=points, corner_radius=1.0))


def test_without_errors_it_is_the_true_motion() -> None:
    motion = bend()
    wheels = dead_reckoning(motion, OdometryNoise(**EXACT), np.random.default_rng(0))
    np.testing.assert_array_equal(wheels.poses[0], 0.0)
    np.testing.assert_allclose(
        compose(motion.at(0.0), wheels.poses), motion.at(wheels.times), atol=1e-9
    )
    assert wheels.times[-1] >= motion.duration
    assert wheels.velocities[:, 0].max() == pytest.approx(0.7, abs=0.01)


def test_systematic_errors_add_up() -> None:
    motion = drive(Route(waypoints=(Waypoint(x=0, y=0), Waypoint(x=10, y=0))))
    noise = OdometryNoise(**{**EXACT, "translation_scale": 0.02, "drift": 0.01})
    end = dead_reckoning(motion, noise, np.random.default_rng(0)).poses[-1]
    assert end[2] == pytest.approx(0.1, abs=1e-6)
    assert np.hypot(*end[:2]) == pytest.approx(10.2, abs=0.01)


@pytest.mark.parametrize("rate", [5.0, 40.0])
def test_random_errors_do_not_depend_on_the_rate(rate: float) -> None:
    motion = drive(Route(waypoints=(Waypoint(x=0, y=0), Waypoint(x=4, y=0))))
    noise = OdometryNoise(**{**EXACT, "translation_noise": 0.02, "drift_noise": 0.03, "rate": rate})
    ends = np.array(
        [dead_reckoning(motion, noise, np.random.default_rng(i)).poses[-1] for i in range(200)]
    )
    # standard deviations after 4 m are twice those after 1 m; 200 draws tell them to 5 %
    assert ends[:, 2].std() == pytest.approx(0.06, rel=0.2)
    ways = between(np.zeros(3), ends)[:, 0]
    assert np.abs(ways.mean() - 4.0) < 0.02


def test_wheels_dont_notice_kidnapping() -> None:
    taken = Waypoint(x=4, y=0, kidnapped_to=PlanarState(x=20, y=5, yaw=0.5))
    motion = drive(Route(waypoints=(Waypoint(x=0, y=0), taken, Waypoint(x=20, y=8))))
    wheels = dead_reckoning(motion, OdometryNoise(**EXACT), np.random.default_rng(0))
    steps = np.hypot(*np.diff(wheels.poses[:, :2], axis=0).T)
    assert steps.max() <= 0.7 / OdometryNoise().rate * 1.001
    driven = 4.0 + 3.0  # turned by 90 degrees less 0.5 rad between the two ways
    assert steps.sum() == pytest.approx(driven, abs=0.01)
    assert wheels.poses[-1, 2] == pytest.approx(np.pi / 2 - 0.5, abs=1e-6)

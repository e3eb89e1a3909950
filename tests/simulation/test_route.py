"""The true motion keeps to its route and its limits."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from objstate.errors import SettingsError
from objstate.geometry import wrap
from objstate.simulation.route import drive
from objstate.simulation.scene import PlanarState, Route, Waypoint

COORDINATE = st.integers(-8, 8)


@st.composite
def routes(draw: st.DrawFn) -> Route:
    points = draw(st.lists(st.tuples(COORDINATE, COORDINATE), min_size=2, max_size=5))
    points = [p for i, p in enumerate(points) if i == 0 or p != points[i - 1]]
    waypoints = [
        Waypoint(x=x, y=y, pause=draw(st.sampled_from([0.0, 0.0, 1.0]))) for x, y in points
    ]
    radius = draw(st.sampled_from([0.0, 0.4, 3.0]))
    return Route(waypoints=tuple(waypoints), corner_radius=radius, turn_rate=0.6)


@settings(max_examples=30)
@given(routes())
def test_motion_keeps_to_its_limits(route: Route) -> None:
    motion = drive(route)
    step = 0.2
    track = motion.at(np.arange(-2 * step, motion.duration + 3 * step, step))
    velocity = np.hypot(*np.diff(track[:, :2], axis=0).T) / step
    turn_rate = np.abs(wrap(np.diff(track[:, 2]))) / step
    assert velocity.max() <= route.speed * 1.001
    assert turn_rate.max() <= route.turn_rate * 1.001
    assert np.abs(np.diff(velocity)).max() / step <= route.acceleration * 1.1
    assert velocity[0] == velocity[-1] == 0.0


@settings(max_examples=30)
@given(routes())
def test_robot_looks_where_it_drives_and_passes_by_every_waypoint(route: Route) -> None:
    motion = drive(route)
    track = motion.at(np.linspace(0.0, motion.duration, 4000))
    first, last = route.waypoints[0], route.waypoints[-1]
    np.testing.assert_allclose(track[0, :2], [first.x, first.y], atol=1e-9)
    np.testing.assert_allclose(track[-1, :2], [last.x, last.y], atol=1e-9)
    steps = np.diff(track[:, :2], axis=0)
    moving = np.hypot(*steps.T) > 1e-4
    off = wrap(np.arctan2(steps[:, 1], steps[:, 0]) - track[:-1, 2])[moving]
    assert np.abs(off).max(initial=0.0) < 0.05
    if route.corner_radius == 0.0:
        for point in route.waypoints:
            nearest = np.hypot(*(track[:, :2] - [point.x, point.y]).T).min()
            assert nearest < 0.02


def test_a_sharp_corner_is_reached_whatever_the_radius() -> None:
    points = (Waypoint(x=0, y=0), Waypoint(x=20, y=0.2), Waypoint(x=0, y=-0.2))
    motion = drive(Route(waypoints=points, corner_radius=0.3))
    track = motion.at(np.linspace(0.0, motion.duration, 4000))
    assert np.hypot(*(track[:, :2] - [20.0, 0.2]).T).min() < 0.02


def test_way_and_time_of_a_straight_drive() -> None:
    # 0.5 m/s^2 up to 0.5 m/s takes 1 s and 0.25 m, so 4 m take 1 + 7 + 1 s; 2 s of pause before
    points = (Waypoint(x=0, y=0, pause=2.0), Waypoint(x=0, y=4))
    motion = drive(Route(waypoints=points, speed=0.5, acceleration=0.5))
    assert motion.duration == pytest.approx(11.0, abs=1e-3)
    np.testing.assert_allclose(motion.at(6.5), [0.0, 2.0, np.pi / 2], atol=1e-3)


def test_robot_turns_on_the_spot_from_its_first_heading() -> None:
    points = (Waypoint(x=0, y=0), Waypoint(x=1, y=0))
    motion = drive(Route(waypoints=points, start_yaw=np.pi / 2))
    np.testing.assert_allclose(motion.at(0.0), [0, 0, np.pi / 2])
    np.testing.assert_allclose(motion.at(motion.duration), [1, 0, 0], atol=1e-9)


def test_a_single_waypoint_is_a_place_to_stand() -> None:
    motion = drive(Route(waypoints=(Waypoint(x=1, y=2, pause=3),), start_yaw=1.0))
    assert motion.duration == 3.0
    np.testing.assert_array_equal(motion.at(np.array([0.0, 2.0])), [[1, 2, 1], [1, 2, 1]])


def test_a_kidnapped_robot_stands_elsewhere_at_once_and_drives_on_from_there() -> None:
    taken = Waypoint(x=4, y=0, kidnapped_to=PlanarState(x=20, y=5, yaw=1.0))
    motion = drive(Route(waypoints=(Waypoint(x=0, y=0), taken, Waypoint(x=24, y=5))))
    times = np.arange(0.0, motion.duration, 0.1)
    track = motion.at(times)
    moved = np.hypot(*np.diff(track[:, :2], axis=0).T)
    (jump,) = np.flatnonzero(moved > 1.0)
    np.testing.assert_allclose(track[jump, :2], [4.0, 0.0], atol=0.06)
    np.testing.assert_allclose(track[jump + 1, :2], [20.0, 5.0], atol=1e-6)
    np.testing.assert_allclose(motion.at(motion.duration), [24.0, 5.0, 0.0], atol=1e-6)


def test_no_route_drives_to_where_the_robot_was_put() -> None:
    taken = Waypoint(x=4, y=0, kidnapped_to=PlanarState(x=20, y=5))
    with pytest.raises(SettingsError, match="two waypoints in a row"):
        Route(waypoints=(Waypoint(x=0, y=0), taken, Waypoint(x=20, y=5)))

"""People and boxes are seen where they are."""

from __future__ import annotations

import numpy as np
import pytest

from objstate.building.model import Mesh
from objstate.simulation.crowd import BODY_RADIUS, HIPS, LEG_RADIUS, Crowd, boxes_mesh, walkers
from objstate.simulation.scene import Boxes, People, PlanarState

FAR = np.array([50.0, 50.0, 0.0])  # where the robot is out of everybody's way


def look(crowd: Crowd, origin: list[float], time: float = 0.0) -> float:
    ahead = np.array([[1.0, 0.0, 0.0]])
    return float(crowd.distances(time, FAR, np.array([origin]), ahead)[0])


def crowd_of(*people: People, duration: float = 60.0) -> Crowd:
    return Crowd(walkers(people, duration, np.random.default_rng(0)), Mesh.empty())


def test_a_person_walks_there_and_back_again() -> None:
    person = People(route=((2.0, 0.0), (8.0, 0.0)), speed=1.0, start=5.0, shape="body")
    crowd = crowd_of(person)
    for time, x in ((0.0, 2.0), (5.0, 2.0), (8.0, 5.0), (11.0, 8.0), (14.0, 5.0), (17.0, 2.0)):
        assert look(crowd, [0.0, 0.0, 0.3], time) == pytest.approx(x - BODY_RADIUS, abs=0.01)


def test_legs_are_apart_below_and_a_body_above() -> None:
    crowd = crowd_of(People(route=((3.0, 0.0),), shape="legs"))
    assert look(crowd, [0.0, 0.0, 0.3]) == np.inf
    assert look(crowd, [0.0, HIPS, 0.3]) == pytest.approx(3.0 - LEG_RADIUS, abs=0.01)
    assert look(crowd, [0.0, 0.0, 1.2]) == pytest.approx(3.0 - BODY_RADIUS, abs=0.01)
    assert look(crowd, [0.0, 0.0, 1.9]) == np.inf


def test_people_step_aside_for_the_robot() -> None:
    (walker,) = walkers(
        (People(route=((0.0, 0.1), (6.0, 0.1)), speed=1.0),), 60.0, np.random.default_rng(0)
    )
    robot = np.array([3.0, 0.0, 0.0])
    places = np.array([walker.place(time, robot) for time in np.arange(0.0, 6.0, 0.02)])
    gaps = np.hypot(*(places[:, :2] - robot[:2]).T)
    assert gaps.min() >= 0.5 - 1e-9
    np.testing.assert_allclose(places[-1, :2], [5.98, 0.1])


def test_random_walkers_stay_in_their_region_all_the_time() -> None:
    region = (1.0, -2.0, 4.0, 2.0)
    people = walkers((People(count=5, region=region),), 100.0, np.random.default_rng(1))
    assert len(people) == 5
    times = np.linspace(0.0, 100.0, 300)
    for walker in people:
        track = walker.motion.at(times)
        assert (track[:, :2] >= [1.0, -2.0]).all()
        assert (track[:, :2] <= [4.0, 2.0]).all()
        assert np.hypot(*np.diff(track[-2:, :2], axis=0)[0]) > 0.1  # walking to the end


def test_boxes_stand_on_the_floor_where_they_are_put() -> None:
    boxes = (
        Boxes(size=(0.4, 1.0, 0.8), pose=PlanarState(x=2.0, y=0.0, yaw=np.pi / 2)),
        Boxes(count=3, region=(5.0, 5.0, 6.0, 6.0)),
    )
    mesh = boxes_mesh(boxes, np.random.default_rng(0))
    assert len(mesh.faces) == 4 * 12
    assert mesh.vertices[:, 2].min() == 0.0
    crowd = Crowd([], mesh)
    assert look(crowd, [0.0, 0.0, 0.3]) == pytest.approx(1.5, abs=1e-5)
    assert look(crowd, [0.0, 0.0, 0.9]) == np.inf

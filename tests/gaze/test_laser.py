"""What a simulated look promises is what the filters then learn."""

import numpy as np
import pytest

from objstate.building.model import Building
from objstate.config import BuildingErrorSettings
from objstate.estimator import Estimator
from objstate.gaze.entropy import belief_entropy
from objstate.gaze.floor import Floor
from objstate.gaze.gains import gain_of
from objstate.gaze.laser import LaserLooks, LookSettings
from objstate.gaze.sensors import Sensor
from objstate.gaze.viewpoints import ViewpointSettings, middle_of, viewpoints
from objstate.geometry import FloatArray
from objstate.objects import ObjectBelief
from objstate.records import RobotBelief
from objstate.sensing import ExpectedRanges
from objstate.sensing.embree import EmbreeCaster
from tests.gaze.places import chest, prior, surely, two_rooms
from tests.rooms import scan_of

SCANS = 5
LASER = Sensor("laser", sigma=0.02)
AT_DOOR = np.array([1.5, 0.0, np.pi])


def gain(
    rooms: Building, belief: ObjectBelief, pose: FloatArray, others: dict[str, FloatArray]
) -> float | None:
    exactly = LookSettings(robot_std=BuildingErrorSettings().wall_std_m, robot_yaw_std=0.0)
    told = LaserLooks(rooms, LASER, looks=exactly).look(belief, pose, others, SCANS)
    return None if told is None else gain_of(belief)(told)


def learnt(rooms: Building, name: str, state: FloatArray, pose: FloatArray, seed: int) -> float:
    """The entropy that an estimator really loses by scans of an object's true state."""
    estimator, rng = Estimator(rooms, seed=seed, belief="recorded"), np.random.default_rng(seed)
    estimator.feed(RobotBelief(0, pose[None], np.ones(1)))
    before, rays = belief_entropy(estimator.objects[name]), LASER.rays()
    states = {other: item.home for other, item in rooms.objects.items()} | {name: state}
    exact = ExpectedRanges(rooms).scene(states, pose[None], rays)[0]
    for k in range(SCANS):
        ranges = exact + LASER.sigma * rng.standard_normal(len(exact))
        estimator.feed(scan_of(ranges, rays, stamp_ns=k * 10**8))
    return before - belief_entropy(estimator.objects[name])


def test_the_promised_gain_of_a_door_is_kept() -> None:
    rooms = two_rooms()
    belief = prior(rooms["door"])
    promised = gain(rooms, belief, AT_DOOR, {})
    angles = belief.states[np.searchsorted(np.cumsum(belief.weights.values), np.arange(20) / 20), 0]
    kept = np.mean(
        [learnt(rooms, "door", np.array([each]), AT_DOOR, k) for k, each in enumerate(angles)]
    )
    assert promised == pytest.approx(kept, rel=0.2)


def test_the_promised_gain_of_furniture_is_kept() -> None:
    rooms = two_rooms(chest("chest", 3.0, 0.5, 0.4))
    belief = prior(rooms["chest"])
    pose, rng = np.array([1.5, 0.0, 0.0]), np.random.default_rng(0)
    promised = gain(rooms, belief, pose, {})
    states = belief.states[rng.choice(len(belief.states), 12)]
    kept = np.mean([learnt(rooms, "chest", each, pose, k) for k, each in enumerate(states)])
    assert promised == pytest.approx(kept, rel=0.15)


def test_walls_hide_what_is_behind_them() -> None:
    rooms = two_rooms(chest("chest", -3.0, 1.4), gap=0.2)
    assert gain(rooms, prior(rooms["chest"]), np.array([2.0, -1.5, 2.5]), {}) is None


def test_another_object_in_front_hides_much() -> None:
    rooms = two_rooms(chest("chest", 0.8, 0.0, np.pi / 2))
    belief = prior(rooms["door"])
    free, hidden = (gain(rooms, belief, AT_DOOR, others) or 0.0 for others in (
        {}, {"chest": np.array([0.8, 0.0, np.pi / 2])}))  # fmt: skip
    assert hidden < 0.5 * free


def test_who_knows_already_gains_little() -> None:
    rooms = two_rooms()
    known = surely(prior(rooms["door"]), 0.8)
    assert gain(rooms, known, AT_DOOR, {}) == pytest.approx(0.0, abs=1e-6)


def test_more_scans_tell_more_and_never_more_than_there_is() -> None:
    rooms = two_rooms()
    belief = prior(rooms["door"])
    looks = LaserLooks(rooms, LASER)
    told = [looks.look(belief, AT_DOOR, {}, scans) for scans in (0.0, 1.0, 3.0, 10.0)]
    gains = [gain_of(belief)(each) for each in told if each is not None]
    assert len(gains) == len(told)
    assert gains[0] == pytest.approx(0.0, abs=1e-9)
    assert gains == sorted(gains)
    assert gains[-1] <= np.log(len(belief.states))


def test_viewpoints_see_the_door_from_both_sides_and_face_it() -> None:
    rooms = two_rooms()
    floor, belief, s = Floor.of(rooms), prior(rooms["door"]), ViewpointSettings()
    walls = EmbreeCaster(rooms.walls)
    poses, cells = viewpoints(
        belief,
        floor,
        walls,
        Sensor("laser"),
        s,
        int(floor.pieces[floor.nearest(np.array([2.0, 0.0]))]),
    )
    off = middle_of(belief) - poses[:, :2]
    distance = np.hypot(off[:, 0], off[:, 1])
    assert len(poses) == s.places
    assert ((distance >= s.nearest) & (distance <= s.farthest)).all()
    assert np.allclose(np.arctan2(off[:, 1], off[:, 0]), poses[:, 2])
    assert floor.places[cells] == pytest.approx(poses[:, :2])
    assert {True, False} == set((poses[:, 0] > 0).tolist())


def test_what_stands_outside_has_no_viewpoint() -> None:
    rooms = two_rooms(chest("chest", 30.0, 0.0))
    floor = Floor.of(rooms)
    found, _ = viewpoints(
        prior(rooms["chest"]),
        floor,
        EmbreeCaster(rooms.walls),
        Sensor("laser"),
        ViewpointSettings(),
        1,
    )
    assert len(found) == 0


def test_readings_tell_as_much_more_as_an_estimator_learns_to_narrow_beliefs() -> None:
    rooms = two_rooms(chest("chest", 3.0, 0.5, 0.4))
    belief, pose = prior(rooms["chest"]), np.array([1.5, 0.0, 0.0])

    def told(factor: float) -> FloatArray:
        looks = LookSettings(robot_std=0.0, robot_yaw_std=0.0, variance_factor=factor)
        information = LaserLooks(rooms, LASER, looks=looks).look(belief, pose, {}, SCANS)
        assert information is not None
        return information

    np.testing.assert_allclose(told(0.2), 5.0 * told(1.0))

"""What several looks tell together."""

import numpy as np
import pytest

from objstate.building.model import Building
from objstate.config import Settings
from objstate.gaze.gains import gain_of
from objstate.gaze.laser import LaserLooks, LookSettings
from objstate.gaze.prospects import LookLibrary, Prospects
from objstate.gaze.sensors import Sensor
from objstate.geometry import FloatArray
from objstate.lazy import altered
from objstate.objects import ObjectBelief
from tests.gaze.places import chest, priors, surely, two_rooms

LASER = Sensor("laser")
ROOMS = two_rooms(chest("near", 2.5, 1.2), chest("far", -3.0, 1.2))
NEARBY = [np.array([1.5, 0.0, np.pi]), np.array([1.2, 0.8, -2.5])]  # see the door


def told(belief: ObjectBelief, pose: FloatArray, scans: float = 1.0) -> FloatArray:
    found = LaserLooks(ROOMS, LASER).look(belief, pose, {}, scans)
    assert found is not None
    return found


def seen_chest() -> tuple[ObjectBelief, list[FloatArray]]:
    belief = priors(ROOMS)["near"]
    return belief, [np.array([1.0, 0.0, 0.6]), np.array([2.5, -0.8, 1.6])]


@pytest.mark.parametrize("name", ["door", "near"])
def test_nothing_told_is_nothing_gained(name: str) -> None:
    belief = priors(ROOMS)[name]
    pose = NEARBY[0] if name == "door" else seen_chest()[1][0]
    assert gain_of(belief)(0.0 * told(belief, pose)) == pytest.approx(0.0, abs=1e-9)


def test_two_looks_tell_more_than_either_and_at_most_what_both_do() -> None:
    door, (near, places) = priors(ROOMS)["door"], seen_chest()
    for belief, poses in ((door, NEARBY), (near, places)):
        gain = gain_of(belief)
        one, other = (told(belief, pose) for pose in poses)
        assert max(gain(one), gain(other)) < gain(one + other) < gain(one) + gain(other)


def test_scans_from_one_place_share_the_robots_error_and_looks_from_several_dont() -> None:
    belief, (pose, _) = seen_chest()
    lost = LookSettings(robot_std=0.2, robot_yaw_std=0.1)
    looks = LaserLooks(ROOMS, LASER, looks=lost)
    one, many = (looks.look(belief, pose, {}, scans) for scans in (1.0, 100.0))
    assert one is not None
    assert many is not None
    gain = gain_of(belief)
    assert gain(many) < gain(one) + 0.1
    assert gain(2.0 * one) > gain(many) + 0.3


def test_a_gain_is_never_more_than_what_is_not_known() -> None:
    belief = priors(ROOMS)["door"]
    assert gain_of(belief)(1e6 * told(belief, NEARBY[0])) <= np.log(len(belief.states)) + 1e-9
    known = surely(belief, 0.4)
    assert gain_of(known)(told(known, NEARBY[0])) == pytest.approx(0.0, abs=1e-6)


def prospects(rooms: Building) -> tuple[LookLibrary, Prospects]:
    looks = LaserLooks(rooms, LASER)
    library = LookLibrary(rooms, {"laser": looks}, Settings().object_updates.max_distance)
    return library, Prospects(library, priors(rooms))


def test_what_a_look_shows_within_reach_counts_as_near() -> None:
    _, given = prospects(ROOMS)
    rng, shown = np.random.default_rng(0), 0
    poses = np.column_stack(
        [rng.uniform(*span, 60) for span in ((-3.5, 3.5), (-1.5, 1.5), (-3, 3))]
    )
    near = given.near("laser", poses)
    assert not near.all()
    for pose, row in zip(poses, near, strict=True):
        for k, name in enumerate(given.names):
            belief = given.beliefs[name]
            if np.hypot(*(belief.item.origin[:2, 3] - pose[:2])) < 3.5:
                sees = LaserLooks(ROOMS, LASER).look(belief, pose, {}, 1.0) is not None
                shown += sees
                assert row[k] or not sees
    assert shown > 20


def test_walls_hide_what_counts_as_near_through_them() -> None:
    _, given = prospects(two_rooms(chest("chest", -1.5, 1.4), gap=0.2))
    pose, chest_ = np.array([[1.5, 1.4, np.pi]]), given.names.index("chest")
    assert not given.near("laser", pose)[0, chest_]
    assert given.near("laser", pose, through_walls=True)[0, chest_]


def test_a_look_is_simulated_once() -> None:
    library, given = prospects(ROOMS)
    belief, pose = given.beliefs["door"], NEARBY[0]
    first, again = (library.look("laser", belief, pose, {}, 1.0) for _ in range(2))
    assert first is again


def test_a_door_whose_leaf_no_beam_meets_is_no_aim_of_looks() -> None:
    library, given = prospects(ROOMS)
    evidence = told(given.beliefs["door"], NEARBY[0])
    unmet = altered(given.beliefs["door"], presence=0.1)
    doubted = Prospects(library, {**given.beliefs, "door": unmet})
    assert given.gain("door", evidence) > 0.1
    assert doubted.gain("door", evidence) == pytest.approx(0.1 * given.gain("door", evidence))

"""What a scan may see: nothing that it does see is left out, and what walls hide is."""

from __future__ import annotations

import numpy as np

from objstate.building.model import Mesh
from objstate.config import BeamModelSettings
from objstate.estimator.sight import Sight
from objstate.estimator.surroundings import Surroundings
from objstate.geometry import BoolArray, FloatArray
from objstate.localization import PoseBelief
from objstate.particles import Weights
from objstate.records import Scan
from objstate.sensing import BeamModel, Sensing
from tests.rooms import building, door, enclosure, fan, wall

RAYS = fan(181, 2 * np.pi)
PLACE = building(
    Mesh.joined([enclosure(12.0, 10.0), wall((1.0, -5.0), (1.0, 5.0))]),
    door("here", -2.0, 2.0, 0.3),
    door("behind", 3.0, 2.0, 0.3),
)


def sight(pose: FloatArray, ranges: FloatArray | None = None) -> Sight:
    measured = np.full(len(RAYS), 2.0) if ranges is None else ranges
    scan = Scan(0, "laser", measured, RAYS, 0.02, 20.0)
    sensing = Sensing(PLACE, BeamModel(BeamModelSettings()))
    robot = PoseBelief(pose[None], Weights.uniform(1))
    return Sight(scan, robot, sensing.view(scan), Surroundings(PLACE))


def every(count: int) -> BoolArray:
    return np.ones(count, dtype=bool)


def test_an_object_behind_a_wall_is_in_range_but_not_seen() -> None:
    found = sight(np.array([-2.0, -1.0, 0.4]))
    assert found.names == ["here", "behind"]
    assert found.seen_by(every(len(RAYS))) == ["here"]


def test_only_beams_towards_an_object_see_it() -> None:
    found = sight(np.array([-2.0, -1.0, 0.0]))
    here, behind = np.isfinite(found.entries)
    assert found.seen_by(~here & ~behind) == []
    assert found.seen_by(here) == ["here"]


def test_near_objects_are_pointed_at_by_the_beams_that_enter_their_circles() -> None:
    found = sight(np.array([-2.0, -1.0, 0.0]))
    here, behind = np.isfinite(found.entries)
    for distance, names in ((0.1, []), (2.5, ["here"]), (10.0, ["here", "behind"])):
        for beams in (every(len(RAYS)), ~here):
            near = found.near(distance, beams)
            entered = {"here": here & beams, "behind": behind & beams}
            assert near.names == names
            assert near.pointed_at == [name for name in names if entered[name].any()]
            some = [entered[name] for name in names]
            np.testing.assert_array_equal(near.beams, np.any([~every(len(RAYS)), *some], axis=0))


def test_beams_that_say_nothing_meet_no_wall_and_touch_nothing() -> None:
    ranges = np.full(len(RAYS), 2.0)
    ranges[::2] = np.nan
    found = sight(np.array([-2.0, -1.0, 0.0]), ranges)
    assert np.isnan(found.walls[::2]).all()
    assert np.isfinite(found.walls[1::2]).all()
    assert not found.near(10.0, found.valid).beams[::2].any()


def test_a_beam_that_ends_behind_a_circle_has_passed_all_of_it() -> None:
    rng = np.random.default_rng(3)
    for _ in range(20):
        pose = np.array([*rng.uniform(-4.0, 0.5, 2), rng.uniform(-np.pi, np.pi)])
        ranges = rng.uniform(0.1, 8.0, len(RAYS))
        found = sight(pose, ranges)
        beyond = ranges[:, None] + np.linspace(0.0, 10.0, 1001)  # m along the beams
        bearing = pose[2] + np.arctan2(*RAYS.directions[:, 1::-1].T)
        ahead = np.stack([np.cos(bearing), np.sin(bearing)], axis=-1)[:, None]
        origins = found.scan.rays.origins[:, None, :2]
        assert not origins.any()  # beams leave from the robot
        places = pose[:2] + beyond[..., None] * ahead
        circles = Surroundings(PLACE).all_circles
        off = np.hypot(*np.moveaxis(places - circles[:, None, None, :2], -1, 0))
        enters = (off < circles[:, None, None, 2] - 0.01).any(axis=2)
        passes = (off > circles[:, None, None, 2] + 0.01).all(axis=2)
        assert not (found.ends_behind & enters).any()
        assert found.ends_behind[passes & np.isfinite(found.entries)].all()

"""What a simulated look promises is what the filters then learn."""

from dataclasses import replace

import numpy as np
import pytest

from objstate.building.model import Building
from objstate.config import Settings
from objstate.gaze.entropy import belief_entropy
from objstate.gaze.floor import Floor
from objstate.gaze.laser import LaserLooks, LookSettings
from objstate.gaze.sensors import Sensor
from objstate.gaze.viewpoints import ViewpointSettings, middle_of, viewpoints
from objstate.geometry import FloatArray
from objstate.objects import ObjectBelief, ScanEvidence, filter_for
from objstate.particles import Weights
from objstate.sensing import BeamModel, ExpectedRanges, Sensing
from objstate.sensing.embree import EmbreeCaster
from tests.gaze.places import chest, prior, surely, two_rooms
from tests.rooms import scan_of

SCANS = 5
LASER = Sensor("laser", sigma=0.02)
AT_DOOR = np.array([1.5, 0.0, np.pi])


def gain(
    rooms: Building, belief: ObjectBelief, pose: FloatArray, others: dict[str, FloatArray]
) -> float | None:
    look = LaserLooks(rooms, LASER, looks=LookSettings(robot_std=0.0)).look(belief, pose, others)
    return None if look is None else look.gain(belief, SCANS)


def learnt(
    rooms: Building, belief: ObjectBelief, state: FloatArray, pose: FloatArray, seed: int
) -> float:
    """The entropy that the object's filter really loses by scans of its true state."""
    name, settings, rng = belief.item.name, Settings(), np.random.default_rng(seed)
    rays = LASER.rays()
    every_other = rays.take(np.arange(0, len(rays), 2))
    before, expected = belief_entropy(belief), ExpectedRanges(rooms)
    sensing = Sensing(rooms, BeamModel(settings.beam_model))
    for _ in range(SCANS):
        ranges = expected.scene({name: state}, pose[None], every_other)[0]
        ranges = ranges + LASER.sigma * rng.standard_normal(len(ranges))
        view = sensing.view(scan_of(ranges, every_other))
        evidence = ScanEvidence(
            name,
            view,
            pose[None],
            Weights.uniform(1),
            view.walls(pose[None]),
            settings.object_updates.tempering,
        )
        belief = filter_for(belief.item, settings).update(belief, evidence, rng)
    return before - belief_entropy(belief)


def test_the_promised_gain_of_a_door_is_kept() -> None:
    rooms = two_rooms()
    belief = prior(rooms["door"])
    promised = gain(rooms, belief, AT_DOOR, {})
    angles = np.linspace(0.05, 1.5, 12)
    kept = np.mean(
        [learnt(rooms, belief, np.array([each]), AT_DOOR, k) for k, each in enumerate(angles)]
    )
    assert promised == pytest.approx(kept, rel=0.15)


def test_the_promised_gain_of_furniture_is_kept() -> None:
    rooms = two_rooms(chest("chest", 3.0, 0.5, 0.4))
    belief = prior(rooms["chest"])
    pose, rng = np.array([1.5, 0.0, 0.0]), np.random.default_rng(0)
    promised = gain(rooms, belief, pose, {})
    states = belief.states[rng.choice(len(belief.states), 12)]
    kept = np.mean([learnt(rooms, belief, each, pose, k) for k, each in enumerate(states)])
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
    look = LaserLooks(rooms, LASER).look(belief, AT_DOOR, {})
    assert look is not None
    gains = [look.gain(belief, scans) for scans in (0.0, 1.0, 3.0, 10.0)]
    assert gains[0] == pytest.approx(0.0, abs=1e-9)
    assert gains == sorted(gains)
    assert gains[-1] <= np.log(len(belief.states))


def test_viewpoints_see_the_door_from_both_sides_and_face_it() -> None:
    rooms = two_rooms()
    floor, belief, s = Floor.of(rooms), prior(rooms["door"]), ViewpointSettings()
    walls = EmbreeCaster(rooms.walls)
    poses, cells = viewpoints(
        belief, floor, walls, 0.3, s, int(floor.pieces[floor.nearest(np.array([2.0, 0.0]))])
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
        replace(prior(rooms["chest"])),
        floor,
        EmbreeCaster(rooms.walls),
        0.3,
        ViewpointSettings(),
        1,
    )
    assert len(found) == 0

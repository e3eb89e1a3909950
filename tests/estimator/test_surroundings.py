"""No beam that could touch an object is left out, and few others are let in."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from objstate.building.model import Kind, Mesh, MovableObject
from objstate.building.shapes import Box
from objstate.config import BeamModelSettings
from objstate.estimator.sight import Sight
from objstate.estimator.surroundings import Surroundings
from objstate.geometry import BoolArray, FloatArray
from objstate.localization import PoseBelief
from objstate.particles import Weights
from objstate.records import Scan
from objstate.sensing import BeamModel, ExpectedRanges, Sensing
from tests.rooms import building, door, enclosure, fan, placed, sliding_door, table

FLAP = MovableObject(
    "flap",
    Kind.HINGED,
    placed(3.0, -1.0, 0.4),
    np.array([1.0, 0.0, 0.0]),
    0.0,
    2.0,
    Box((0.8, 0.6, 0.03)).mesh().moved(placed(0.0, 0.3, 0.0)),
)
ROOM = building(
    Mesh.joined([enclosure(12.0, 10.0)]),
    door("door", -2.0, 2.0, 0.3),
    sliding_door("slide", 0.0, -3.0, 0.2),
    table("table", 2.0, 2.0, 0.4),
    FLAP,
)
EXPECTED = ExpectedRanges(ROOM)
SENSING = Sensing(ROOM, BeamModel(BeamModelSettings()))
RAYS = fan(241, 2 * np.pi)


def exactly(pose: FloatArray) -> PoseBelief:
    return PoseBelief(pose[None], Weights.uniform(1))


def towards(robot: PoseBelief) -> dict[str, BoolArray]:
    """Which beams may touch each object of the room, all of which are in range."""
    scan = Scan(0, "laser", np.ones(len(RAYS)), RAYS, 0.02, 50.0)
    sight = Sight(scan, robot, SENSING.view(scan), Surroundings(ROOM))
    return dict(zip(sight.names, np.isfinite(sight.entries), strict=True))


@settings(max_examples=40)
@given(
    st.tuples(st.floats(-5, 5), st.floats(-4, 4), st.floats(-3, 3)).map(np.array),
    st.floats(0.0, 1.0),
)
def test_every_beam_that_touches_an_object_in_some_state_is_towards_it(
    pose: FloatArray, share: float
) -> None:
    masks = towards(exactly(pose))
    assert list(masks) == list(ROOM.objects)
    for name, mask in masks.items():
        item = ROOM[name]
        between = np.array([item.lower + share * (item.upper - item.lower)])
        state = item.home if item.kind is Kind.PLANAR else between
        touched = np.isfinite(EXPECTED.object(name, state[None], pose[None], RAYS)[0, 0])
        assert not (touched & ~mask).any()


def test_few_beams_that_never_touch_an_object_are_towards_it() -> None:
    """A door's height is no part of its reach over the floor."""
    pose = np.array([-2.0, -2.0, 0.0])
    mask = towards(exactly(pose))["door"]
    circle = 2 * np.arcsin(0.9 / 4.0)  # a leaf of 0.9 m seen from 4 m
    assert mask.sum() * 2 * np.pi / 240 == pytest.approx(circle, abs=0.06)


@pytest.mark.parametrize(("distance", "near"), [(3.0, False), (3.2, True)])
def test_distance_is_measured_over_the_floor_to_where_an_object_may_be(
    distance: float, near: bool
) -> None:
    """The leaf swings about (-2, 2) with 0.9 m; the robot stands 4 m from the hinge."""
    found, _ = Surroundings(ROOM).within(np.array([-2.0, -2.0, 1.0]), distance)
    assert ("door" in found) is near


def test_an_uncertain_robot_takes_more_beams() -> None:
    pose = np.array([-2.0, -2.0, 0.0])
    unsure = PoseBelief.gaussian(pose, np.diag([0.04, 0.04, 0.01]), 500, np.random.default_rng(0))
    sure, more = (towards(robot)["door"] for robot in (exactly(pose), unsure))
    assert more.sum() > sure.sum()
    assert not (sure & ~more).any()

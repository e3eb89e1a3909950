"""The closed bearing of a door by the walls beside it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from objstate.building.model import Building, Mesh, MovableObject
from objstate.objects.doorframe import bearings_by_walls
from tests.rooms import block, building, door

STD_M = 0.005  # of walls
ASIDE = 0.08  # m from the middle of the wall to the leaf's, which is flush with one face


def opening(
    leaf: MovableObject, turns_deg: tuple[float, ...] = (0.0, 0.0), length: float = 2.0
) -> Building:
    """A door in a wall along x, whose parts on either side are turned about its ends."""
    parts = []
    for turn, at, way in zip(turns_deg, (-0.02, 0.92), (-1.0, 1.0), strict=False):
        yaw = math.radians(turn)
        along = way * length / 2 * np.array([math.cos(yaw), math.sin(yaw)])
        parts.append(block(at + along[0], ASIDE + along[1], length, 0.2, yaw))
    return building(Mesh.joined(parts), leaf)


def found(place: Building) -> tuple[float, float] | None:
    """Error and deviation of the bearing, deg."""
    reading = bearings_by_walls(place, place.objects, STD_M).get("door")
    if reading is None:
        return None
    return math.degrees(reading.error), math.degrees(math.sqrt(reading.variance))


@settings(max_examples=30, deadline=None)
@given(st.floats(-4.0, 4.0), st.sampled_from((1.0, -1.0)))
def test_a_leaf_that_is_askew_in_its_wall_is_modelled_wrongly_by_that(
    askew: float, up: float
) -> None:
    leaf = door("door", 0.0, 0.0, math.radians(askew))
    error = found(opening(replace(leaf, axis=up * leaf.axis)))
    assert error is not None
    assert error[0] == pytest.approx(-up * askew, abs=0.01)
    assert error[1] == pytest.approx(0.35, abs=0.06)


@settings(max_examples=20, deadline=None)
@given(st.floats(-math.pi, math.pi), st.floats(-3.0, 3.0))
def test_the_building_may_be_turned(yaw: float, askew: float) -> None:
    place = opening(door("door", 0.0, 0.0, math.radians(askew)))
    turn = np.eye(4)
    turn[:2, :2] = [[math.cos(yaw), -math.sin(yaw)], [math.sin(yaw), math.cos(yaw)]]
    item = place.objects["door"]
    turned = building(place.walls.moved(turn), replace(item, origin=turn @ item.origin))
    assert found(turned) == pytest.approx(found(place), abs=1e-3)


def test_walls_that_differ_tell_less_than_those_that_dont() -> None:
    leaf = door("door", 0.0, 0.0)
    alike, differing = found(opening(leaf)), found(opening(leaf, (-3.0, 3.0)))
    assert alike is not None
    assert differing is not None
    assert differing[0] == pytest.approx(0.0, abs=0.05)
    assert differing[1] > 4.0 * alike[1]


def test_short_walls_tell_less_than_long_ones() -> None:
    leaf = door("door", 0.0, 0.0)
    stds = [each[1] for length in (0.4, 1.0, 4.0) if (each := found(opening(leaf, length=length)))]
    assert stds == sorted(stds, reverse=True)
    assert stds[0] > 2.0 * stds[2]


@pytest.mark.parametrize(
    "place",
    [
        opening(door("door", 0.0, 0.0), ()),  # no wall
        opening(door("door", 0.0, 0.0), length=0.2),  # only posts
        opening(door("door", 0.0, 0.0, math.radians(20.0))),  # it stands across its corner
        opening(door("door", 0.0, 1.0)),  # another wall
        opening(door("door", 0.0, 0.0, limits=(-1.0, 1.0))),  # it isn't closed where it is shown
        opening(door("door", 0.0, 0.0, limits=(-math.pi, math.pi), wraps=True)),
    ],
    ids=["none", "posts", "corner", "elsewhere", "within its range", "turning"],
)
def test_where_no_wall_continues_a_closed_leaf_nothing_is_told(place: Building) -> None:
    assert found(place) is None

"""Walls and objects cast apart are the same as one mesh of everything."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from objstate.building.model import Kind, Mesh, MovableObject
from objstate.building.shapes import Box
from objstate.geometry import FloatArray, transform_from_pose
from objstate.sensing import ExpectedRanges, cast_from
from objstate.sensing.embree import EmbreeCaster
from tests.rooms import (
    beams_at,
    block,
    building,
    combined,
    door,
    enclosure,
    fan,
    in_map,
    placed,
    sliding_door,
    table,
)
from tests.sensing.casting import TOLERANCE, assert_as_embree

turns = st.floats(-np.pi, np.pi)
robots = st.tuples(st.floats(-3.5, 3.5), st.floats(-2.5, 2.5), turns).map(np.array)
mounts = st.builds(
    placed,
    st.floats(-0.3, 0.3),
    st.floats(-0.3, 0.3),
    st.floats(0.05, 2.2),
    st.tuples(st.one_of(turns, st.just(np.pi)), st.floats(-0.6, 0.6), turns),
)
FLAP = MovableObject(  # a hatch in a wall, hinged along its lower edge
    "flap",
    Kind.HINGED,
    placed(3.5, -1.0, 0.8, (0.2, 0.0, 1.0)),
    np.array([0.0, 0.6, 0.8]),
    0.0,
    2.0,
    Box((0.8, 0.03, 0.5)).mesh().moved(placed(0.0, 0.1, 0.2)),
)
ROOM = building(
    Mesh.joined([enclosure(8.0, 6.0), block(1.0, 1.0, 0.4, 0.3, 0.5)]),
    door("door", -3.0, 2.0, 0.3),
    sliding_door("slide", 0.0, -2.0, 0.2),
    table("table", -1.0, 0.0, 0.4),
    FLAP,
)
EXPECTED = ExpectedRanges(ROOM)
states = st.fixed_dictionaries(
    {
        "door": st.tuples(st.floats(0.0, 1.57)).map(np.array),
        "slide": st.tuples(st.floats(0.0, 0.9)).map(np.array),
        "table": st.tuples(st.floats(-3.0, 3.0), st.floats(-2.0, 2.0), turns).map(np.array),
        "flap": st.tuples(st.floats(0.0, 2.0)).map(np.array),
    }
)


@settings(max_examples=60)
@given(states, robots, mounts)
def test_the_nearest_of_walls_and_objects_is_what_one_mesh_gives(
    states: dict[str, FloatArray], robot: FloatArray, mount: FloatArray
) -> None:
    rays = beams_at(np.linspace(-2.5, 2.5, 80), mount)
    found = EXPECTED.scene(states, robot[None], rays)[0]
    assert_as_embree(found, combined(ROOM, states), *in_map(rays, robot))


def test_batches_of_poses_and_states_are_cast_as_one_by_one() -> None:
    rng = np.random.default_rng(0)
    poses, rays = rng.uniform(-2, 2, (4, 3)), fan(50, mount=placed(0.2, 0.0, 0.5, (0.1, 0.2, 0.3)))
    angles = np.array([[0.0], [0.7], [1.5]])
    ranges = EXPECTED.object("door", angles, poses, rays)
    assert ranges.shape == (4, 3, 50)
    for p, pose in enumerate(poses):
        np.testing.assert_array_equal(
            EXPECTED.walls(poses, rays)[p], EXPECTED.walls(pose[None], rays)[0]
        )
        for s, angle in enumerate(angles):
            alone = EXPECTED.object("door", angle[None], pose[None], rays)[0, 0]
            np.testing.assert_allclose(ranges[p, s], alone, atol=1e-6)


def test_where_nothing_is_the_range_is_infinite() -> None:
    empty = ExpectedRanges(building(Mesh.empty(), table("table", 5.0, 0.0)))
    rays, poses = fan(5, 1.0, towards=np.pi), np.zeros((1, 3))
    assert np.isposinf(empty.walls(poses, rays)).all()
    assert np.isposinf(empty.scene({"table": np.array([5.0, 0.0, 0.0])}, poses, rays)).all()


def test_five_hundred_metres_away_the_ranges_are_the_same() -> None:
    away = np.array([500.0, -410.0, 0.0])
    moved = building(Mesh(ROOM.walls.vertices + away, ROOM.walls.faces), table("t", 501.0, -410.0))
    rays = fan(200, 2 * np.pi, mount=placed(0.1, 0.0, 0.4, (0.05, 0.03, 0.0)))
    robot = np.array([0.3, -0.2, 0.4])
    far = ExpectedRanges(moved)
    at = robot + np.array([*away[:2], 0.0])
    near_walls, far_walls = EXPECTED.walls(robot[None], rays), far.walls(at[None], rays)
    np.testing.assert_allclose(far_walls, near_walls, atol=TOLERANCE)
    near_table = EXPECTED.object("table", np.array([[1.0, 0.0, 0.2]]), robot[None], rays)
    far_table = far.object("t", np.array([[501.0, -410.0, 0.2]]), at[None], rays)
    np.testing.assert_allclose(far_table, near_table, atol=TOLERANCE)


@given(robots, mounts)
def test_beams_are_cast_from_where_the_robot_stands(robot: FloatArray, mount: FloatArray) -> None:
    rays = beams_at(np.linspace(-1.0, 1.0, 7), mount)
    for found, expected in zip(
        cast_from(transform_from_pose(robot), rays), in_map(rays, robot), strict=True
    ):
        np.testing.assert_allclose(found, expected, atol=1e-12)


def test_rays_of_the_wrong_shape_are_refused() -> None:
    caster = EmbreeCaster(ROOM.walls)
    with pytest.raises(ValueError, match=r"must be \(n, 3\)"):
        caster.distances(np.zeros((4, 3)), np.zeros((5, 3)))

"""A level laser against outlines: the same ranges as Embree against triangles."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from objstate.building.model import Building, Mesh
from objstate.config import BeamModelSettings
from objstate.geometry import FloatArray, between, transform_from_pose
from objstate.records import Rays
from objstate.sensing import BeamModel, ScanView, Sensing, UncertainObject, cast_from
from objstate.sensing.level import Sweep
from objstate.sensing.level_view import LevelView
from tests.rooms import (
    LASER_HEIGHT,
    beams_at,
    block,
    building,
    combined,
    door,
    enclosure,
    fan,
    fence,
    placed,
    scan_of,
    sliding_door,
    standing,
    table,
)
from tests.sensing.casting import SKIN, TOLERANCE, assert_as_embree

FAR = 60.0  # m, farther than anything in these tests
EXAMPLES = 40

# places and turns, among them those where faces line up with beams
metres = st.one_of(st.floats(-6.0, 6.0), st.sampled_from([-2.0, -0.5, 0.0, 1.0, 3.0]))
sizes = st.one_of(st.floats(0.05, 3.0), st.sampled_from([0.5, 1.0]))
turns = st.one_of(
    st.floats(-np.pi, np.pi), st.sampled_from([0.0, np.pi / 4, np.pi / 2, np.pi, -np.pi / 2])
)
blocks = st.lists(st.tuples(metres, metres, sizes, sizes, turns), max_size=6)
poses = st.tuples(metres, metres, turns).map(np.array)
fans = st.builds(
    fan, st.integers(1, 180), st.one_of(st.floats(0.1, 2 * np.pi), st.just(2 * np.pi)), turns
)


def level_view(place: Building, rays: Rays) -> ScanView:
    scan = scan_of(np.full(len(rays), 1.0), rays, range_max=FAR)
    view = Sensing(place, BeamModel(BeamModelSettings())).view(scan)
    assert isinstance(view, LevelView)
    return view


def assert_as_embree_sees(clutter: Mesh, rays: Rays, robot: FloatArray) -> None:
    """Clutter is cast as an object: all of it, whereas of walls only those in sight are kept."""
    view = level_view(building(Mesh.empty(), standing("clutter", clutter)), rays)
    found = view.object("clutter", np.zeros((1, 3)), robot[None])[0, 0]
    assert_as_embree(found, clutter, *cast_from(transform_from_pose(robot), rays))


def hall(boxes: list[tuple[float, ...]]) -> Mesh:
    return Mesh.joined([enclosure(15.0, 15.0), *(block(*box) for box in boxes)])


def outside_of(boxes: list[tuple[float, ...]], rays: Rays, robot: FloatArray) -> bool:
    """Whether no beam starts inside a box: of a solid thing, only the near side is cast."""
    origins, _ = cast_from(transform_from_pose(robot), rays)
    for x, y, width, depth, yaw in boxes:
        off = between(np.array([x, y, yaw]), np.column_stack([origins[:, :2], origins[:, 0]]))
        if (np.abs(off[:, :2]) < np.array([width, depth]) / 2 + SKIN).all(axis=1).any():
            return False
    return True


def driven(rays: Rays, step: FloatArray) -> Rays:
    """The beams of a sweep that lasts while the robot moves by a pose ``step`` (3,)."""
    share = np.linspace(0.0, 1.0, len(rays))[:, None]
    base = transform_from_pose(share * step)
    origins = np.einsum("nij,nj->ni", base[:, :3, :3], rays.origins) + base[:, :3, 3]
    return Rays(origins, np.einsum("nij,nj->ni", base[:, :3, :3], rays.directions))


@settings(max_examples=EXAMPLES)
@given(blocks, fans, poses)
@example([(2.0, 0.5, 1.0, 1.0, 0.0)], fan(181), np.zeros(3))  # along a face
@example([(2.0, 0.5, 1.0, 1.0, 0.3)], fan(9, 2 * np.pi), np.array([0.0, 0.0, 0.3]))
@example([(-2.0, 0.0, 1.0, 1.0, 0.0)], fan(360, 2 * np.pi), np.zeros(3))  # across pi
def test_boxes_in_a_hall_as_embree_sees_them(
    boxes: list[tuple[float, ...]], rays: Rays, robot: FloatArray
) -> None:
    assume(outside_of(boxes, rays, robot))
    assert_as_embree_sees(hall(boxes), rays, robot)


@settings(max_examples=EXAMPLES)
@given(blocks, fans, poses, st.tuples(st.floats(-0.8, 0.8), st.floats(-0.2, 0.2), turns))
def test_a_sweep_while_driving_has_an_origin_for_each_beam(
    boxes: list[tuple[float, ...]], rays: Rays, robot: FloatArray, step: tuple[float, float, float]
) -> None:
    rays = driven(rays, np.array(step))
    assume(outside_of(boxes, rays, robot))
    assert_as_embree_sees(hall(boxes), rays, robot)


@settings(max_examples=20)
@given(blocks, poses, st.tuples(metres, metres, turns), st.booleans())
def test_a_laser_may_stand_anywhere_on_the_robot_and_upside_down(
    boxes: list[tuple[float, ...]],
    robot: FloatArray,
    mount: tuple[float, float, float],
    upside_down: bool,
) -> None:
    x, y, yaw = mount
    frame = placed(x / 10, y / 10, 0.7, (np.pi if upside_down else 0.0, 0.0, yaw))
    rays = beams_at(np.linspace(-2.0, 2.0, 120), frame)
    assume(outside_of(boxes, rays, robot))
    assert_as_embree_sees(hall(boxes), rays, robot)


@settings(max_examples=EXAMPLES)
@given(blocks, fans, poses, st.floats(0.0, 0.24), st.integers(0, 1000), st.booleans())
def test_many_robot_poses_abreast_as_embree_sees_them(
    boxes: list[tuple[float, ...]],
    rays: Rays,
    robot: FloatArray,
    spread: float,
    seed: int,
    drives: bool,
) -> None:
    """Poses close together are cast side by side, each beam over a range that serves them all."""
    rays = driven(rays, np.array([0.5, 0.1, 0.4])) if drives else rays
    cloud = robot + spread * np.random.default_rng(seed).uniform(-1.0, 1.0, (9, 3))
    assume(all(outside_of(boxes, rays, pose) for pose in cloud))
    clutter = hall(boxes)
    view = level_view(building(Mesh.empty(), standing("clutter", clutter)), rays)
    found = view.object("clutter", np.zeros((1, 3)), cloud)[:, 0]
    for pose, ranges in zip(cloud[:3], found, strict=False):
        assert_as_embree(ranges, clutter, *cast_from(transform_from_pose(pose), rays))


@settings(max_examples=EXAMPLES)
@given(blocks, fans, poses, st.floats(0.0, 0.24), st.integers(0, 1000), st.booleans())
@example(
    [(2.0, 0.0, 0.4, 1.6, 0.0), (2.6, 0.6, 0.8, 0.4, 0.0), (2.6, -0.6, 0.8, 0.4, 0.0)],
    fan(181),
    np.array([4.5, 0.1, np.pi]),
    0.1,
    1,
    False,
)  # into a U of three cupboards
@example(
    [(2.0, 0.0, 1.0, 1.0, 0.0), (3.0, 1.0, 1.0, 1.0, 0.0)], fan(181), np.zeros(3), 0.1, 1, True
)
def test_solid_things_from_outside_as_embree_sees_them(
    boxes: list[tuple[float, ...]],
    rays: Rays,
    robot: FloatArray,
    spread: float,
    seed: int,
    has_sheet: bool,
) -> None:
    """Touching, overlapping, apart, and with a sheet that closes nothing: far sides are left out, not near ones."""
    cloud = robot + spread * np.random.default_rng(seed).uniform(-1.0, 1.0, (9, 3))
    assume(boxes and all(outside_of(boxes, rays, pose) for pose in cloud))
    sheet = fence(np.array([[-1.0, 2.0], [1.5, 2.5]])) if has_sheet else Mesh.empty()
    clutter = Mesh.joined([*(block(*box) for box in boxes), sheet])
    view = level_view(building(Mesh.empty(), standing("clutter", clutter)), rays)
    found = view.object("clutter", np.zeros((1, 3)), cloud)[:, 0]
    for pose, ranges in zip(cloud[:3], found, strict=False):
        assert_as_embree(ranges, clutter, *cast_from(transform_from_pose(pose), rays))


def test_a_robot_inside_a_ring_sees_the_ring_from_within() -> None:
    ring, rays = enclosure(3.0, 3.0), fan(181, 2 * np.pi)
    for robot in (np.array([0.3, 0.2, 0.5]), np.array([4.0, 0.2, 3.0])):  # within and without
        assert_as_embree_sees(ring, rays, robot)


@settings(max_examples=EXAMPLES)
@given(fans, poses, st.floats(-0.2, 2.0), st.floats(0.0, 0.9), poses, st.booleans())
def test_objects_in_any_state_as_embree_sees_them(
    rays: Rays,
    robot: FloatArray,
    angle: float,
    offset: float,
    stands: FloatArray,
    drives: bool,
) -> None:
    rays = driven(rays, np.array([0.5, 0.1, 0.4])) if drives else rays
    place = building(
        Mesh.empty(),
        door("door", 1.0, 0.5, 0.7, limits=(-0.2, 2.0)),
        replace(door("right", -1.0, -1.5, 2.7), axis=np.array([0.0, 0.0, -1.0])),
        sliding_door("slide", -1.0, 2.0, 2.0),
        table("table", 0.5, -1.0, 1.2),
    )
    states = {
        "door": np.array([angle]),
        "right": np.array([angle]),
        "slide": np.array([offset]),
        "table": stands,
    }
    view = level_view(place, rays)
    ends = cast_from(transform_from_pose(robot), rays)
    for name, state in states.items():
        found = view.object(name, state[None], robot[None])[0, 0]
        assert_as_embree(found, combined(place, {name: state}), *ends)


@settings(max_examples=EXAMPLES)
@given(st.lists(st.floats(1.0, 6.0), min_size=5, max_size=30), st.floats(-3.0, 3.0), turns)
def test_no_beam_slips_between_walls_that_touch(
    distances: list[float], turn: float, yaw: float
) -> None:
    """Beams exactly through the corners of a closed fence end at the corners."""
    bearings = turn + np.linspace(0.0, 2 * np.pi, len(distances), endpoint=False)
    corners = np.array(distances)[:, None] * np.column_stack([np.cos(bearings), np.sin(bearings)])
    robot = np.array([0.0, 0.0, yaw])
    rays = beams_at(bearings - yaw, placed(0.0, 0.0, LASER_HEIGHT))
    found = level_view(building(fence(corners)), rays).walls(robot[None])[0]
    np.testing.assert_allclose(found, distances, atol=1e-6)


@pytest.mark.parametrize("yaw", [0.0, 0.3, -2.1, np.pi])
@pytest.mark.parametrize("drives", [False, True])
def test_a_wall_seen_exactly_along_its_faces_is_no_nearer_than_its_end(
    yaw: float, drives: bool
) -> None:
    """Rounding turns such faces to and fro by their last digit."""
    along = np.array([np.cos(yaw), np.sin(yaw)])
    around = yaw + np.concatenate([[0.0], np.linspace(-2e-9, 2e-9, 41)])
    rays = beams_at(around, placed(0.0, 0.0, LASER_HEIGHT))
    if drives:
        rays = Rays(
            rays.origins + np.linspace(0.0, 0.2, 42)[:, None] * [*along, 0.0], rays.directions
        )
    for start in np.random.default_rng(0).uniform(0.5, 3.0, 40):
        sheet = building(fence(np.array([start, start + 1.5])[:, None] * along))
        found = level_view(sheet, rays).walls(np.zeros((1, 3)))[0]
        assert found.min() >= start - 0.2 * drives - TOLERANCE


@pytest.mark.parametrize("seed", range(5))
def test_walls_of_a_room_as_embree_sees_them(seed: int) -> None:
    rng = np.random.default_rng(seed)
    boxes = [(*rng.uniform(-6, 6, 2), *rng.uniform(0.4, 2, 2), rng.uniform(-3, 3)) for _ in "1234"]
    walls, rays = hall(boxes), fan(541, 1.5 * np.pi)
    robots = rng.uniform([-6, -6, -3], [6, 6, 3], (5, 3))
    found = level_view(building(walls), rays).walls(robots)
    for robot, ranges in zip(robots, found, strict=True):
        assert_as_embree(ranges, walls, *cast_from(transform_from_pose(robot), rays))


def test_many_poses_and_states_are_cast_as_one_by_one() -> None:
    rng = np.random.default_rng(1)
    place = building(enclosure(8.0, 6.0), table("table", 1.0, 0.5))
    robots = rng.uniform([-3, -2, -3], [3, 2, 3], (5, 3))
    states = rng.uniform([-2, -2, -3], [2, 2, 3], (4, 3))
    view = level_view(place, fan(90, 2 * np.pi))
    together = view.object("table", states, robots)
    assert together.shape == (5, 4, 90)
    for p, robot in enumerate(robots):
        np.testing.assert_allclose(view.walls(robots)[p], view.walls(robot[None])[0], atol=1e-9)
        for s, state in enumerate(states):
            alone = view.object("table", state[None], robot[None])[0, 0]
            np.testing.assert_allclose(together[p, s], alone, atol=1e-12)


def test_five_hundred_metres_away_the_ranges_are_the_same() -> None:
    rng = np.random.default_rng(2)
    boxes = [
        (*rng.uniform(-5, 5, 2), *rng.uniform(0.2, 2, 2), rng.uniform(-3, 3)) for _ in range(6)
    ]
    away = np.array([500.0, -410.0])
    here = Mesh.joined([enclosure(14.0, 13.0), *(block(*box) for box in boxes)])
    there = Mesh(here.vertices + np.array([*away, 0.0]), here.faces)
    rays, robot = fan(361, 2 * np.pi), np.array([0.3, -0.2, 0.4])
    near = level_view(building(here), rays).walls(robot[None])
    far = level_view(building(there), rays).walls(robot[None] + np.array([*away, 0.0]))
    np.testing.assert_allclose(far, near, atol=TOLERANCE)


def test_walls_stay_complete_while_the_robot_drives_on() -> None:
    place = building(hall([(2.0, 0.0, 0.5, 3.0, 0.2), (-3.0, 2.0, 1.0, 0.2, 1.0)]))
    rays = fan(120, 2 * np.pi)
    scan = scan_of(np.full(120, 1.0), rays, range_max=4.0)
    sensing = Sensing(place, BeamModel(BeamModelSettings()))
    for x in np.linspace(-6.0, 6.0, 25):
        robot = np.array([x, 0.4 * x, x])
        found = sensing.view(scan).walls(robot[None])[0]
        fresh = level_view(place, rays).walls(robot[None])[0]
        np.testing.assert_allclose(found[fresh < 4.0], fresh[fresh < 4.0], atol=1e-9)
        assert (found[fresh >= 4.0] >= 4.0).all()


@pytest.mark.parametrize(
    "rpy", [(0.02, 0.0, 0.0), (0.0, -0.02, 0.5), (np.pi, 0.01, 0.0), (np.pi / 2, 0.0, 0.0)]
)
def test_a_tilted_laser_has_no_level_sweep(rpy: tuple[float, float, float]) -> None:
    assert Sweep.of(beams_at(np.linspace(-1.0, 1.0, 30), placed(0.1, 0.0, 0.3, rpy))) is None


def test_neither_beams_at_several_heights_nor_no_beams_are_a_level_sweep() -> None:
    two = Rays(np.array([[0, 0, 0.3], [0, 0, 0.4]]), np.array([[1.0, 0, 0], [0, 1.0, 0]]))
    assert Sweep.of(two) is None
    assert Sweep.of(two.take(np.array([], dtype=np.int64))) is None
    assert Sweep.of(two.take(np.array([0]))) is not None


@given(st.permutations(range(24)))
@settings(max_examples=20)
def test_ranges_come_back_in_the_order_of_the_scan(order: list[int]) -> None:
    place = building(hall([(2.0, 1.0, 1.0, 0.5, 0.2)]))
    rays, index = fan(24, 2 * np.pi - 0.1), np.array(order)
    sorted_ranges = level_view(place, rays).walls(np.zeros((1, 3)))[0]
    shuffled = level_view(place, rays.take(index)).walls(np.zeros((1, 3)))[0]
    np.testing.assert_array_equal(shuffled, sorted_ranges[index])


def test_what_was_remembered_of_a_door_is_not_of_it_where_it_hangs_elsewhere() -> None:
    """As little as of a wider one: each view is that of somebody who never saw another building."""
    model, robot = BeamModel(BeamModelSettings()), np.array([[0.2, 0.1, 1.3]])
    walls, rays = enclosure(6.0, 5.0), fan(91)
    scan = scan_of(np.full(91, 1.7), rays)
    known = [UncertainObject("door", np.array([[0.2], [0.9]]), np.array([0.5, 0.5]))]

    def told(sensing: Sensing) -> tuple[float, FloatArray]:
        view = sensing.view(scan)
        seen = view.object("door", known[0].states, robot)
        return float(view.pose_log_likelihood(robot, 0.0, known)[0]), seen

    first = Sensing(building(walls, door("door", -0.4, 1.5)), model)
    before = told(first)
    for other in (door("door", -0.1, 1.2), door("door", -0.4, 1.5, width=0.5)):
        after, fresh = (
            told(each)
            for each in (first.with_object(other), Sensing(building(walls, other), model))
        )
        assert after[0] == fresh[0] != before[0]
        np.testing.assert_array_equal(after[1], fresh[1])
    again = told(first)
    assert again[0] == before[0]
    np.testing.assert_array_equal(again[1], before[1])

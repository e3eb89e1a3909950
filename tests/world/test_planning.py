"""What planners ask: blocked ways, costs of edges, modes of doors."""

import json
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from objstate.building.model import Mesh
from objstate.errors import BuildingError, QueryError, WorldError
from objstate.objects import ObjectBelief
from objstate.particles import Weights
from objstate.world import Task, World
from objstate.world.door_modes import DoorMode, door_mode, door_modes
from objstate.world.route_graph import EdgeCost, RouteEdge, dynamic_edges
from objstate.world.when import best_departure, passable, spans, wait
from tests.rooms import block, standing
from tests.world.examples import DESK, HOUR, OBJECTS, SECOND, at_angle, desk_at

THROUGH = [(0.45, -2.0), (0.45, 2.0)]  # along the middle of the doorway
OPEN, SHUT, AJAR = 1.55, 0.0, 0.6


def world_with(*beliefs: ObjectBelief) -> World:
    return World.of(OBJECTS, beliefs=beliefs)


def far_desk(stamp_ns: int = 0) -> ObjectBelief:
    return desk_at(30.0, stamp_ns)


def test_a_closed_door_blocks_its_doorway_and_an_open_one_does_not() -> None:
    for angle, chance in ((SHUT, 1.0), (AJAR, 1.0), (OPEN, 0.0)):
        blockage = world_with(at_angle(angle, 0, std=0.01), far_desk()).at(0).blocked(THROUGH, 0.3)
        assert blockage.probability == pytest.approx(chance, abs=1e-3)
        assert [each.object for each in blockage.blockers][: int(chance)] == ["door"] * int(chance)


@settings(max_examples=30)
@given(st.floats(0.0, 1.57), st.floats(0.02, 0.6), st.floats(0.05, 0.4))
def test_a_wider_robot_is_blocked_more_often(angle: float, std: float, radius: float) -> None:
    then = world_with(at_angle(angle, 0, std), desk_at(1.6, 0, spread=0.1)).at(0)
    narrow, wide = then.blocked(THROUGH, radius), then.blocked(THROUGH, radius * 1.3)
    assert 0.0 <= narrow.probability <= wide.probability + 1e-12 <= 1.0 + 1e-9


def test_the_probability_is_that_of_the_samples_in_the_way() -> None:
    places = np.zeros((100, 3))
    places[:, 0] = np.where(np.arange(100) < 30, 0.0, 9.0)
    half = ObjectBelief(DESK, places, Weights.uniform(100), np.zeros(3), 1.0, 0, 0)
    world = World({"desk": DESK}, world_with().settings, {"desk": (half,)})
    blockage = world.at(0).blocked([(-2.0, 0.0), (2.0, 0.0)], 0.2)
    assert blockage.probability == pytest.approx(0.3)
    assert blockage.blockers[0].probability == pytest.approx(0.3)


def test_several_objects_block_independently_and_the_likeliest_is_blamed_first() -> None:
    both = world_with(at_angle(0.78, 0, std=0.3), desk_at(0.95, 0, spread=0.3)).at(0)
    blockage = both.blocked([(0.45, -2.0), (0.45, 2.0)], 0.2)
    chances = {each.object: each.probability for each in blockage.blockers}
    assert chances.keys() == {"door", "desk"}
    free = (1 - chances["door"]) * (1 - chances["desk"])
    assert blockage.probability == pytest.approx(1 - free)
    assert [c.probability for c in blockage.blockers] == sorted(chances.values(), reverse=True)


def test_a_robot_fits_into_the_hollow_of_an_object() -> None:
    cup = standing(
        "cup",
        Mesh.joined([block(0, -1, 2, 0.1), block(-1, 0, 0.1, 2), block(1, 0, 0.1, 2)]),
    )
    there = ObjectBelief(cup, np.zeros((1, 3)), Weights.uniform(1), np.zeros(3), 1.0, 0, 0)
    world = World({"cup": cup}, world_with().settings, {"cup": (there,)})
    assert world.at(0).blocked([(0.0, 3.0), (0.0, 0.0)], 0.3).probability == 0.0
    assert world.at(0).blocked([(0.0, 3.0), (0.0, -3.0)], 0.3).probability == 1.0


def test_a_point_is_a_path_and_nonsense_is_none() -> None:
    then = world_with(at_angle(SHUT, 0)).at(0)
    assert then.blocked([(0.45, 0.0)], 0.1).probability == pytest.approx(1.0, abs=0.05)
    ragged: Any = [(0.0, 0.0), (1.0,)]
    words: Any = "THROUGH"
    for path in ([], [(0.0, np.nan)], [(1.0, 2.0, 3.0)], [1.0, 2.0], ragged, words):
        with pytest.raises(QueryError, match="list of points"):
            then.blocked(path, 0.3)
        with pytest.raises(QueryError, match="polygon of three or more points"):
            then.occupied(path)
    for radius in (0.0, -1.0, np.inf):
        with pytest.raises(WorldError, match="radius"):
            then.blocked(THROUGH, radius)


@pytest.mark.parametrize("path", [[(2.3, 1.0)], [(2.3, 1.0)] * 3, [(2.3, 1.0), (2.3, 1.0 + 1e-13)]])
def test_a_robot_that_stands_meets_what_one_that_creeps_does(path: Any) -> None:
    then = world_with(desk_at(3.0, 0, spread=0.2)).at(0)
    creeps = then.blocked([(2.3, 1.0), (2.3, 1.001)], 0.3).probability
    assert 0.1 < creeps < 0.9
    assert then.blocked(path, 0.3).probability == pytest.approx(creeps, abs=0.02)


def test_edges_are_told_in_the_words_of_nav2() -> None:
    edges = [RouteEdge(3, THROUGH), RouteEdge(7, [(-4.0, -2.0), (-4.0, 2.0)])]
    shut = world_with(at_angle(SHUT, 0), far_desk()).at(0)
    told = dynamic_edges(shut, edges, 0.3, detour_cost=20.0)
    assert told.closed_edges == (3,)
    assert told.opened_edges == (7,)
    assert told.adjust_edges == (EdgeCost(3, pytest.approx(20.0)), EdgeCost(7, 0.0))
    assert told.to_dict()["adjust_edges"][1] == {"edgeid": 7, "cost": 0.0}


def test_an_edge_that_may_be_blocked_costs_what_that_costs_on_average() -> None:
    later = world_with(at_angle(OPEN, 0), far_desk()).at(HOUR)
    told = dynamic_edges(later, [RouteEdge(1, THROUGH)], 0.3, detour_cost=10.0)
    chance = later.blocked(THROUGH, 0.3).probability
    assert 0.05 < chance < 0.9
    assert told.opened_edges == (1,)
    assert told.adjust_edges[0].cost == pytest.approx(10.0 * chance)
    strict = dynamic_edges(later, [RouteEdge(1, THROUGH)], 0.3, detour_cost=10.0, close_from=chance)
    assert strict.closed_edges == (1,)


def test_what_nav2_cannot_be_told_is_refused() -> None:
    then = world_with().at(0)
    with pytest.raises(WorldError, match="65535"):
        dynamic_edges(then, [RouteEdge(70_000, THROUGH)], 0.3, detour_cost=1.0)
    with pytest.raises(WorldError, match="close_from"):
        dynamic_edges(then, [], 0.3, detour_cost=1.0, close_from=0.0)


def test_edges_are_numbered_by_any_integers_and_by_nothing_else() -> None:
    then = world_with(at_angle(SHUT, 0), far_desk()).at(0)
    cost: Any = np.float32(2.0)
    told = dynamic_edges(then, [RouteEdge(3, THROUGH)], 0.3, detour_cost=2.0)
    number: Any = np.int64(3)
    same = dynamic_edges(then, [RouteEdge(number, THROUGH)], 0.3, detour_cost=cost)
    assert json.dumps(same.to_dict()) == json.dumps(told.to_dict())
    wrong: Any
    for wrong in (1.5, "1", None):
        with pytest.raises(QueryError, match="number with integers from 0 to 65535"):
            dynamic_edges(then, [RouteEdge(wrong, THROUGH)], 0.3, detour_cost=1.0)


def test_two_edges_of_one_number_are_refused() -> None:
    edges = [RouteEdge(1, THROUGH), RouteEdge(1, [(-4.0, -2.0), (-4.0, 2.0)])]
    with pytest.raises(WorldError, match="Two edges have the number 1"):
        dynamic_edges(world_with().at(0), edges, 0.3, detour_cost=1.0)


@pytest.mark.parametrize("cost", [np.inf, np.nan, -1.0])
def test_a_detour_that_costs_no_number_is_refused(cost: float) -> None:
    with pytest.raises(WorldError, match="detour cost"):
        dynamic_edges(world_with().at(0), [], 0.3, detour_cost=cost)


def test_furniture_across_edges_in_a_row_is_paid_once_along_them() -> None:
    desk, ends = desk_at(5.0, 0, spread=0.3), np.linspace(2.0, 8.0, 13)
    rows = [[(a, 1.0), (b, 1.0)] for a, b in pairwise(ends)]
    there = [RouteEdge(k, row) for k, row in enumerate(rows)]
    back = [RouteEdge(100 + k, row[::-1]) for k, row in enumerate(rows)]
    unseen = World.of({"desk": DESK}, beliefs=[desk]).at(2 * HOUR)
    own = unseen.blocked([(2.0, 1.0), (8.0, 1.0)], 0.3).probability
    told = dynamic_edges(unseen, there + back, 0.3, detour_cost=1.0)
    costs = {each.edgeid: each.cost for each in told.adjust_edges}
    each_alone = [unseen.blocked(row, 0.3).probability for row in rows]
    assert sum(each_alone) > 1.5 * own
    for way in (there, back):
        assert sum(costs[edge.edgeid] for edge in way) == pytest.approx(own, abs=1e-9)


def test_edges_that_do_not_meet_are_charged_with_all_of_it() -> None:
    then = World.of({"desk": DESK}, beliefs=[desk_at(5.0, 0)]).at(HOUR)
    lanes = [[(2.0, 1.0), (8.0, 1.0)], [(2.0, 1.3), (8.0, 1.3)]]
    told = dynamic_edges(then, [RouteEdge(k, lane) for k, lane in enumerate(lanes)], 0.3,
                         detour_cost=1.0)  # fmt: skip
    for lane, charged in zip(lanes, told.adjust_edges, strict=True):
        assert charged.cost == pytest.approx(then.blocked(lane, 0.3).probability)


@pytest.mark.parametrize(
    ("width", "length"), [(np.nan, 0.0), (-1.0, 0.0), (0.6, np.nan), (0.6, -1.0), (60.0, 0.0)]
)
def test_a_robot_of_no_size_or_of_one_in_centimetres_is_refused(
    width: float, length: float
) -> None:
    with pytest.raises(QueryError, match="between 0 and 20 m; give metres"):
        at_angle(OPEN, 0).probability_clear(width, length)


@pytest.mark.parametrize("length", [np.nan, -1.0, np.inf])
def test_a_clear_width_for_a_length_that_is_none_is_refused(length: float) -> None:
    with pytest.raises(QueryError, match="between 0 and 20 m; give metres"):
        at_angle(OPEN, 0).clear_width_for(length)


@pytest.mark.parametrize("probability", [np.nan, 0.0, -0.5, 90.0])
def test_spans_of_a_probability_that_is_none_are_refused(probability: float) -> None:
    world = world_with(at_angle(OPEN, 0))
    with pytest.raises(QueryError, match="above 0 and at most 1"):
        spans(world, "door", 0.6, 0, 600.0, probability)


def test_stamps_in_seconds_and_radii_in_centimetres_are_refused() -> None:
    now = 1_600_000_000 * 10**9
    world = World.of({"desk": DESK}, beliefs=[desk_at(5.0, now)])
    with pytest.raises(WorldError, match="stamps are in nanoseconds"):
        world.at(1_600_000_000)
    assert world.at(now).blocked([(2.0, 1.0)], 0.3).probability < 0.5
    with pytest.raises(WorldError, match="give metres"):
        world.at(now).blocked([(2.0, 1.0)], 30.0)


@pytest.mark.parametrize(
    ("stamp_ns", "said"),
    [
        (np.nan, "no whole number; stamps are in nanoseconds"),
        (1.5, "no whole number"),
        (10**30, "too far away"),
        (2**63 - 1, "too far away"),
        (-1, "stamps are in nanoseconds"),
    ],
)
def test_a_moment_that_is_none_is_refused(stamp_ns: Any, said: str) -> None:
    world = World.of(OBJECTS, beliefs=[at_angle(OPEN, 1_600_000_000 * 10**9)])
    about_door = (world.belief, world.history_until, world.probability_moved)
    for ask in (
        world.at,
        world.moment,
        lambda stamp: world.due(Task(name="pass"), 1.0, stamp),
        *(partial(each, "door") for each in about_door),
    ):
        with pytest.raises(QueryError, match=said):
            ask(stamp_ns)
    with pytest.raises(QueryError, match=said):
        passable(world, "door", 0.6, [stamp_ns])


def test_a_wait_and_a_way_of_no_size_are_refused() -> None:
    world = World.of(OBJECTS, beliefs=[at_angle(OPEN, HOUR)])
    with pytest.raises(QueryError, match="give metres"):
        wait(world, "door", -0.6, HOUR, 60.0)
    with pytest.raises(QueryError, match="give metres"):
        door_modes(world.at(), -1.0)
    for seconds in (np.nan, -5.0, np.inf):
        with pytest.raises(QueryError, match="'door' can't be reached"):
            best_departure(world, [("door", seconds)], 0.6, HOUR, 60.0)


def test_a_probability_is_never_above_one() -> None:
    rng = np.random.default_rng(0)
    door = at_angle(OPEN, 0)
    for _ in range(50):
        some = door.with_weights(Weights.of(rng.random(len(door.states))))
        assert some.probability_clear(0.0) <= 1.0


@pytest.mark.parametrize("share", [-1.0, 0.0, 1.1, np.nan])
def test_an_interval_of_no_share_is_refused(share: float) -> None:
    for belief in (at_angle(OPEN, 0), desk_at(3.0, 0)):
        with pytest.raises(QueryError, match="above 0 and at most 1"):
            belief.interval(share)
    with pytest.raises(QueryError, match="above 0 and at most 1"):
        at_angle(OPEN, 0).clear_width.interval(share)


@pytest.mark.parametrize(
    ("angle", "mode"), [(OPEN, DoorMode.OPEN), (SHUT, DoorMode.CLOSED), (AJAR, DoorMode.CLOSED)]
)
def test_a_door_that_is_known_is_open_or_closed(angle: float, mode: DoorMode) -> None:
    then = world_with(at_angle(angle, 0)).at(0)
    assert door_modes(then, width=0.7) == {"door": mode}


def test_a_door_unseen_for_long_is_unknown() -> None:
    world = world_with(at_angle(OPEN, 0))
    assert door_mode(world.at(0), "door", 0.7) is DoorMode.OPEN
    assert door_mode(world.at(10 * HOUR), "door", 0.7) is DoorMode.UNKNOWN


def test_a_robot_with_a_length_needs_the_door_wider_open() -> None:
    then = world_with(at_angle(0.9, 0, std=0.01)).at(0)
    assert door_mode(then, "door", 0.6) is DoorMode.OPEN
    assert door_mode(then, "door", 0.6, length=1.0) is DoorMode.CLOSED


def test_a_door_that_was_just_seen_to_move_is_moving() -> None:
    world = world_with(at_angle(SHUT, 0), at_angle(0.5, SECOND), at_angle(OPEN, 2 * SECOND))
    modes = [door_mode(world.at(stamp * SECOND), "door", 0.7) for stamp in (0, 1, 2, 8)]
    assert modes == [DoorMode.CLOSED, DoorMode.MOVING, DoorMode.MOVING, DoorMode.OPEN]


def test_the_numbers_are_those_of_rmf() -> None:
    assert [DoorMode.CLOSED, DoorMode.MOVING, DoorMode.OPEN] == [0, 1, 2]
    assert [DoorMode.OFFLINE, DoorMode.UNKNOWN] == [3, 4]


def test_furniture_has_no_door_mode() -> None:
    with pytest.raises(BuildingError, match="no door"):
        door_mode(world_with().at(0), "desk", 0.7)
    with pytest.raises(WorldError, match="confidence"):
        door_mode(world_with().at(0), "door", 0.7, confidence=0.5)


def test_the_world_answers_for_any_time() -> None:
    world = world_with(at_angle(SHUT, 0), at_angle(OPEN, HOUR), far_desk(HOUR))
    assert world.blocked(THROUGH, 0.3).probability < 0.01
    assert world.blocked(THROUGH, 0.3, stamp_ns=0).probability > 0.99

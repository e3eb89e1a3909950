"""Shortest ways: round walls, through open doors, past furniture."""

import numpy as np
import pytest

from objstate.errors import SettingsError
from objstate.gaze.floor import Floor, FloorSettings, length_of
from objstate.objects import ObjectBelief
from tests.gaze.places import chest, prior, priors, surely, two_rooms

WEST, EAST = np.array([-2.0, 0.0]), np.array([2.0, 0.0])


def way_and_cost(floor: Floor, beliefs: dict[str, ObjectBelief]) -> tuple[np.ndarray, float]:
    ways = floor.ways_from(WEST, beliefs)
    end = floor.nearest(EAST)
    cells = ways.to(end)
    assert cells is not None
    return floor.places[cells], float(ways.costs[end])


def test_a_way_keeps_the_robot_off_the_walls_and_goes_through_the_doorway() -> None:
    rooms = two_rooms()
    floor = Floor.of(rooms)
    way, _ = way_and_cost(floor, {"door": surely(prior(rooms["door"]), np.pi / 2)})
    assert length_of(way) == pytest.approx(4.0, abs=0.5)
    assert (np.abs(way[np.abs(way[:, 0]) < 0.1, 1]) < 0.94 / 2 - 0.1).all()
    assert floor.free.reshape(-1)[[floor.nearest(place) for place in way]].all()


def test_a_door_that_is_probably_closed_costs_and_an_open_one_does_not() -> None:
    rooms = two_rooms()
    floor, belief = Floor.of(rooms), prior(rooms["door"])
    states = (np.pi / 2, None, 0.0)  # open, unknown, closed
    beliefs = [belief if state is None else surely(belief, state) for state in states]
    costs = [way_and_cost(floor, {"door": each})[1] for each in beliefs]
    assert costs[0] < costs[1] < costs[2]
    assert costs[0] == pytest.approx(4.0, abs=0.5)
    assert costs[2] > costs[0] + 0.5 * floor.settings.closed_door_cost


def test_a_narrow_gap_is_no_way() -> None:
    rooms = two_rooms(gap=0.4)
    floor = Floor.of(rooms)
    assert floor.ways_from(WEST, {}).to(floor.nearest(EAST)) is None
    assert floor.pieces[floor.nearest(WEST)] != floor.pieces[floor.nearest(EAST)]


def test_furniture_stands_in_the_way() -> None:
    rooms = two_rooms(chest("chest", -1.0, 0.0, np.pi / 2))
    floor, beliefs = Floor.of(rooms), priors(rooms)
    beliefs["door"] = surely(beliefs["door"], np.pi / 2)
    way, _ = way_and_cost(floor, beliefs)
    assert length_of(way) > 4.2
    blocked = (np.abs(way[:, 0] + 1.0) < 0.4) & (np.abs(way[:, 1]) < 0.5)
    assert not blocked.any()


def test_a_place_outside_is_refused() -> None:
    floor = Floor.of(two_rooms())
    with pytest.raises(SettingsError, match=r"\(20.00, 0.00\) m .* give a place inside"):
        floor.ways_from(np.array([20.0, 0.0]), {})


def test_a_robot_that_fits_nowhere_is_refused() -> None:
    with pytest.raises(SettingsError, match="no place for a robot of radius 3"):
        Floor.of(two_rooms(), FloorSettings(robot_radius=3.0))


def test_nodes_are_free_cells_nearby_in_the_same_piece() -> None:
    floor = Floor.of(two_rooms(gap=0.4))
    cells = np.flatnonzero(floor.free.reshape(-1))
    nodes = floor.nodes[cells]
    assert floor.free.reshape(-1)[nodes].all()
    assert (floor.pieces[nodes] == floor.pieces[cells]).all()
    assert np.linalg.norm(floor.places[nodes] - floor.places[cells], axis=1).max() < 0.85
    assert len(np.unique(nodes)) < len(cells) / 8


def test_the_way_from_a_place_to_itself_is_no_way_at_all() -> None:
    rooms = two_rooms()
    floor = Floor.of(rooms)
    ways = floor.ways_from(WEST, {"door": prior(rooms["door"])})
    cells = ways.to(ways.start)
    assert cells is not None
    assert cells.tolist() == [ways.start]


def test_ways_to_several_places_are_the_ways_to_each() -> None:
    rooms = two_rooms()
    floor = Floor.of(rooms)
    ways = floor.ways_from(WEST, {"door": prior(rooms["door"])})
    ends = np.array([floor.nearest(EAST), ways.start, floor.nearest(np.array([-3.0, 1.0]))])
    together = ways.to_each(ends)
    assert (together[0] == ways.start).all()
    for k, end in enumerate(ends.tolist()):
        alone = ways.to(end)
        assert alone is not None
        waits = len(together) - len(alone)
        assert together[waits:, k].tolist() == alone.tolist()
        assert (together[:waits, k] == ways.start).all()

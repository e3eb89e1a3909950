"""A short way around an opening tells a gap between things from a doorway."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from objstate.building.occupancy import OccupancyMap
from objstate.discovery.detours import has_way_around, with_ways_around
from objstate.discovery.walls import Opening
from objstate.geometry import BoolArray, FloatArray, compose

CELL, SIDE = 0.05, 200  # m of a cell, and cells along each side of the map


def gap(length: float) -> tuple[BoolArray, FloatArray]:
    """Cells of a map with a wall of so many metres to either side of a gap of 0.9 m, and its ends."""
    occupied = np.zeros((SIDE, SIDE), dtype=bool)
    reach, half = round(length / CELL), round(0.45 / CELL)
    middle = SIDE // 2
    occupied[middle, max(middle - half - reach, 0) : middle - half] = True
    occupied[middle, middle + half : middle + half + reach] = True
    x = (middle + np.array([-half, half])) * CELL
    return occupied, np.column_stack([x, np.full(2, (middle + 0.5) * CELL)])


def opening_of(ends: FloatArray, origin: FloatArray, p_wall: float = 0.8) -> Opening:
    placed = compose(origin, np.column_stack([ends, np.zeros(2)]))[:, :2]
    return Opening(placed[0], placed[1], p_wall)


@given(
    st.floats(-5.0, 5.0),
    st.floats(-np.pi, np.pi),
    st.booleans(),
    st.sampled_from([(0.6, True), (1.2, True), (4.0, False), (20.0, False)]),
)
def test_a_gap_between_short_pieces_has_a_way_around_and_one_in_a_long_wall_has_none(
    x: float, yaw: float, is_turned: bool, piece: tuple[float, bool]
) -> None:
    length, has_way = piece
    occupied, ends = gap(length)
    origin = np.array([x, 1.0, yaw])
    plan = OccupancyMap(occupied, ~occupied, CELL, origin)
    opening = opening_of(ends[::-1] if is_turned else ends, origin)
    assert has_way_around(opening, plan) is has_way
    (told,) = with_ways_around([opening], plan)
    assert (told.p_wall < opening.p_wall) is has_way
    assert 0.0 < told.p_wall < 1.0


def test_a_slit_beside_the_wall_is_no_way() -> None:
    occupied, ends = gap(20.0)
    for wide, has_way in ((4, False), (14, True)):  # cells
        holed = occupied.copy()
        holed[SIDE // 2, 130 : 130 + wide] = False
        plan = OccupancyMap(holed, ~holed, CELL, np.zeros(3))
        assert has_way_around(opening_of(ends, np.zeros(3)), plan) is has_way


@pytest.mark.parametrize("beyond", [0.0, 50.0])  # m off the map
def test_what_the_map_does_not_know_tells_nothing(beyond: float) -> None:
    occupied, ends = gap(1.2)
    free = ~occupied
    free[: SIDE // 2] = False
    plan = OccupancyMap(occupied, free, CELL, np.zeros(3))
    opening = opening_of(ends + beyond, np.zeros(3))
    assert has_way_around(opening, plan) is None
    assert with_ways_around([opening], plan) == [opening]

"""What a map shows behind a wall tells whether its openings are doorways or windows."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from objstate.building.occupancy import OccupancyMap
from objstate.discovery.beyond import with_rooms_beyond
from objstate.discovery.gathering import Beams
from objstate.discovery.scoring import FILLED, log_filled
from objstate.discovery.walls import Opening
from objstate.geometry import compose

CELL, SIDE, WALL = 0.05, 600, 100  # m of a cell; cells along each side, and before the wall
NO_BEAMS = Beams.of([])


def ending_at(points: np.ndarray) -> Beams:
    """Beams of one scan that end at points (n, 2)."""
    count = len(points)
    directions = points / np.hypot(*points.T)[:, None]
    ranges, reach = np.hypot(*points.T), np.full(count, 30.0)
    numbers, zero = np.zeros(count, dtype=np.int64), np.zeros(count)
    return Beams(np.zeros((count, 2)), directions, ranges, reach, numbers, numbers, zero)


def plan_of(free_behind: slice, origin: np.ndarray) -> OccupancyMap:
    """A map of a room, its wall, and free floor behind some columns of the wall."""
    free, occupied = np.zeros((2, SIDE, SIDE), dtype=bool)
    free[:WALL], occupied[WALL] = True, True
    free[WALL + 1 :, free_behind] = True
    return OccupancyMap(occupied, free, CELL, origin)


def opening_of(origin: np.ndarray, *, is_turned: bool) -> Opening:
    """One of 0.9 m in the middle of the wall."""
    x, y = (SIDE / 2 + np.array([-9, 9])) * CELL, (WALL + 0.5) * CELL
    ends = compose(origin, np.column_stack([x, np.full(2, y), np.zeros(2)]))[:, :2]
    first, second = ends[::-1] if is_turned else ends
    return Opening(first, second)


@given(st.floats(-5.0, 5.0), st.floats(-np.pi, np.pi), st.booleans())
def test_nothing_behind_a_wall_speaks_against_doors_and_for_windows(
    x: float, yaw: float, is_turned: bool
) -> None:
    origin = np.array([x, -2.0, yaw])
    opening = opening_of(origin, is_turned=is_turned)
    (outer,) = with_rooms_beyond([opening], plan_of(slice(0), origin), NO_BEAMS)
    (inner,) = with_rooms_beyond([opening], plan_of(slice(250, 262), origin), NO_BEAMS)
    assert outer.p_inner < 0.1
    assert 0.9 < inner.p_inner < 1.0
    assert outer.p_doorway < 0.1 * inner.p_doorway
    assert FILLED < log_filled(inner) < -1.0 < log_filled(outer) < 0.0


@pytest.mark.parametrize(("behind", "is_seen"), [(slice(520, 560), False), (slice(400, 420), True)])
def test_what_is_behind_counts_near_by_only(behind: slice, is_seen: bool) -> None:
    origin = np.zeros(3)
    opening = opening_of(origin, is_turned=False)
    (told,) = with_rooms_beyond([opening], plan_of(behind, origin), NO_BEAMS)
    assert (told.p_inner > 0.5) is is_seen


def test_a_niche_is_no_room() -> None:
    origin, free = np.zeros(3), slice(290, 310)
    plan = plan_of(free, origin)
    niche = plan.free.copy()
    niche[WALL + 8 :] = False
    shallow = OccupancyMap(plan.occupied, niche, CELL, origin)
    (told,) = with_rooms_beyond([opening_of(origin, is_turned=False)], shallow, NO_BEAMS)
    assert told.p_inner < 0.1


def test_beyond_the_map_nothing_is_known() -> None:
    plan = plan_of(slice(0, SIDE), np.zeros(3))
    cut = OccupancyMap(plan.occupied[: WALL + 1], plan.free[: WALL + 1], CELL, np.zeros(3))
    (told,) = with_rooms_beyond([opening_of(np.zeros(3), is_turned=True)], cut, NO_BEAMS)
    assert told.p_inner < 0.1


@pytest.mark.parametrize(("count", "is_seen"), [(1, False), (60, True)])
def test_readings_behind_a_wall_show_a_room_but_for_strays(count: int, is_seen: bool) -> None:
    line = np.column_stack([np.linspace(12.0, 18.0, 300), np.full(300, (WALL + 0.5) * CELL)])
    behind = np.column_stack([np.linspace(14.0, 16.0, count), np.full(count, WALL * CELL + 2.5)])
    before = np.column_stack([np.linspace(14.0, 16.0, 100), np.full(100, WALL * CELL - 2.0)])
    beams = ending_at(np.concatenate([line, behind, before]))
    opening, plan = opening_of(np.zeros(3), is_turned=False), plan_of(slice(0), np.zeros(3))
    (told,) = with_rooms_beyond([opening], plan, beams)
    assert (told.p_inner > 0.5) is is_seen
